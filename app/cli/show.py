"""`show`: one impact, as far as the store knows it."""

from __future__ import annotations

from pathlib import Path

import click

from .common import db_option, format_cell, json_option, note, opened, print_table, write_json


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
    with opened(db) as store, store.reading() as session:
        from ..pulses.impact import impact_page

        page = impact_page(session, impact)
        if plot is not None:
            from ..plots import plot_impact

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
