"""What there is to measure, by name: `THEMES` in a few minutes together, `FULL` those that have a larger size too.

A theme is a function of a folder, where what is dear to make is left for the next, that gives its figures. Its module
is imported when it is measured: a theme that cannot be loaded takes no other with it.
"""

from __future__ import annotations

import importlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from .figures import Figure
from .measuring import FOLDER_VARIABLE
from .postgres import SERVER_VARIABLE

Measure = Callable[[Path], Iterator[Figure]]


def later(module: str, function: str, **sizes: Any) -> Measure:
    """`function` of `benchmarks.MODULE` with these sizes, imported when it is called."""
    return partial(_measure, module, function, sizes)


def _measure(module: str, function: str, sizes: dict[str, Any], folder: Path) -> Iterator[Figure]:
    found = getattr(importlib.import_module(f".{module}", __package__), function)
    yield from found(folder, **sizes)


_SERIES = ("51.2 kHz, 16 bits in float32", "51.2 kHz, 24 bits in float32", "1 MHz, 16 bits in float32")
THEMES: dict[str, Measure] = {
    "ingest": later("ingest", "measure_ingest", recordings=60, formats=(".mat",)),
    "memory": later("ingest", "measure_memory", recordings=40, repeats=2),
    "pulses": later("extraction", "measure_pulses"),
    "series": later("series", "measure_series_on_sqlite", only=_SERIES, repeats=9),
    "querying": later("querying", "measure_querying"),
    "listings": later("listings", "measure_listings", large=100_000),
    "growth": later("growth", "measure_growth"),
    "start-up": later("startup", "measure_startup", repeats=3),
    "library": later("library", "measure_library"),
    "srs": later("spectra", "measure_spectra"),
    "gun": later("gun", "measure_gun"),
    "impacts": later("impacts", "measure_impacts"),
    "coupled": later("coupled", "measure_coupled"),
    "plate": later("plates", "measure_plates"),
    "prediction": later("predictions", "measure_predictions", runs=20),
    "coregional": later("coregional", "measure_coregional"),
    "genetic": later("networks", "measure_networks"),
    "designs": later("hypercubes", "measure_hypercubes"),
    "diagnosing": later("diagnosing", "measure_diagnosing"),
}
FULL: dict[str, Measure] = {
    "ingest": later("ingest", "measure_ingest"),
    "memory": later("ingest", "measure_memory"),
    "listings": later("listings", "measure_listings"),
    "series": later("series", "measure_series_on_sqlite"),
    "querying": later("querying", "measure_querying", full=True),
    "growth": later("growth", "measure_growth", full=True),
    "gun": later("gun", "measure_gun", full=True),
    "coregional": later("coregional", "measure_coregional", full=True),
    "diagnosing": later("diagnosing", "measure_diagnosing", full=True),
}
if SERVER_VARIABLE in os.environ:  # without a server only SQLite is measured
    FULL |= {
        "listings-postgresql": later("listings", "measure_listings_on_postgres"),
        "series-postgresql": later("series", "measure_series_on_postgres"),
    }
if not sys.platform.startswith("linux"):  # memory of a family of processes is read from /proc
    del THEMES["memory"], FULL["memory"]


@contextmanager
def work_folder() -> Iterator[Path]:
    """$PYROSHOCK_BENCH_FOLDER, where what is dear to make is kept; else a folder that is gone afterwards."""
    named = os.environ.get(FOLDER_VARIABLE)
    if named:
        Path(named).mkdir(parents=True, exist_ok=True)
        yield Path(named)
        return
    with tempfile.TemporaryDirectory(prefix="pyroshock-bench-") as folder:
        yield Path(folder)
