"""`impacts`: list, show or delete the impacts of the store."""

from __future__ import annotations

import click

from ..command_line.common import db_option, json_option, note, open_command_store, write_json
from ..command_line.nouns import noun_group
from .impact_records import impacts as list_impacts
from .impact_records import show


@click.command()
@click.argument("impact", type=click.IntRange(1))
@db_option
@json_option
@click.option(
    "--all-of-recording", is_flag=True, help="Delete the other impacts of the same recording, too."
)
@click.option(
    "--reason", required=True, metavar="TEXT", help="Say why. The store keeps the reason."
)
@click.option(
    "--dry-run",
    is_flag=True,
    help="Report what would be removed and what depends on it, and change nothing.",
)
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
        from ...operations.faults import read
        from ...operations.ingest.removal import recording_of_impact
        from ...operations.ingest.runs import RUN_DISCARD, RunDiscard
        from ...operations.laboratory import Laboratory

        with store.reading() as session:
            part = recording_of_impact(session, impact, all_of_recording=all_of_recording)
        values = {"campaign": part.campaign, "recording": part.recording}
        request = read(RunDiscard, {**values, "reason": reason, "dry_run": dry_run}, "command")
        discarded = RUN_DISCARD.answer(request, Laboratory(store, db), lambda *_: None)
    for line in discarded.notes():
        note(line)
    if json_to is not None:
        write_json(discarded.to_json(), json_to)


impacts = noun_group(list_impacts, {"show": show, "delete": delete}, list_impacts.help or "")
