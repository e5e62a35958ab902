"""What a search has found so far, on disk: one line for each evaluation, and nothing that must be kept in step."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

Key = tuple[int, ...]


class SearchJournal:
    """Values by key, in a file of JSON lines whose first tells which search it belongs to; no file without `path`.

    A line reaches the disk before `add` returns. A run that is killed leaves whole lines, and at most the last one
    torn: that one is cut off when the file is opened again. Not for two runs at once.
    """

    def __init__(self, path: Path | None, search: Mapping[str, Any]) -> None:
        """Opens or begins the file. Raises `ValueError` where it belongs to another search."""
        self.path = path
        self.values: dict[Key, float] = {}
        if path is None:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = _whole_lines(path)
        if not lines:
            self._write({"search": dict(search)})
        elif lines[0].get("search") != json.loads(json.dumps(dict(search))):
            raise ValueError(
                f"{path} belongs to another search (other data, settings or seed): delete it, or name another"
            )
        for line in lines[1:]:
            self.values[tuple(line["key"])] = float(line["value"])

    def add(self, key: Key, value: float) -> None:
        self.values[key] = value
        self._write({"key": list(key), "value": value})

    def _write(self, line: dict[str, Any]) -> None:
        """One write of one line at the end of the file, and through to the disk."""
        if self.path is None:
            return
        file = os.open(self.path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
        try:
            os.write(file, json.dumps(line).encode() + b"\n")
            os.fsync(file)
        finally:
            os.close(file)


def _whole_lines(path: Path) -> list[dict[str, Any]]:
    """The lines that were written to their end; what stands behind them is cut off."""
    if not path.exists():
        return []
    content = path.read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    if len(whole) < len(content):
        os.truncate(path, len(whole))
    try:
        lines = [json.loads(line) for line in whole.splitlines()]
        if all(isinstance(line, dict) for line in lines) and all({"key", "value"} <= set(line) for line in lines[1:]):
            return lines
    except ValueError:
        pass
    raise ValueError(f"{path} is no journal of a search: delete it, or name another")
