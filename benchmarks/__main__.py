"""`python -m benchmarks [--full] [THEME…]`: measure, and tell each figure; all themes together make the page.

Without --full the page is docs/measurements/benchmarks.md with its two pictures, with it benchmarks-full.md beside it.
Each theme has a fresh process: what another one imported, compiled or left in memory does not count.
The exit code is 1 where a promise is lost or a theme failed.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from . import picture
from .figures import Figure
from .fresh import in_fresh_process
from .measuring import ROOT
from .page import FULL_COMMAND, QUICK_COMMAND, page
from .themes import FULL, THEMES, work_folder

DOCS = ROOT / "docs"
PICTURES = ("images/benchmarks.png", "images/benchmarks-growth.png")


def measured(name: str, full: bool, folder: Path) -> list[Figure]:
    """A theme's figures from a process of its own; of one that fails, a figure that does not hold."""
    try:
        return in_fresh_process(name, full, folder)
    except Exception as error:  # noqa: BLE001  # whatever it is, the other themes' minutes are not lost with it
        sys.stderr.write(f"{name}: {error!r}\n")
        return [Figure(name, "the measurement itself", f"failed: {type(error).__name__}", "—", None, limit=1.0)]


def main(words: Sequence[str]) -> int:
    full, names = "--full" in words, [word for word in words if word != "--full"]
    known = {**THEMES, **FULL} if full else THEMES
    unknown = sorted(set(names) - set(known))
    if unknown:
        sys.stderr.write(f"unknown: {', '.join(unknown)}; known: --full, {', '.join(known)}\n")
        return 2
    begin, figures = time.monotonic(), list[Figure]()
    with work_folder() as folder:
        for name in names or known:
            started = time.monotonic()
            found = measured(name, full, folder)
            figures += found
            rows = "".join(f"{one.row()}\n" for one in found)
            sys.stdout.write(f"{rows}{name}: {time.monotonic() - started:.0f} s\n")
            sys.stdout.flush()
        if not names:
            write(figures, full, (time.monotonic() - begin) / 60, folder)
    lost = [figure for figure in figures if figure.binding and not figure.holds]
    sys.stdout.write(f"{len(figures)} figures, promises lost: {'; '.join(one.name for one in lost) or 'none'}\n")
    return 1 if lost else 0


def write(figures: Sequence[Figure], full: bool, minutes: float, folder: Path, docs: Path = DOCS) -> Path:
    """The page and, for the quick sizes, its pictures in `docs`."""
    if full:
        path = docs / "measurements" / "benchmarks-full.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(page(figures, FULL_COMMAND, minutes), encoding="utf-8")
        return path
    picture.draw(figures, docs / PICTURES[0])
    drawn = [f"../{PICTURES[0]}", *_growth(folder, docs)]
    path = docs / "measurements" / "benchmarks.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(figures, QUICK_COMMAND, minutes, drawn), encoding="utf-8")
    return path


def _growth(folder: Path, docs: Path) -> list[str]:
    """The second picture, from what the theme "growth" left in `folder`."""
    points = folder / "growth.json"
    if not points.is_file():
        return []
    from .growth_plot import draw

    draw(json.loads(points.read_text(encoding="utf-8")), docs / PICTURES[1])
    return [f"../{PICTURES[1]}"]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
