"""`export`: tables and series out of the store, for any other program."""

from __future__ import annotations

from pathlib import Path

import click

from .common import db_option, note, opened
from .completion import campaign_names


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
    with opened(db) as store, store.reading() as session:
        from ..export import export_table
        from ..filters import parse_where
        from .listed import column_names

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
