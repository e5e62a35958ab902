"""Tables for other programs, streamed: a file is written batch by batch, so memory does not grow with it.

A file grows under another name and takes its own when it is whole.
"""

from __future__ import annotations

import csv
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from contextlib import closing
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.campaigns import Factor, FactorLevel
from ..schema.conditions import CHANNEL_COLUMNS
from ..schema.impacts import Pulse
from ..schema.listings import Condition, iter_impacts, iter_shots, listing_key
from ..schema.outputs import whole_file
from .predictions.nominal import with_predictions
from .pulses.impact import LISTED_FIGURES, list_channel_figures
from .pulses.series import series_batches

Row = dict[str, Any]

#: Rows per batch of a table.
BATCH = 10_000


def export_table(
    session: Session,
    what: str,
    out: Path,
    campaign: str | None = None,
    where: tuple[Condition, ...] = (),
    recording: str | None = None,
    left_out: list[str] | None = None,
) -> int:
    """Write `what` ("impacts", "shots", "pulses", "channel-figures", "series") to `out`, CSV or Parquet by its suffix;
    returns the rows.

    Damaged series are left out and named in `left_out`, where it is given. Raises `ValueError` for another suffix,
    `LookupError` for an unknown campaign or recording, `SeriesError` for a damaged series.
    """
    if what == "series":
        if where:
            raise ValueError("--where does not filter series; choose a --campaign or a --recording")
        batches = series_batches(session, campaign, recording, left_out)
    elif recording is not None:
        raise ValueError("--recording goes with series; filter other tables with --where")
    else:
        batches = _in_batches(_TABLES[what](session, campaign, where), _factor_columns(session, what))
    return write_batches(out, batches)


def _impacts(session: Session, campaign: str | None, where: tuple[Condition, ...]) -> Iterator[Row]:
    return iter_impacts(session, campaign, where)


def _shots(session: Session, campaign: str | None, where: tuple[Condition, ...]) -> Iterator[Row]:
    return with_predictions(session, iter_shots(session, campaign, where))


def _pulses(session: Session, campaign: str | None, where: tuple[Condition, ...]) -> Iterator[Row]:
    """Impacts that have a pulse, with all its figures and the equidistant forces as columns."""
    impacts = iter_impacts(session, campaign, where)
    while batch := list(islice(impacts, 500)):
        keys = [row["id"] for row in batch]
        pulses = {
            p.impact_id: p for p in session.scalars(select(Pulse).where(Pulse.impact_id.in_(keys), Pulse.current))
        }
        for row in batch:
            if row["id"] in pulses:
                yield {**row, **_pulse_columns(pulses[row["id"]])}


def _pulse_columns(pulse: Pulse) -> Row:
    names = (
        "start_s",
        "spline_peak_force_n",
        "compression_impulse_n_s",
        "width_half_s",
        "width_tenth_s",
        "samples_in_contact",
        "spline_nrmse",
        "segmentation_difference",
    )
    forces = {f"force_{i:02d}_n": force for i, force in enumerate(pulse.force_points_n, 1)}
    return {name: getattr(pulse, name) for name in names} | forces


def _channel_figures(session: Session, campaign: str | None, where: tuple[Condition, ...]) -> Iterator[Row]:
    """A row for each acceleration channel of an impact: run and factors, then the channel's figures."""
    impacts = iter_impacts(session, campaign, where)
    while batch := list(islice(impacts, 500)):
        figures = list_channel_figures(session, [row["id"] for row in batch])
        for row in batch:
            shared = {name: value for name, value in row.items() if name not in CHANNEL_COLUMNS}
            for channel in figures.get(row["id"], ()):
                lines = {name: channel.get(name) for name in _SUMMARY}
                yield {**shared, **{name: channel[name] for name in ("channel", *LISTED_FIGURES)}, **lines}


#: Lines of the spectrum's summary that a table has, up to a tenth of 4 MHz; a record holds some of them.
_SUMMARY = tuple(f"srs_{10 * 2**i}hz_m_s2" for i in range(16))

_TABLES = {"impacts": _impacts, "shots": _shots, "pulses": _pulses, "channel-figures": _channel_figures}


def _factor_columns(session: Session, what: str) -> dict[str, bool]:
    """Factors of the store, and whether each holds words: later rows may have one that the first has not, but the
    header comes first; and a column of a free factor may hold numbers in one campaign and words in another."""
    if what == "shots":
        return {}
    words = set(session.scalars(select(FactorLevel.factor_id).where(FactorLevel.number.is_(None)).distinct()))
    factors = session.scalars(select(Factor).order_by(Factor.id))
    return {listing_key(f.name, f.si_unit): f.id in words for f in factors}


def _in_batches(rows: Iterator[Row], factors: dict[str, bool]) -> Iterator[dict[str, list[Any]]]:
    columns: list[str] = []
    while batch := list(islice(rows, BATCH)):
        if not columns:
            own = list(batch[0])
            at = own.index("repetition") + 1
            columns = own[:at] + list(factors) + [name for name in own[at:] if name not in factors]
        yield {name: [_cell(row.get(name), factors.get(name, False)) for row in batch] for name in columns}


def _cell(value: Any, as_word: bool) -> Any:
    return value if value is None or not as_word else str(value)


class _Writer(ABC):
    """A file that takes batches of columns."""

    @abstractmethod
    def __init__(self, path: Path) -> None: ...

    @abstractmethod
    def add(self, batch: dict[str, list[Any]]) -> None: ...

    @abstractmethod
    def close(self) -> None: ...


class _Csv(_Writer):
    def __init__(self, path: Path) -> None:
        self._file: TextIO = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file)
        self._header = False

    def add(self, batch: dict[str, list[Any]]) -> None:
        if not self._header:
            self._writer.writerow(batch)
            self._header = True
        self._writer.writerows(zip(*batch.values(), strict=True))

    def close(self) -> None:
        self._file.close()


class _Parquet(_Writer):
    def __init__(self, path: Path) -> None:
        self._path = path
        self._writer: Any = None

    def add(self, batch: dict[str, list[Any]]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if self._writer is None:
            table = pa.table(batch)
            # A column that is empty in the first batch may hold numbers later; text columns are never numbers.
            fields = [f.with_type(pa.float64()) if pa.types.is_null(f.type) else f for f in table.schema]
            self._writer = pq.ParquetWriter(self._path, pa.schema(fields), compression="zstd")
        self._writer.write_table(pa.table(batch, schema=self._writer.schema))

    def close(self) -> None:
        if self._writer is not None:
            self._writer.close()


_WRITERS: dict[str, type[_Writer]] = {".csv": _Csv, ".parquet": _Parquet}


def write_batches(out: Path, batches: Iterable[dict[str, list[Any]]]) -> int:
    if out.suffix.lower() not in _WRITERS:
        raise ValueError(f"cannot write {out.name!r}; expected a name that ends in {' or '.join(_WRITERS)}")
    rows = 0
    with whole_file(out) as partial, closing(_WRITERS[out.suffix.lower()](partial)) as writer:
        for batch in batches:
            writer.add(batch)
            rows += len(next(iter(batch.values())))
        if not rows:
            raise ValueError(f"nothing to write to {out.name!r}: no row matches")
    return rows
