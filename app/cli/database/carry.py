"""`db export` and `db import`: a campaign to another laboratory, in one file."""

from __future__ import annotations

from pathlib import Path

import click

from ..common import db_option, json_option, note, opened, write_json
from ..completion import campaign_names


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@db_option
@click.option("--out", required=True, type=click.Path(dir_okay=False, path_type=Path), help="FILE to write; a new one.")
def export(campaign: str, db: str, out: Path) -> None:
    """Write CAMPAIGN with all that belongs to it into one file, which is an SQLite store of that campaign alone.

    Bench, materials, configurations, recordings with their series, impacts, all versions of pulses, shots, findings,
    the plan and its runs, diagnoses, and who wrote what. Any command looks at it: --db sqlite:///FILE.

    \b
    Example:
        pyroshock db export spring --out spring.pyroshock
    """
    with opened(db) as store:
        from ....schema.transfer.export import export_campaign
        from ...progress import progress_bar

        with progress_bar("Exporting", "rows") as step:
            rows = export_campaign(store, campaign, out, step)
    note(f"campaign {campaign}: {sum(rows.values())} rows, {out.stat().st_size / 1e6:.1f} MB: {out}")


@click.command("import")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@db_option
@json_option
def import_(file: Path, db: str, json_to: str | None) -> None:
    """Add the campaigns of FILE, which `db export` wrote, to the store; what is there stays, and nothing comes twice.

    The file may come from anybody: it is checked as `db check` checks a store before anything is written, and all of
    it is added or nothing. A campaign, material or plan that is another one under the same name is refused.

    \b
    Example:
        pyroshock db import spring.pyroshock --db sqlite:///lab.db
    """
    with opened(db, create=True) as store:
        from ....schema.transfer.merging import import_file
        from ...progress import progress_bar

        with progress_bar("Importing", "samples") as step:
            report = import_file(store, file, step)
        if json_to is not None:
            write_json(vars(report), json_to)
    names = ", ".join(report.campaigns)
    note(f"{names}: {sum(report.added.values())} rows added" if report.added else f"{names}: all of it was there")
    for discarded in report.discarded:
        note(f"was discarded here, and is back with the file: {discarded}")
    for discarded in report.left_behind:
        note(f"left behind: {discarded}")
