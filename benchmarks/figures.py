"""A measured figure, and the document that shows them all."""

from __future__ import annotations

import datetime as dt
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from operator import ge, le
from pathlib import Path
from typing import Literal

from .measuring import ROOT, Spread

DOCUMENT = ROOT / "docs" / "benchmarks.md"
_PACKAGES = ("numpy", "scipy", "h5py", "numcodecs", "SQLAlchemy", "psycopg")


@dataclass(frozen=True)
class Figure:
    """`value` is measured and promised to be `sense` `limit` (None: told, not promised).

    `ours` and `peer` are what it is the ratio of; `nature` names what bounds it, and how near we come.
    """

    theme: str
    name: str
    ours: str
    peer: str
    value: Spread
    sense: Literal["at most", "at least"] = "at most"
    limit: float | None = None
    nature: str = ""
    #: Whether losing it fails `make bench`. What does not bind is shown all the same, and as lost where it is.
    binding: bool = True

    @property
    def holds(self) -> bool:
        return self.limit is None or {"at most": le, "at least": ge}[self.sense](self.value.median, self.limit)

    @property
    def promise(self) -> str:
        if self.limit is None:
            return "—"
        return f"{self.sense} {self.limit:g}: {'holds' if self.holds else '**lost**'}"

    def row(self) -> str:
        cells = (self.name, self.ours, self.peer, self.value.text(), self.promise, self.nature)
        return "| " + " | ".join(cells) + " |"


def document(figures: Sequence[Figure]) -> str:
    """The page of all figures, by theme."""
    parts = ["# Benchmarks", "", *_preface()]
    for theme in dict.fromkeys(figure.theme for figure in figures):
        rows = [figure.row() for figure in figures if figure.theme == theme]
        head = "| figure | ours | peer | ratio | promised | what bounds it |"
        parts += ["", f"## {theme}", "", head, "| --- " * 6 + "|", *rows]
    return "\n".join(parts) + "\n"


def write(figures: Sequence[Figure], path: Path = DOCUMENT) -> None:
    path.write_text(document(figures), encoding="utf-8")


def _preface() -> list[str]:
    versions = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    return [
        "Written by `python -m benchmarks`; `make bench` measures the same and fails where a promise is lost.",
        "Ratios are ours over the peer's in the same run, the repeats of both interleaved: median (least to largest).",
        'A ratio "at least" is the peer\'s time over ours. Where we lose, the table says so.',
        "",
        f"On {dt.datetime.now(dt.UTC):%Y-%m-%d}: {machine()}; Python {platform.python_version()}, {versions}.",
    ]


def machine() -> str:
    """Processor, cores that may be used, and system."""
    import os

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{_processor()}, {cores} cores, {platform.system()}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())
