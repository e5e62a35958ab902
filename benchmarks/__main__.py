"""`python -m benchmarks [--full] [THEME…]` measures themes and prints their figures; all of them
make the page.

Without --full the page is docs/measurements/benchmarks.md with its two pictures, with it
docs/measurements/benchmarks-full.md. Each theme has a fresh process: imports, compiled functions
and memory of another theme do not count. The exit code is 1 where a promise is lost or a theme
failed.
"""

from __future__ import annotations

import importlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from .harness import ROOT, Figure, Spread, work_folder
from .page import FULL_COMMAND, QUICK_COMMAND, draw_growth, draw_ratios, page

DOCS = ROOT / "docs"
PICTURES = ("images/benchmarks.png", "images/benchmarks-growth.png")


@dataclass(frozen=True)
class Theme:
    """A function of a folder, and its arguments at the quick and the full size; None: it has one
    size.

    Its module is imported when it is measured: a theme that cannot be loaded does not stop the
    others.
    """

    module: str
    function: str
    quick: Mapping[str, Any] = field(default_factory=dict)
    full: Mapping[str, Any] | None = None

    def measure(self, folder: Path, full: bool) -> Iterator[Figure]:
        function = getattr(importlib.import_module(f".{self.module}", __package__), self.function)
        yield from function(folder, **(self.full if full and self.full is not None else self.quick))


_SERIES = (
    "51.2 kHz, 16 bits in float32",
    "51.2 kHz, 24 bits in float32",
    "1 MHz, 16 bits in float32",
)
THEMES: dict[str, Theme] = {
    "ingest": Theme("ingest", "measure_ingest", {"recordings": 60, "formats": (".mat",)}, {}),
    "memory": Theme("ingest", "measure_memory", {"recordings": 40, "repeats": 2}, {}),
    "row-hashes": Theme("row_hashes", "measure_row_hashes", {"recordings": 15, "repeats": 6}, {}),
    "pulses": Theme("pulses", "measure_pulses"),
    "series": Theme("series", "measure_series", {"only": _SERIES, "repeats": 9}, {}),
    "querying": Theme("series", "measure_querying", {}, {"recordings": 180}),
    "listings": Theme("library", "measure_listings", {"large": 100_000}, {}),
    "growth": Theme("growth", "measure_growth", {}, {"budget_s": float("inf")}),
    "start-up": Theme("library", "measure_start_up", {"repeats": 3}),
    "library": Theme("library", "measure_library"),
    "serving": Theme("serving", "measure_serving", {}, {"repeats": 5}),
    "srs": Theme("srs", "measure_srs"),
    "gun": Theme("gun", "measure_gun", {}, {"valve_share": 1}),
    "impacts": Theme("impacts", "measure_impacts"),
    "coupled": Theme("coupled", "measure_coupled"),
    "plate": Theme("plate", "measure_plate"),
    "prediction": Theme("prediction", "measure_prediction", {"runs": 20}),
    "coregional": Theme("coregional", "measure_coregional", {}, {"full": True}),
    "genetic": Theme("genetic", "measure_genetic"),
    "designs": Theme("designs", "measure_designs"),
    "diagnosing": Theme(
        "diagnosing", "measure_diagnosing", {}, {"campaigns": 24, "learn_from": 40}
    ),
}
if not sys.platform.startswith("linux"):  # memory of a family of processes is read from /proc
    del THEMES["memory"]


def measured(name: str, full: bool, folder: Path) -> list[Figure]:
    """A theme's figures from a process of its own; of one that fails, a figure that does not
    hold."""
    try:
        return in_fresh_process(name, full, folder)
    except Exception as error:  # noqa: BLE001
        # the minutes of the other themes are not lost with it
        sys.stderr.write(f"{name}: {error!r}\n")
        return [
            Figure(
                name,
                "the measurement itself",
                f"failed: {type(error).__name__}",
                "—",
                None,
                limit=1.0,
            )
        ]


def in_fresh_process(name: str, full: bool, folder: Path) -> list[Figure]:
    """Raises `CalledProcessError` where the theme fails.

    A program, and not a worker of `multiprocessing`, whose way of starting processes the peers in
    it would inherit.
    """
    with TemporaryDirectory() as place:
        answer = Path(place) / "figures.json"
        os.sync()  # data of another theme would be written to the disk while this one is measured
        words = ["--figures-of", name, "full" if full else "quick", str(folder), str(answer)]
        subprocess.run([sys.executable, "-m", "benchmarks", *words], cwd=ROOT, check=True)
        return [figure_from(table) for table in json.loads(answer.read_text(encoding="utf-8"))]


def write_figures(name: str, size: str, folder: str, answer: str) -> int:
    """The other side of `in_fresh_process`."""
    tables = [asdict(figure) for figure in THEMES[name].measure(Path(folder), size == "full")]
    Path(answer).write_text(json.dumps(tables), encoding="utf-8")
    return 0


def figure_from(table: Mapping[str, Any]) -> Figure:
    """The inverse of `dataclasses.asdict`."""
    spreads = {key: Spread(**table[key]) if table[key] else None for key in ("value", "over_bound")}
    return Figure(**{**table, **spreads})


def main(words: Sequence[str]) -> int:
    if words[:1] == ["--figures-of"]:
        return write_figures(*words[1:])
    full, names = "--full" in words, [word for word in words if word != "--full"]
    unknown = sorted(set(names) - set(THEMES))
    if unknown:
        sys.stderr.write(f"unknown: {', '.join(unknown)}; known: --full, {', '.join(THEMES)}\n")
        return 2
    begin, figures = time.monotonic(), list[Figure]()
    with work_folder() as folder:
        for name in names or THEMES:
            theme_begin, theme_figures = time.monotonic(), measured(name, full, folder)
            figures += theme_figures
            rows = "".join(f"{figure.row()}\n" for figure in theme_figures)
            sys.stdout.write(f"{rows}{name}: {time.monotonic() - theme_begin:.0f} s\n")
            sys.stdout.flush()
        if not names:
            write(figures, full, (time.monotonic() - begin) / 60, folder)
    lost = [figure for figure in figures if figure.binding and not figure.holds]
    names_lost = "; ".join(figure.name for figure in lost) or "none"
    sys.stdout.write(f"{len(figures)} figures, promises lost: {names_lost}\n")
    return 1 if lost else 0


def write(
    figures: Sequence[Figure], full: bool, minutes: float, folder: Path, docs: Path = DOCS
) -> Path:
    """The page and, for the quick sizes, its pictures in `docs`; the theme "growth" leaves its
    points in `folder`."""
    path = docs / "measurements" / f"benchmarks{'-full' if full else ''}.md"
    path.parent.mkdir(parents=True, exist_ok=True)
    pictures = []
    if not full:
        draw_ratios(figures, docs / PICTURES[0])
        pictures.append(f"../{PICTURES[0]}")
        if (points := folder / "growth.json").is_file():
            draw_growth(json.loads(points.read_text(encoding="utf-8")), docs / PICTURES[1])
            pictures.append(f"../{PICTURES[1]}")
    path.write_text(
        page(figures, FULL_COMMAND if full else QUICK_COMMAND, minutes, pictures), encoding="utf-8"
    )
    return path


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
