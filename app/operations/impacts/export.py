"""Tables of the store for other programs, written batch by batch: memory does not grow with the
store."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from ....schema.conditions import CHANNEL_COLUMNS, IMPACT_COLUMNS, IN_USE, LARGEST, restricted
from ....schema.impacts import ChannelFigures, Impact, Pulse
from ....schema.listings import Condition, iter_impacts, iter_shots, listing_key
from ...common.nominal_velocity import with_predictions
from ...common.table_files import Batch, check_columns, write_batches
from .impact import LISTED_FIGURES, list_channel_figures
from .signals import series_batches

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
    columns: Sequence[str] = (),
) -> int:
    """Write `what` ("impacts", "shots", "pulses", "channel-figures", "series") to `out`, CSV,
    Parquet or JSON by its suffix; returns the rows. Series have no conditions, and only they are of
    a `recording`.

    `columns` are those to write, in this order; without them all that the selection has. Damaged
    series are left out and named in `left_out`, where it is given. Raises `ValueError` for another
    suffix, `LookupError` for an unknown campaign, recording or column, `SeriesError` for a damaged
    series.
    """
    if what == "series":
        batches = series_batches(session, campaign, recording, left_out)
    else:
        factors, empty = _own_columns(session, what, campaign, where)
        batches = _in_batches(_TABLES[what](session, campaign, where), factors, empty)
    return write_batches(out, _only(batches, columns) if columns else batches)


def _shots(session: Session, campaign: str | None, where: tuple[Condition, ...]) -> Iterator[Row]:
    return with_predictions(session, iter_shots(session, campaign, where))


def _pulses(session: Session, campaign: str | None, where: tuple[Condition, ...]) -> Iterator[Row]:
    """Impacts that have a pulse, with all its figures and the equidistant forces as columns."""
    impacts = iter_impacts(session, campaign, where)
    while batch := list(islice(impacts, 500)):
        keys = [row["id"] for row in batch]
        pulses = {
            p.impact_id: p
            for p in session.scalars(select(Pulse).where(Pulse.impact_id.in_(keys), Pulse.current))
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


def _channel_figures(
    session: Session, campaign: str | None, where: tuple[Condition, ...]
) -> Iterator[Row]:
    """A row for each acceleration channel of an impact: run and factors, then the channel's
    figures."""
    impacts = iter_impacts(session, campaign, where)
    while batch := list(islice(impacts, 500)):
        figures = list_channel_figures(session, [row["id"] for row in batch])
        for row in batch:
            shared = {name: value for name, value in row.items() if name not in CHANNEL_COLUMNS}
            for channel in figures.get(row["id"], ()):
                lines = {name: channel.get(name) for name in _SUMMARY}
                yield {
                    **shared,
                    **{name: channel[name] for name in ("channel", *LISTED_FIGURES)},
                    **lines,
                }


#: Lines of the spectrum's summary that a table has, up to a tenth of 4 MHz; a record holds some of
#: them.
_SUMMARY = tuple(f"srs_{10 * 2**i}hz_m_s2" for i in range(16))


_TABLES = {
    "impacts": iter_impacts,
    "shots": _shots,
    "pulses": _pulses,
    "channel-figures": _channel_figures,
}


def _own_columns(
    session: Session, what: str, campaign: str | None, where: tuple[Condition, ...]
) -> tuple[dict[str, bool], set[str]]:
    """Factors of the selection, and whether each holds words; and the columns that it leaves empty.

    Later rows may have a factor that the first has not, but the header comes first; and a column of
    a free factor may hold numbers in one campaign and words in another.
    """
    if what == "shots":
        return {}, set()
    selected = select(Impact.configuration_id).join(Campaign, Impact.campaign_id == Campaign.id)
    selected = selected.join(Pulse, IN_USE, isouter=what != "pulses")
    selected = selected.join(ChannelFigures, LARGEST, isouter=what != "channel-figures")
    selected, _ = restricted(session, selected, Impact, IMPACT_COLUMNS, campaign, where)
    of_them = ConfigurationLevel.configuration_id.in_(selected.distinct())
    present = set(session.scalars(select(ConfigurationLevel.factor_id).where(of_them).distinct()))
    words = set(
        session.scalars(
            select(FactorLevel.factor_id).where(FactorLevel.number.is_(None)).distinct()
        )
    )
    factors = session.scalars(select(Factor).where(Factor.id.in_(present)).order_by(Factor.id))
    accelerations = (
        session.scalar(selected.where(ChannelFigures.id.is_not(None)).limit(1)) is not None
    )
    empty = set() if accelerations else set(CHANNEL_COLUMNS)
    return {listing_key(f.name, f.si_unit): f.id in words for f in factors}, empty


def _in_batches(rows: Iterator[Row], factors: dict[str, bool], empty: set[str]) -> Iterator[Batch]:
    columns: list[str] = []
    while batch := list(islice(rows, BATCH)):
        if not columns:
            own = [name for name in batch[0] if name not in empty]
            at = own.index("repetition") + 1
            columns = own[:at] + list(factors) + [name for name in own[at:] if name not in factors]
        yield {
            name: [_cell(row.get(name), factors.get(name, False)) for row in batch]
            for name in columns
        }


def _cell(value: Any, as_word: bool) -> Any:
    return value if value is None or not as_word else str(value)


def _only(batches: Iterator[Batch], columns: Sequence[str]) -> Iterator[Batch]:
    for batch in batches:
        check_columns(columns, batch)
        yield {name: batch[name] for name in columns}
