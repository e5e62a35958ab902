"""`impacts`: list, show or delete the impacts of the store."""

from __future__ import annotations

import click

from ..command_line.common import db_option, json_option, open_command_store
from ..command_line.nouns import noun_group
from .impact_records import impacts as list_impacts
from .impact_records import show
from .runs import DRY_RUN, REASON, discard_part


@click.command()
@click.argument("impact", type=click.IntRange(1))
@db_option
@json_option
@click.option(
    "--all-of-recording", is_flag=True, help="Delete the other impacts of the same recording, too."
)
@REASON
@DRY_RUN
def delete(
    impact: int, db: str, json_to: str | None, all_of_recording: bool, reason: str, dry_run: bool
) -> None:
    """Delete the impact with number IMPACT: its recording is taken out of the store, as by
    `pyroshock runs discard`.

    A recording is discarded as a whole. If it holds other impacts, the command refuses and names
    them, unless
    --all-of-recording is given.

    \b
    Example:
        pyroshock impacts delete 2 --reason "the plate had come loose" --dry-run
    """
    with open_command_store(db) as store:
        from ...operations.ingest.removal import recording_of_impact

        with store.reading() as session:
            part = recording_of_impact(session, impact, all_of_recording=all_of_recording)
        discard_part(store, db, part, reason, dry_run, json_to)


impacts = noun_group(list_impacts, {"show": show, "delete": delete}, list_impacts.help or "")
