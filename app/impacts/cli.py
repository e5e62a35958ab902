"""`show`: one impact, as far as the store knows it.

`impacts`, `shots`: what is in the store.

`export`: tables and series out of the store, for any other program.

Tables of the store for other programs, streamed: memory does not grow with them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

import click
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from ...schema.conditions import CHANNEL_COLUMNS, IMPACT_COLUMNS, IN_USE, LARGEST, restricted
from ...schema.impacts import ChannelFigures, Impact, Pulse
from ...schema.listings import Condition, iter_impacts, iter_shots, listing_key
from ..cli.common import db_option, format_cell, json_option, note, open_command_store, print_table, write_json
from ..cli.completion import campaign_names
from ..cli.listed import Listing, listing_options
from ..common.nominal_velocity import with_predictions
from ..common.table_files import Batch, check_columns, write_batches
from .impact import LISTED_FIGURES, list_channel_figures
from .signals import series_batches


@click.command()
@click.argument("impact", type=int)
@db_option
@json_option
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Draw record and pulse into FILE (.png, .svg, .pdf).",
)
def show(impact: int, db: str, json_to: str | None, plot: Path | None) -> None:
    """Show the impact with number IMPACT: factors, pulse, its versions, figures of each acceleration
    channel, findings, channels.

    \b
    Example:
        pyroshock show 12 --plot impact-12.png
    """
    with open_command_store(db) as store, store.reading() as session:
        from .impact import impact_page

        page = impact_page(session, impact)
        if plot is not None:
            from .impact import plot_impact

            plot_impact(session, impact, plot)
            note(f"plot: {plot}")
        if json_to is not None:
            write_json(page, json_to)
            return
    for key, value in page.items():
        if isinstance(value, list):
            click.echo(f"\n{key}")
            print_table(value, "  none")
        else:
            click.echo(f"{key:24} {format_cell(value)}")


_CAMPAIGN = click.option("--campaign", metavar="NAME", help="Only of this campaign.", shell_complete=campaign_names)
_WHERE = click.option(
    "--where",
    multiple=True,
    metavar="CONDITION",
    help='FIELD=VALUE, also != < <= > >=; repeat to narrow ("tip_material=steel").',
)
_LIMIT = click.option("--limit", type=click.IntRange(1), help="At most this many rows.")


@click.command()
@db_option
@listing_options
@_CAMPAIGN
@_WHERE
@_LIMIT
def impacts(db: str, listing: Listing, campaign: str | None, where: tuple[str, ...], limit: int | None) -> None:
    """List impacts with their factors, the figures of the pulse in use, and those of the acceleration channel with the
    largest peak. Numbers are SI.

    \b
    Example:
        pyroshock impacts --campaign spring --where tip_material=steel --where "peak_force_n>1000"
        pyroshock impacts --where "peak_acceleration_m_s2>1000"
        pyroshock impacts --sort -peak_force_n --columns id,tip_material,peak_force_n --csv
    """
    with open_command_store(db) as store, store.reading() as session:
        from itertools import islice

        from ...schema.listings import iter_impacts
        from ..common.filters import parse_where
        from .impact import without_empty_figures

        rows = list(islice(iter_impacts(session, campaign, parse_where(where)), limit))
        listing.show(rows if listing.is_chosen else without_empty_figures(rows), "no impacts match")


@click.command()
@db_option
@listing_options
@_CAMPAIGN
@_WHERE
@_LIMIT
def shots(db: str, listing: Listing, campaign: str | None, where: tuple[str, ...], limit: int | None) -> None:
    """List shots of the gun: pressure (gauge), mass, measured velocity, and the nominal model's. Numbers are SI.

    \b
    Example:
        pyroshock shots --campaign first-shots
    """
    with open_command_store(db) as store, store.reading() as session:
        from itertools import islice

        from ...schema.listings import iter_shots
        from ..common.filters import parse_where
        from ..common.nominal_velocity import with_predictions

        shots = iter_shots(session, campaign, parse_where(where))
        rows = list(islice(with_predictions(session, shots), limit))
        listing.show(rows, "no shots match")


@click.command()
@click.argument("what", type=click.Choice(["impacts", "shots", "pulses", "channel-figures", "series"]))
@db_option
@click.option(
    "--out", required=True, type=click.Path(dir_okay=False, path_type=Path), help="FILE.csv, .parquet or .json."
)
@click.option("--campaign", metavar="NAME", help="Only of this campaign.", shell_complete=campaign_names)
@click.option("--where", multiple=True, metavar="CONDITION", help="As for `impacts`; not for series.")
@click.option("--recording", metavar="PATH", help="Series: only of this recording (its path in the campaign folder).")
@click.option("--columns", metavar="A,B,…", help="Only these columns, in this order. [all that the selection has]")
@click.option("--skip-damaged", is_flag=True, help="Series: leave damaged ones out, and name them.")
def export(
    what: str,
    db: str,
    out: Path,
    campaign: str | None,
    where: tuple[str, ...],
    recording: str | None,
    columns: str | None,
    skip_damaged: bool,
) -> None:
    """Write impacts, shots, pulses (in use, with their force points), figures of the acceleration channels or series
    (in SI) to a file. A factor that no selected impact has is no column.

    \b
    Example:
        pyroshock export impacts --out impacts.csv --columns run,tip_material,peak_force_n
        pyroshock export series --campaign spring --recording recordings/0001.mat --out 0001.parquet
    """
    with open_command_store(db) as store, store.reading() as session:
        from ..cli.listed import column_names
        from ..common.filters import parse_where

        left_out: list[str] = []
        rows = export_table(
            session,
            what,
            out,
            campaign,
            parse_where(where),
            recording,
            left_out if skip_damaged else None,
            column_names(columns),
        )
    for column in left_out:
        note(f"left out: {column}")
    note(f"{rows} rows written: {out}")


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
    """Write `what` ("impacts", "shots", "pulses", "channel-figures", "series") to `out`, CSV, Parquet or JSON by its
    suffix; returns the rows.

    `columns` are those to write, in this order; without them all that the selection has. Damaged series are left out
    and named in `left_out`, where it is given. Raises `ValueError` for another suffix, `LookupError` for an unknown
    campaign, recording or column, `SeriesError` for a damaged series.
    """
    if what == "series":
        if where:
            raise ValueError("--where does not filter series; choose a --campaign or a --recording")
        batches = series_batches(session, campaign, recording, left_out)
    elif recording is not None:
        raise ValueError("--recording goes with series; filter other tables with --where")
    else:
        factors, empty = _own_columns(session, what, campaign, where)
        batches = _in_batches(_TABLES[what](session, campaign, where), factors, empty)
    return write_batches(out, _only(batches, columns) if columns else batches)


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


def _own_columns(
    session: Session, what: str, campaign: str | None, where: tuple[Condition, ...]
) -> tuple[dict[str, bool], set[str]]:
    """Factors of the selection, and whether each holds words; and the columns that it leaves empty.

    Later rows may have a factor that the first has not, but the header comes first; and a column of a free factor may
    hold numbers in one campaign and words in another.
    """
    if what == "shots":
        return {}, set()
    selected = select(Impact.configuration_id).join(Campaign, Impact.campaign_id == Campaign.id)
    selected = selected.join(Pulse, IN_USE, isouter=what != "pulses")
    selected = selected.join(ChannelFigures, LARGEST, isouter=what != "channel-figures")
    selected, _ = restricted(session, selected, Impact, IMPACT_COLUMNS, campaign, where)
    of_them = ConfigurationLevel.configuration_id.in_(selected.distinct())
    present = set(session.scalars(select(ConfigurationLevel.factor_id).where(of_them).distinct()))
    words = set(session.scalars(select(FactorLevel.factor_id).where(FactorLevel.number.is_(None)).distinct()))
    factors = session.scalars(select(Factor).where(Factor.id.in_(present)).order_by(Factor.id))
    accelerations = session.scalar(selected.where(ChannelFigures.id.is_not(None)).limit(1)) is not None
    empty = set() if accelerations else set(CHANNEL_COLUMNS)
    return {listing_key(f.name, f.si_unit): f.id in words for f in factors}, empty


def _in_batches(rows: Iterator[Row], factors: dict[str, bool], empty: set[str]) -> Iterator[Batch]:
    columns: list[str] = []
    while batch := list(islice(rows, BATCH)):
        if not columns:
            own = [name for name in batch[0] if name not in empty]
            at = own.index("repetition") + 1
            columns = own[:at] + list(factors) + [name for name in own[at:] if name not in factors]
        yield {name: [_cell(row.get(name), factors.get(name, False)) for row in batch] for name in columns}


def _cell(value: Any, as_word: bool) -> Any:
    return value if value is None or not as_word else str(value)


def _only(batches: Iterator[Batch], columns: Sequence[str]) -> Iterator[Batch]:
    for batch in batches:
        check_columns(columns, batch)
        yield {name: batch[name] for name in columns}
