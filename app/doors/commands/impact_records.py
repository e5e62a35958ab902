"""`show`: one impact, as far as the store knows it. `impacts`, `shots`: what is in the store.
`export`: tables and series for any other program."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...common.progress import progress_bar
from ...common.quantities import cell, heading, velocities_of
from ..command_line.common import (
    db_option,
    json_option,
    note,
    open_command_store,
    print_facts,
    print_table,
    spreadsheet_guard_option,
    write_json,
)
from ..command_line.completion import campaign_names
from ..command_line.listed import Listing, listing_options
from ..command_line.next_step import suggest_next
from ..command_line.options import split_names

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....schema.conditions import Condition


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
    """Show the impact with number IMPACT: its factors, its findings and its pulse.

    The versions of the pulse, the figures of each acceleration channel and the channels are listed,
    too.

    \b
    Example:
        pyroshock impacts show 12 --plot impact-12.png
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...operations.impacts.impact import impact_page

        page = impact_page(session, impact)
        if plot is not None:
            from ...figures.matplotlib_renderer import write_figure
            from ...operations.impacts.impact_plot import impact_figure

            write_figure(impact_figure(session, impact), plot)
            note(f"plot: {plot}")
        if json_to is not None:
            write_json(page, json_to)
            return
    with velocities_of([page]):
        print_facts(
            {
                key: value
                for key, value in page.items()
                if not isinstance(value, list) and value is not None
            }
        )
    for key, value in page.items():
        if isinstance(value, list):
            click.echo(f"\n{heading(key)}")
            print_table(value, "  none", upright=key in ("pulses", "channel_figures"))


_CAMPAIGN = click.option(
    "--campaign",
    metavar="NAME",
    help="Take the impacts of this campaign only.",
    shell_complete=campaign_names,
)
_WHERE = click.option(
    "--where",
    multiple=True,
    metavar="CONDITION",
    help=(
        "Select by FIELD=VALUE, also with != < <= > >=, such as "
        '"tip_material=steel". Several conditions must all hold.'
    ),
)
_LIMIT = click.option("--limit", type=click.IntRange(1), help="List at most this number of rows.")


def _no_match(session: Session, conditions: Iterable[Condition]) -> str:
    """That nothing matches, with the levels that the store has of each factor that was asked
    for."""
    from ....schema.listings import list_levels

    levels = list_levels(session, fewest=1)
    fields = dict.fromkeys(condition.field for condition in conditions if condition.field in levels)
    level_words = [
        f"{heading(field)} {', '.join(cell(field, level) for level in levels[field])}"
        for field in fields
    ]
    return "; the store has ".join(["no impacts match", *level_words])


@click.command()
@db_option
@listing_options
@_CAMPAIGN
@_WHERE
@_LIMIT
def impacts(
    db: str, listing: Listing, campaign: str | None, where: tuple[str, ...], limit: int | None
) -> None:
    """List impacts with their factors and figures.

    The figures are those of the pulse in use, and those of the acceleration channel with the
    largest peak. Numbers are in SI units.

    \b
    Example:
        pyroshock impacts --campaign rehearsal --where tip_material=steel --where
        "peak_force_n>1000" pyroshock impacts --sort -peak_force_n --columns
        id,tip_material,peak_force_n --csv
    """
    with open_command_store(db) as store, store.reading() as session:
        from ....schema.listings import iter_impacts
        from ...common.filters import parse_where
        from ...operations.impacts.impact import without_empty_figures

        conditions = parse_where(where)
        rows = list(islice(iter_impacts(session, campaign, conditions), limit))
        no_match = "no impacts match" if rows else _no_match(session, conditions)
        with velocities_of(rows):
            listing.show(rows if listing.is_chosen else without_empty_figures(rows), no_match)


@click.command()
@db_option
@listing_options
@_CAMPAIGN
@_WHERE
@_LIMIT
def shots(
    db: str, listing: Listing, campaign: str | None, where: tuple[str, ...], limit: int | None
) -> None:
    """List the shots of the gun with tank pressure (gauge), bullet mass, measured velocity and the
    velocity of the nominal model. Numbers are in SI units.

    \b
    Example:
        pyroshock shots --campaign first-shots
    """
    with open_command_store(db) as store, store.reading() as session:
        from ....schema.listings import iter_shots
        from ...common.filters import parse_where
        from ...common.nominal_velocity import with_predictions

        shots = iter_shots(session, campaign, parse_where(where))
        rows = list(islice(with_predictions(session, shots), limit))
        listing.show(rows, "no shots match")


@click.command()
@click.argument(
    "what", type=click.Choice(["impacts", "shots", "pulses", "channel-figures", "series"])
)
@db_option
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write to FILE.csv, FILE.parquet or FILE.json.",
)
@_CAMPAIGN
@click.option(
    "--where",
    multiple=True,
    metavar="CONDITION",
    help="Select impacts as `impacts` does. Series cannot be selected so.",
)
@click.option(
    "--recording",
    metavar="PATH",
    help="Export the series of this recording only, given by its path in the campaign folder.",
)
@click.option(
    "--columns",
    multiple=True,
    callback=split_names,
    metavar="A,B,…",
    help=(
        "Write only these columns, in this order. Repeat the option, or give a list: a,b. "
        "[default: all that the selection has]"
    ),
)
@spreadsheet_guard_option
@click.option("--skip-damaged", is_flag=True, help="Leave out damaged series, and name them.")
def export(
    what: str,
    db: str,
    out: Path,
    campaign: str | None,
    where: tuple[str, ...],
    recording: str | None,
    columns: tuple[str, ...],
    skip_damaged: bool,
) -> None:
    """Write impacts, shots, pulses, figures of the acceleration channels, or series to a file.

    Pulses are those in use, with their points of force. Series are in SI units. A factor that no
    selected impact has gets no column.

    \b
    Example:
        pyroshock export impacts --out impacts.csv --columns run,tip_material,peak_force_n pyroshock
        export series --campaign rehearsal --recording recordings/0001-01.npz --out 0001-01.parquet
    """
    progress = progress_bar(f"Exporting {what}")
    from ...operations.impacts.export import export_table

    with open_command_store(db) as store, store.reading() as session, progress:
        from ...common.filters import parse_where

        left_out: list[str] = []
        rows = export_table(
            session,
            what,
            out,
            campaign,
            parse_where(where),
            recording,
            left_out if skip_damaged else None,
            list(columns),
        )
    for column in left_out:
        note(f"left out: {column}")
    note(f"{rows} rows written: {out}")
    if campaign is not None:
        suggest_next("report", campaign, "--out", f"{campaign}.html")
