"""Answers as they come, a line of JSON each: a check that is stopped goes on where it was."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class CaseJournal:
    """`path` holds one line for each case that was answered. None: nothing is kept."""

    path: Path | None

    def read(self) -> dict[str, dict[str, Any]]:
        """Answers by case. A last line that was cut off by a kill is no answer; it is cut away."""
        if self.path is None or not self.path.exists():
            return {}
        whole = self.path.read_bytes()
        ended = whole[: whole.rfind(b"\n") + 1]
        if ended != whole:
            self.path.write_bytes(ended)
        return {row["case"]: row for row in map(json.loads, ended.splitlines())}

    def add(self, answer: Mapping[str, Any]) -> None:
        if self.path is None:
            return
        with self.path.open("ab") as file:
            file.write(json.dumps(answer, allow_nan=False).encode() + b"\n")
