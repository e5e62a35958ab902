"""`diagnoses`: list, show or delete the diagnoses of the store."""

from __future__ import annotations

import click

from ..command_line.common import db_option, json_option, note, open_command_store, write_json
from ..command_line.completion import campaign_names, diagnosis_numbers
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import noun_group
from ..command_line.options import confirm_deletion, deletion_options
from .diagnose import row_in_words, tell_diagnosis


@click.command()
@db_option
@listing_options
@click.option(
    "--campaign",
    metavar="NAME",
    help="List the diagnoses of this campaign only.",
    shell_complete=campaign_names,
)
def list_diagnoses(db: str, listing: Listing, campaign: str | None) -> None:
    """List the diagnoses, the newest first, with the most probable cause of each.

    \b
    Example:
        pyroshock diagnoses list --campaign slow-valve
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...operations.diagnose.stored import list_diagnoses as diagnoses_of

        rows = [{key: value for key, value in row.items() if key != "complete"}
                for row in diagnoses_of(session, campaign, limit=None)]  # fmt: skip
    listing.show(rows, "no diagnoses; make one: pyroshock diagnose CAMPAIGN", row_in_words)


@click.command()
@click.argument("diagnosis", type=click.IntRange(1), shell_complete=diagnosis_numbers)
@db_option
@json_option
def show(diagnosis: int, db: str, json_to: str | None) -> None:
    """Show the diagnosis with number DIAGNOSIS as `pyroshock diagnose` reported it.

    \b
    Example:
        pyroshock diagnoses show 1
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...operations.diagnose.service import GapDiagnosis
        from ...operations.diagnose.stored import kept_report, kept_verdict

        if json_to is not None:
            write_json(kept_report(session, diagnosis), json_to)
        else:
            tell_diagnosis(GapDiagnosis(kept_verdict(session, diagnosis), diagnosis))


@click.command()
@click.argument("diagnosis", type=click.IntRange(1), shell_complete=diagnosis_numbers)
@db_option
@deletion_options
def delete(diagnosis: int, db: str, dry_run: bool) -> None:
    """Delete the diagnosis with number DIAGNOSIS. One from which an effect was adopted is refused.

    \b
    Example:
        pyroshock diagnoses delete 1 --yes
    """
    with open_command_store(db) as store:
        from ...operations.diagnose.deletion import check_diagnosis_unused, delete_diagnosis

        with store.reading() as session:
            campaign = check_diagnosis_unused(session, diagnosis)
        if dry_run:
            note(f"diagnosis {diagnosis} of {campaign} can be deleted; nothing was deleted")
            return
        confirm_deletion(f"diagnosis {diagnosis} of {campaign}")
        store.write(lambda session: delete_diagnosis(session, diagnosis))
    note(f"diagnosis {diagnosis} of {campaign} is deleted")


diagnoses = noun_group(
    list_diagnoses,
    {"show": show, "delete": delete},
    """List the diagnoses; show or delete one. Without a command, list them.
    `pyroshock diagnose` makes new ones.

    \b
    Example:
        pyroshock diagnoses
        pyroshock diagnoses show 1
    """,
)
