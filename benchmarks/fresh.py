"""A theme in a process of its own: `python -m benchmarks.fresh THEME full|quick FOLDER ANSWER.json`.

A program, and not a worker of `multiprocessing`, whose way of starting processes would become that of the peers in it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .figures import Figure
from .measuring import ROOT, Spread
from .themes import FULL, THEMES


def figures_of(name: str, full: bool, folder: Path) -> list[Figure]:
    """Of one theme, in this process; `full`: at its larger size where it has one."""
    return list(({**THEMES, **FULL} if full else THEMES)[name](folder))


def in_fresh_process(name: str, full: bool, folder: Path) -> list[Figure]:
    """Raises `CalledProcessError` where the theme fails; what it says goes to the standard error."""
    with TemporaryDirectory() as room:
        answer = Path(room) / "figures.json"
        words = [name, "full" if full else "quick", str(folder), str(answer)]
        os.sync()  # what another theme has written would be carried to the disk while this one is measured
        subprocess.run([sys.executable, "-m", "benchmarks.fresh", *words], cwd=ROOT, check=True)
        return [figure_from(table) for table in json.loads(answer.read_text(encoding="utf-8"))]


def figure_from(table: Mapping[str, Any]) -> Figure:
    """The inverse of `dataclasses.asdict`."""
    spreads = {key: Spread(**table[key]) if table[key] else None for key in ("value", "near")}
    return Figure(**{**table, **spreads})


def main(words: list[str]) -> None:
    name, size, folder, answer = words
    tables = [asdict(figure) for figure in figures_of(name, size == "full", Path(folder))]
    Path(answer).write_text(json.dumps(tables), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
