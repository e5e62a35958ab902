"""`runs`: the recordings of a campaign with their runs; one discarded, or replaced by a corrected
one."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..command_line.common import (
    db_option,
    fail,
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
from .ingest import settings_from, settings_options

if TYPE_CHECKING:
    from ....schema.removal.part import Part
    from ....schema.session import Store

REASON = click.option(
    "--reason", required=True, metavar="TEXT", help="Say why. The store keeps the reason."
)
DRY_RUN = click.option(
    "--dry-run",
    is_flag=True,
    help="Report what would be removed and what depends on it, and change nothing.",
)


@click.group(cls=NounGroup)
def runs() -> None:
    """List the recordings of a campaign with their runs; take one out of the store, or replace it
    by a corrected one.

    \b
    Example:
        pyroshock runs list rehearsal
        pyroshock runs show rehearsal recordings/0001-01.npz
        pyroshock runs discard rehearsal --run 7 --reason "the plate had come loose" --dry-run
    """


@runs.command("list")
@click.argument("campaign", shell_complete=campaign_names)
@db_option
@listing_options
def list_(campaign: str, db: str, listing: Listing) -> None:
    """List the recordings of CAMPAIGN: path, status, hash of the file, runs with their repetitions.

    \b
    Example:
        pyroshock runs list rehearsal
    """
    with open_command_store(db) as store, store.reading() as session:
        from ....schema.removal.part import list_recordings

        rows = list_recordings(session, campaign)
    listing.show(
        rows,
        f"campaign {campaign} has no recordings",
        lambda row: {**row, "sha256": row["sha256"][:12], "runs": ", ".join(row["runs"])},
    )


@runs.command()
@click.argument("campaign", shell_complete=campaign_names)
@click.argument("recording")
@db_option
@json_option
def show(campaign: str, recording: str, db: str, json_to: str | None) -> None:
    """Show one RECORDING of CAMPAIGN: its impacts and shots with the run and repetition of each,
    and its findings.

    \b
    Example:
        pyroshock runs show rehearsal recordings/0001-01.npz
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...operations.ingest.recording_contents import recording_contents

        contents = recording_contents(session, campaign, recording)
    if json_to is not None:
        write_json(contents, json_to)
        return
    for key, value in contents.items():
        if isinstance(value, list):
            click.echo(f"\n{key}")
            print_table(value, "  none")
        else:
            click.echo(f"{key:24} {format_cell(value)}")


@runs.command()
@click.argument("campaign", shell_complete=campaign_names)
@click.argument("recording", required=False)
@db_option
@json_option
@click.option(
    "--run",
    "numbers",
    type=int,
    multiple=True,
    metavar="N",
    help="Name the recording by its run. The option can be repeated.",
)
@click.option(
    "--repetition",
    type=int,
    metavar="M",
    help="Take the recording of this repetition. This needs exactly one --run.",
)
@REASON
@DRY_RUN
def discard(
    campaign: str,
    recording: str | None,
    db: str,
    json_to: str | None,
    numbers: tuple[int, ...],
    repetition: int | None,
    reason: str,
    dry_run: bool,
) -> None:
    """Take one RECORDING of CAMPAIGN out of the store, with its impacts, shots, pulses and
    findings.

    The store keeps a tombstone: the hash of the file, the time, the person, the reason, and what
    depended on it. A later ingest of the folder does not bring the file back, but `pyroshock ingest
    FOLDER --again RECORDING` does. Datasets keep their name and hash, but can no longer be read.
    Models stay. Runs of a plan that are no longer recorded are to be done again.

    \b
    Example:
        pyroshock runs discard rehearsal recordings/0007-01.npz --reason "the plate had come loose"
        --dry-run pyroshock runs discard rehearsal --run 7 --reason "the plate had come loose"
    """
    if (recording is None) == (not numbers):
        raise click.UsageError("name one recording: its path as in runs.csv, or --run N")
    if repetition is not None and len(numbers) != 1:
        raise click.UsageError("--repetition goes with exactly one --run")
    with open_command_store(db) as store:
        from ....schema.removal.part import recording_of_runs, recording_part

        with store.reading() as session:
            if recording is not None:
                part = recording_part(session, campaign, recording)
            else:
                part = recording_of_runs(session, campaign, numbers, repetition)
        discard_part(store, db, part, reason, dry_run, json_to)


def discard_part(
    store: Store, db: str, part: Part, reason: str, dry_run: bool, json_to: str | None
) -> None:
    """Discard a recording, or rehearse it; tell what went, what stood on it, and how it is stored
    again."""
    from ....schema.rehearsal import run_rehearsal
    from ...operations.ingest.removal import discard_recording
    from .campaigns import tell_deletion

    with run_rehearsal(store) if dry_run else nullcontext(store) as target:
        stone = discard_recording(target, db, part, reason)
    tell_deletion(stone, dry_run)
    if not dry_run:
        note(f"  to store it again: pyroshock ingest FOLDER --again {stone['recording']}")
    if json_to is not None:
        write_json(stone, json_to)


runs.add_command(discard, "delete")


@runs.command()
@click.argument("campaign", shell_complete=campaign_names)
@click.argument("recording")
@click.argument(
    "file", required=False, type=click.Path(exists=True, dir_okay=False, path_type=Path)
)
@db_option
@json_option
@click.option(
    "--from",
    "folder",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Read the campaign folder with the corrected row of runs.csv, or the new file.",
)
@click.option(
    "--plan",
    default=None,
    help="Name the plan whose runs the campaign does. [default: the plan of the "
    "campaign's name, if there is one]",
    shell_complete=plan_names,
)
@click.option(
    "--free-factor",
    "free_factors",
    multiple=True,
    metavar="COLUMN",
    help="This is the same option as that of `ingest`. It can be repeated.",
)
@click.option(
    "--confirm",
    "confirmed",
    multiple=True,
    metavar="RULE",
    help="This is the same option as that of `ingest`. It can be repeated.",
)
@REASON
@DRY_RUN
@settings_options
def replace(
    campaign: str,
    recording: str,
    file: Path | None,
    db: str,
    json_to: str | None,
    folder: Path | None,
    plan: str | None,
    free_factors: tuple[str, ...],
    confirmed: tuple[str, ...],
    reason: str,
    dry_run: bool,
    **given: Any,
) -> None:
    """Replace a stored RECORDING by what the campaign folder holds now, in one transaction.

    With --from FOLDER, the file of the same path and the rows of runs.csv that name it are read
    again; either may be corrected. With FILE, another file of a campaign folder is read, with its
    own path and rows. The store keeps a tombstone of the old recording that names the hash of the
    new one. Other recordings of the folder are not read.

    \b
    Example:
        pyroshock runs replace rehearsal recordings/0008-01.npz --from corrected/ --reason "tip
        radius corrected"
    """
    if (file is None) == (folder is None):
        raise click.UsageError(
            "say what replaces it: --from FOLDER, or another FILE of the campaign folder"
        )
    if file is not None:
        folder = _campaign_folder(file)
    assert folder is not None
    path = None if file is None else file.resolve().relative_to(folder.resolve()).as_posix()
    with open_command_store(db) as store:
        from ....ingest.storing.replacement import prepared_replacement
        from ....schema.rehearsal import run_rehearsal
        from ...operations.ingest.removal import replace_recording
        from .campaigns import tell_deletion

        settings = settings_from(given)
        with run_rehearsal(store) if dry_run else nullcontext(store) as target:
            replacement = prepared_replacement(
                target,
                campaign,
                recording,
                folder,
                path,
                settings,
                free_factors=free_factors,
                confirmed=confirmed,
            )
            stone = replace_recording(target, db, replacement, reason, plan)
    tell_deletion(stone, dry_run)
    verb = "would be stored" if dry_run else "stored"
    note(
        f"  {verb} in its place: {replacement.new.path}, "
        f"{len(replacement.new.hits)} hits, file {stone['replaced_by'][:12]}"
    )
    for name, pulses in stone["returned"].items():
        note(f"  dataset {name} has {pulses} pulses again")
    if json_to is not None:
        write_json(stone, json_to)


def _campaign_folder(file: Path) -> Path:
    for folder in file.resolve().parents:
        if (folder / "campaign.toml").is_file():
            return folder
    fail(
        f"{file} lies in no campaign folder: no folder above it has a "
        f"campaign.toml; put it beside its rows of runs.csv"
    )
    raise AssertionError
