"""`campaigns`: what is in the store, what was deleted from it, and the folder of a new one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .common import db_option, errors_as_one_line, json_option, note, opened, print_table, write_json


@click.group(invoke_without_command=True)
@db_option
@json_option
@click.pass_context
def campaigns(ctx: click.Context, db: str, json_to: str | None) -> None:
    """List the campaigns with their counts; begin a folder, delete one, tell what was deleted. Alone, it lists.

    \b
    Example:
        pyroshock campaigns --json
        pyroshock campaigns delete spring --reason "wrong sensor, repeated as spring-2"
    """
    if ctx.invoked_subcommand is None:
        _list(db, json_to)


@campaigns.command("list")
@db_option
@json_option
def list_(db: str, json_to: str | None) -> None:
    """List the campaigns with their counts."""
    _list(db, json_to)


def _list(db: str, json_to: str | None) -> None:
    with opened(db) as store, store.reading() as session:
        from ...schema.listings import list_campaigns

        rows = list_campaigns(session)
        if json_to is not None:
            write_json(rows, json_to)
        else:
            print_table(rows, "no campaigns yet; read one with: pyroshock ingest FOLDER")


@campaigns.command()
@click.argument("folder", type=click.Path(file_okay=False, path_type=Path))
@db_option
@click.option(
    "--kind",
    type=click.Choice(["gun", "hammer", "drop"]),
    required=True,
    help="Of the bench; drop: accelerometers alone.",
)
@click.option("--plan", metavar="NAME", help="A row for each repetition that this plan of the store still asks for.")
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
    from contextlib import nullcontext

    with errors_as_one_line(), opened(db) if plan is not None else nullcontext() as store:
        from ..campaigns.starting import start_campaign

        new = start_campaign(store, folder, kind, plan, recordings)
    for text in new.notes:
        note(f"  {text}")
    note(f"written: {folder / 'campaign.toml'} and {folder / 'runs.csv'}")
    note(f"fill in what says FILL IN, then: pyroshock ingest {folder} --dry-run")


@campaigns.command()
@click.argument("name")
@db_option
@json_option
@click.option("--reason", required=True, metavar="TEXT", help="Why it is deleted: is kept with the tombstone.")
@click.option("--dry-run", is_flag=True, help="Say what would go and what stands on it, and delete nothing.")
def delete(name: str, db: str, json_to: str | None, reason: str, dry_run: bool) -> None:
    """Delete a campaign with its recordings, impacts, shots, diagnoses and adopted effects. It cannot be taken back.

    A tombstone stays: the hash of the content, when, why, who, and what stood on it. Datasets keep their name and hash
    and can no longer be read; models that were trained on them stay and work; reports of diagnoses stay in the
    tombstone. Runs of a plan that are no longer recorded are to do again. To keep the campaign in a file, write it with
    `pyroshock db export` first.

    \b
    Example:
        pyroshock campaigns delete spring --reason "wrong sensor, repeated as spring-2" --dry-run
    """
    with opened(db) as store:
        from ...schema.rehearsal import rehearsed
        from ..removal.deleting import delete_campaign

        if dry_run:
            with rehearsed(store) as rehearsal:
                stone = delete_campaign(rehearsal, db, name, reason)
        else:
            stone = delete_campaign(store, db, name, reason)
    tell_deletion(stone, dry_run)
    if json_to is not None:
        write_json(stone, json_to)


@campaigns.command()
@db_option
@json_option
def deleted(db: str, json_to: str | None) -> None:
    """List what was deleted: campaigns and recordings, when, why, their hash, and what stood on them."""
    with opened(db) as store, store.reading() as session:
        from ..removal.deleting import list_tombstones

        rows = list_tombstones(session)
    if json_to is not None:
        write_json(rows, json_to)
    else:
        print_table(map(_line, rows), "nothing was deleted")


def tell_deletion(stone: dict[str, Any], dry_run: bool) -> None:
    """What went, and what stood on it, on standard error."""
    what = stone["campaign"] if stone["recording"] is None else f"{stone['campaign']}, {stone['recording']}"
    rows = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in stone["counts"].items())
    start = "dry run, nothing is deleted; would delete" if dry_run else "deleted"
    note(f"{what}: {start} {rows}")
    note(f"  content hash {stone['content_hash']}")
    for line in _standing(stone):
        note(f"  stood on it: {line}")
    for each in stone["stood_on"]["reopened"]:
        note(f"  to do again: run {each['run']} of plan {each['plan']}")


def _standing(stone: dict[str, Any]) -> list[str]:
    stood = stone["stood_on"]
    return [
        *(f"dataset {each['name']} ({each['pulses']} pulses, hash {each['hash'][:12]})" for each in stood["datasets"]),
        *(f"model {each['model']} (of dataset {each['dataset']})" for each in stood["models"]),
        *(f"diagnosis {each['id']} of {each['diagnosed_at']} ({each['simulator']})" for each in stood["diagnoses"]),
        *(f"version {each['version']} of the twin ({each['reason']})" for each in stood["adopted"]),
    ]


def _line(stone: dict[str, Any]) -> dict[str, Any]:
    plain = {key: stone[key] for key in ("id", "kind", "campaign", "recording", "deleted_at", "reason")}
    return {**plain, "content_hash": stone["content_hash"][:12], "stood_on": "; ".join(_standing(stone))}
