"""`campaigns`: what is in the store, what was deleted from it, and the folder of a new one."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any

import click

from ..cli.common import db_option, errors_as_one_line, json_option, note, open_command_store, write_json
from ..cli.completion import campaign_names, plan_names
from ..cli.listed import Listing, listing_options
from ..common.progress import progress_bar


@click.group(invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def campaigns(ctx: click.Context, db: str, listing: Listing) -> None:
    """List the campaigns with their counts; begin a folder, delete, archive or restore a campaign. Alone, it lists.

    \b
    Example:
        pyroshock campaigns --json
        pyroshock campaigns delete spring --reason "wrong sensor, repeated as spring-2"
        pyroshock campaigns archive spring --out spring.pyroshock --reason "finished"
    """
    if ctx.invoked_subcommand is None:
        _list(db, listing)


def _list(db: str, listing: Listing) -> None:
    """List the campaigns with their counts."""
    with open_command_store(db) as store, store.reading() as session:
        from ...schema.listings import list_campaigns

        rows = list_campaigns(session)
    listing.show(rows, "no campaigns yet; read one with: pyroshock ingest FOLDER")


campaigns.command("list")(db_option(listing_options(_list)))


@campaigns.command()
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@db_option
@click.option(
    "--kind",
    type=click.Choice(["gun", "hammer", "drop"]),
    required=True,
    help="Of the bench; drop: accelerometers alone.",
)
@click.option(
    "--plan",
    metavar="NAME",
    help="A row for each repetition that this plan of the store still asks for.",
    shell_complete=plan_names,
)
@click.option(
    "--recordings", metavar="PATTERN", help="Files or a folder within FOLDER. [without a plan: all that are there]"
)
def init(folder: Path, db: str, kind: str, plan: str | None, recordings: str | None) -> None:
    """Begin a campaign's FOLDER: write a commented campaign.toml and a runs.csv, to be filled in and ingested.

    The rows come from a plan of the store, or there is one for each recording. Channels, their rates and units come
    from the recordings where these state them. What you must write is marked FILL IN, what may be otherwise "please
    check". Nothing that is there is overwritten.

    \b
    Example:
        pyroshock campaigns init spring --kind hammer --plan spring
        pyroshock campaigns init drops --kind drop --recordings "recordings/*.tdms"
    """
    with errors_as_one_line(), open_command_store(db) if plan is not None else nullcontext() as store:
        from .service import start_campaign

        new = start_campaign(store, folder, kind, plan, recordings)
    for text in new.notes:
        note(f"  {text}")
    note(f"written: {folder / 'campaign.toml'} and {folder / 'runs.csv'}")
    note(f"fill in what says FILL IN, then: pyroshock ingest {folder} --dry-run")


@campaigns.command()
@click.argument("name", shell_complete=campaign_names)
@db_option
@json_option
@click.option("--reason", required=True, metavar="TEXT", help="Why it is deleted: is kept with the tombstone.")
@click.option("--dry-run", is_flag=True, help="Say what would go and what stands on it, and delete nothing.")
def delete(name: str, db: str, json_to: str | None, reason: str, dry_run: bool) -> None:
    """Delete a campaign with its recordings, impacts, shots, diagnoses and adopted effects.

    It cannot be taken back; `campaigns archive` deletes it and keeps it in a file, from which it can.

    A tombstone stays: the hash of the content, when, why, who, and what stood on it. Datasets keep their name and hash
    and can no longer be read; models that were trained on them stay and work; reports of diagnoses stay in the
    tombstone. Runs of a plan that are no longer recorded are to do again.

    \b
    Example:
        pyroshock campaigns delete spring --reason "wrong sensor, repeated as spring-2" --dry-run
    """
    with open_command_store(db) as store:
        from ...schema.rehearsal import run_rehearsal
        from .removal import delete_campaign

        with run_rehearsal(store) if dry_run else nullcontext(store) as target:
            stone = delete_campaign(target, db, name, reason)
    tell_deletion(stone, dry_run)
    if json_to is not None:
        write_json(stone, json_to)


@campaigns.command()
@click.argument("name", shell_complete=campaign_names)
@db_option
@json_option
@click.option("--out", required=True, type=click.Path(dir_okay=False, path_type=Path), help="FILE to write; a new one.")
@click.option("--reason", required=True, metavar="TEXT", help="Why it leaves the store: is kept with the tombstone.")
def archive(name: str, db: str, json_to: str | None, out: Path, reason: str) -> None:
    """Write a campaign to FILE, read the file back, then delete the campaign from the store.

    The tombstone names the file and its SHA-256. `campaigns restore FILE` brings the campaign back, with its diagnoses,
    adopted effects, and the pulses of its datasets. What was begun and killed is completed by the same command.

    \b
    Example:
        pyroshock campaigns archive spring --out spring.pyroshock --reason "finished, kept on the shelf"
    """
    with open_command_store(db) as store:
        from .archiving import archive_campaign

        with progress_bar("Archiving", "rows") as step:
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
    """Bring a deleted campaign back from FILE, which `campaigns archive` or `db export` wrote before.

    The content must be that which was deleted. Datasets get their pulses back and can be read again; diagnoses and
    adopted effects come back; the tombstone stays, and says when.

    \b
    Example:
        pyroshock campaigns restore spring.pyroshock
    """
    with open_command_store(db) as store:
        from .archiving import restore_campaign

        with progress_bar("Restoring", "samples") as step:
            stone = restore_campaign(store, file, step)
    note(f"{stone['campaign']}: restored, {sum(stone['added'].values())} rows; content hash {stone['content_hash']}")
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
    """List what was deleted: campaigns and recordings, when, why, their hash, and what stood on them."""
    with open_command_store(db) as store, store.reading() as session:
        from .removal import list_tombstones

        rows = list_tombstones(session)
    listing.show(rows, "nothing was deleted", _line)


def tell_deletion(stone: dict[str, Any], dry_run: bool) -> None:
    """What went, and what stood on it, on standard error."""
    what = stone["campaign"] if stone["recording"] is None else f"{stone['campaign']}, {stone['recording']}"
    rows = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in stone["counts"].items())
    start = "dry run, nothing is deleted; would delete" if dry_run else "deleted"
    note(f"{what}: {start} {rows}")
    note(f"  content hash {stone['content_hash']}")
    from .removal import standing_lines

    for line in standing_lines(stone):
        note(f"  stood on it: {line}")
    for plan_run in stone["stood_on"]["reopened"]:
        note(f"  to do again: run {plan_run['run']} of plan {plan_run['plan']}")


def _line(stone: dict[str, Any]) -> dict[str, Any]:
    from .removal import standing_lines

    plain = {key: stone[key] for key in ("id", "kind", "campaign", "recording", "deleted_at", "reason")}
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
