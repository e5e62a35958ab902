"""What there is to measure, by name."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from .crowded import fill
from .figures import Figure
from .ingest import measure_ingest, measure_memory
from .listings import LARGE, SMALL, compare, measure_listings
from .measuring import FOLDER_VARIABLE
from .postgres import SERVER_VARIABLE, empty_databases
from .series import measure_series


def _series(folder: Path) -> Iterator[Figure]:
    for old in folder.glob("series.db*"):
        old.unlink()
    return measure_series(f"sqlite:///{folder / 'series.db'}", folder)


def _listings_on_postgres(_folder: Path) -> Iterator[Figure]:
    with empty_databases(os.environ[SERVER_VARIABLE], 2) as urls:
        for url, impacts in zip(urls, (SMALL, LARGE), strict=True):
            fill(url, impacts)
        yield from compare(urls[0], urls[1], repeats=15)


def _series_on_postgres(folder: Path) -> Iterator[Figure]:
    with empty_databases(os.environ[SERVER_VARIABLE], 1) as (url,):
        yield from measure_series(url, folder)


THEMES: dict[str, Callable[[Path], Iterator[Figure]]] = {
    "ingest": measure_ingest,
    "memory": measure_memory,
    "listings": measure_listings,
    "series": _series,
}
if SERVER_VARIABLE in os.environ:  # without a server only SQLite is measured
    THEMES |= {"listings-postgresql": _listings_on_postgres, "series-postgresql": _series_on_postgres}


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
