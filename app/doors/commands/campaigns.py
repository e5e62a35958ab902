"""`campaigns`: what is in the store, what was deleted from it, and the folder of a new one."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from ....schema.known_facts import facts_from_json
from ...common.progress import progress_bar
from ..command_line.common import (
    db_option,
    errors_as_one_line,
    format_cell,
    json_option,
    note,
    open_command_store,
    print_table,
    write_json,
)
from ..command_line.completion import campaign_names, plan_names
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import NounGroup


@click.group(cls=NounGroup, invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def campaigns(ctx: click.Context, db: str, listing: Listing) -> None:
    """List the campaigns with their counts; begin, delete, archive or restore a campaign. Without a
    command, list them.

    \b
    Example:
        pyroshock campaigns --json
        pyroshock campaigns show rehearsal
        pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn" --dry-run
    """
    if ctx.invoked_subcommand is None:
        _list(db, listing)


def _list(db: str, listing: Listing) -> None:
    """List the campaigns with their counts.

    \b
    Example:
        pyroshock campaigns list --sort -shots --columns name,kind,shots
    """
    with open_command_store(db) as store, store.reading() as session:
        from ....schema.listings import list_campaigns

        rows = list_campaigns(session)
    listing.show(rows, "no campaigns yet; read one with: pyroshock ingest FOLDER")


campaigns.command("list")(db_option(listing_options(_list)))


@campaigns.command()
@click.argument("name", shell_complete=campaign_names)
@db_option
@json_option
def show(name: str, db: str, json_to: str | None) -> None:
    """Show a campaign: bench, counts, plans, levels of its factors, achieved settings, findings and
    first rows.

    \b
    Example:
        pyroshock campaigns show rehearsal
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...operations.ingest.campaign_overview import campaign_overview

        overview = campaign_overview(session, name)
    if json_to is not None:
        from ...common.number_format import finite

        write_json(finite(overview), json_to)
        return
    for title in ("campaign", "counts"):
        for key, value in overview[title].items():
            if not isinstance(value, list | dict):
                click.echo(f"{key:24} {format_cell(value)}")
    if facts := facts_from_json(overview["campaign"]["known"]):
        click.echo("\nknown facts")
        for fact in facts:
            click.echo(f"  {fact.name:40} {fact.words}")
    if overview["missing_facts"]:
        click.echo(f"\nmissing facts\n  {overview['missing_facts']}")
    if overview["shot_differences"]:
        click.echo("\nrows and recordings differ")
        for message in overview["shot_differences"]:
            click.echo(f"  {message}")
    for title in ("findings", "first_impacts", "first_shots"):
        click.echo(f"\n{title.replace('_', ' ')}")
        print_table(overview[title], "  none")


@campaigns.command()
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@db_option
@click.option(
    "--kind",
    type=click.Choice(["gun", "hammer", "drop"]),
    required=True,
    help="Choose the kind of the bench; `drop` has accelerometers only.",
)
@click.option(
    "--plan",
    metavar="NAME",
    help="Write a row for each repetition that this plan still asks for.",
    shell_complete=plan_names,
)
@click.option(
    "--recordings",
    metavar="PATTERN",
    help="Take these files, or a folder within FOLDER. [default: without a plan, "
    "all that are there]",
)
def init(folder: Path, db: str, kind: str, plan: str | None, recordings: str | None) -> None:
    """Begin the FOLDER of a campaign: write a commented campaign.toml and a runs.csv, which you
    complete and ingest.

    The rows come from a plan of the store; without a plan there is a row for each recording.
    Channels, their rates and their units come from the recordings where these contain them. What
    you must write is marked FILL IN, and what may be wrong is marked "please check". Files that
    exist are never overwritten.

    \b
    Example:
        pyroshock plan lhs autumn --runs 12
        pyroshock campaigns init autumn --kind gun --plan autumn
    """
    with (
        errors_as_one_line(),
        open_command_store(db) if plan is not None else nullcontext() as store,
    ):
        from ...operations.ingest.service import start_campaign

        new = start_campaign(store, folder, kind, plan, recordings)
    for text in new.notes:
        note(f"  {text}")
    note(f"written: {folder / 'campaign.toml'} and {folder / 'runs.csv'}")
    note(f"fill in what says FILL IN, then: pyroshock ingest {folder} --dry-run")


@campaigns.command()
@click.argument("name", shell_complete=campaign_names)
@db_option
@json_option
@click.option(
    "--reason",
    required=True,
    metavar="TEXT",
    help="Say why it is deleted. The store keeps the reason.",
)
@click.option(
    "--dry-run",
    is_flag=True,
    help="Report what would be deleted and what depends on it, and delete nothing.",
)
def delete(name: str, db: str, json_to: str | None, reason: str, dry_run: bool) -> None:
    """Delete a campaign with its recordings, impacts, shots, diagnoses and adopted effects.

    A deleted campaign cannot be brought back. `campaigns archive` deletes a campaign, too, but
    keeps it in a file.

    The store keeps a tombstone: the hash of the content, the time, the person, the reason, and what
    depended on the campaign. Datasets keep their name and hash, but can no longer be read. Models
    that were trained on them stay and work. Reports of diagnoses stay in the tombstone. Runs of a
    plan that are no longer recorded are to be done again.

    \b
    Example:
        pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn" --dry-run
        pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn"
    """
    with open_command_store(db) as store:
        from ....schema.rehearsal import run_rehearsal
        from ...operations.ingest.removal import delete_campaign

        with run_rehearsal(store) if dry_run else nullcontext(store) as target:
            stone = delete_campaign(target, db, name, reason)
    tell_deletion(stone, dry_run)
    if json_to is not None:
        write_json(stone, json_to)


@campaigns.command()
@click.argument("name", shell_complete=campaign_names)
@db_option
@json_option
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write to FILE, which must not exist.",
)
@click.option(
    "--reason",
    required=True,
    metavar="TEXT",
    help="Say why it leaves the store. The store keeps the reason.",
)
def archive(name: str, db: str, json_to: str | None, out: Path, reason: str) -> None:
    """Write a campaign to FILE, read the file back, then delete the campaign from the store.

    The store keeps a tombstone with the name of the file and its SHA-256. `campaigns restore FILE`
    brings the campaign back, with its diagnoses, its adopted effects, and the pulses of its
    datasets. The same command completes an archive that was interrupted.

    \b
    Example:
        pyroshock campaigns archive first-shots --out first-shots.pyroshock --reason "finished, kept
        on the shelf"
    """
    progress = progress_bar(f"Archiving {name}", "rows")
    with open_command_store(db) as store:
        from ...operations.ingest.archiving import archive_campaign

        with progress as step:
            stone = archive_campaign(store, db, name, out, reason, step)
    tell_deletion(stone, dry_run=False)
    note(f"  archived in {stone['archive_path']} (SHA-256 {stone['archive_sha256'][:12]})")
    note(f"  to bring it back: pyroshock campaigns restore {stone['archive_path']}")
    if json_to is not None:
        write_json(stone, json_to)


@campaigns.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@db_option
@json_option
def restore(file: Path, db: str, json_to: str | None) -> None:
    """Bring a deleted campaign back from FILE, which `campaigns archive` or `db export` wrote
    before.

    The content must be the same as that which was deleted. Datasets get their pulses back and can
    be read again. Diagnoses and adopted effects come back. The tombstone stays and records the time
    of the return.

    \b
    Example:
        pyroshock campaigns archive first-shots --out first-shots.pyroshock --reason "finished"
        pyroshock campaigns restore first-shots.pyroshock
    """
    progress = progress_bar(f"Restoring {file.name}", "samples")
    with open_command_store(db) as store:
        from ...operations.ingest.archiving import restore_campaign

        with progress as step:
            stone = restore_campaign(store, file, step)
    note(
        f"{stone['campaign']}: restored, {sum(stone['added'].values())} rows; "
        f"content hash {stone['content_hash']}"
    )
    for dataset, pulses in stone["returned"].items():
        note(f"  dataset {dataset} has {pulses} pulses again")
    for words in stone["notes"]:
        note(f"  {words}")
    if json_to is not None:
        write_json(stone, json_to)


@campaigns.command()
@db_option
@listing_options
def deleted(db: str, listing: Listing) -> None:
    """List what was deleted: campaigns and recordings with time, reason, hash, and what depended on
    them.

    \b
    Example:
        pyroshock campaigns deleted
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...operations.ingest.removal import list_tombstones

        rows = list_tombstones(session)
    listing.show(rows, "nothing was deleted", _line)


def tell_deletion(stone: dict[str, Any], dry_run: bool) -> None:
    """What went, and what stood on it, on standard error."""
    what = (
        stone["campaign"]
        if stone["recording"] is None
        else f"{stone['campaign']}, {stone['recording']}"
    )
    rows = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in stone["counts"].items())
    start = "dry run, nothing is deleted; would delete" if dry_run else "deleted"
    note(f"{what}: {start} {rows}")
    note(f"  content hash {stone['content_hash']}")
    from ...operations.ingest.removal import standing_lines

    for line in standing_lines(stone):
        note(f"  stood on it: {line}")
    for plan_run in stone["stood_on"]["reopened"]:
        note(f"  to do again: run {plan_run['run']} of plan {plan_run['plan']}")


def _line(stone: dict[str, Any]) -> dict[str, Any]:
    from ...operations.ingest.removal import standing_lines

    plain = {
        key: stone[key] for key in ("id", "kind", "campaign", "recording", "deleted_at", "reason")
    }
    return {
        **plain,
        "since_then": _since(stone),
        "content_hash": stone["content_hash"][:12],
        "stood_on": "; ".join(standing_lines(stone)),
    }


def _since(stone: dict[str, Any]) -> str:
    """What became of it after the deletion."""
    if stone["restored_at"] is not None:
        return f"restored {stone['restored_at']}"
    if stone["replaced_by"] is not None:
        return f"replaced by {stone['replaced_by'][:12]}"
    return "-" if stone["archive_path"] is None else f"archived in {stone['archive_path']}"
