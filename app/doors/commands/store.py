"""`init` and `db`: making a store and keeping it: checked, copied, upgraded, its roles, and a
campaign to another laboratory in one file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...common.progress import progress_bar
from ..command_line.common import (
    CommandGroup,
    db_option,
    errors_as_one_line,
    json_option,
    note,
    open_command_store,
    write_json,
)
from ..command_line.completion import campaign_names
from ..command_line.listed import Listing, listing_options
from .backup import backup, restore

if TYPE_CHECKING:
    from sqlalchemy import Engine


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@db_option
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write to FILE, which must not exist.",
)
def export(campaign: str, db: str, out: Path) -> None:
    """Write CAMPAIGN with everything that belongs to it into one file, which is an SQLite store of
    that campaign only.

    The file holds bench, materials, configurations, recordings with their series, impacts, all
    versions of pulses, shots, findings, the plan and its runs, diagnoses, and who wrote what. Any
    command can read it with --db sqlite:///FILE.

    \b
    Example:
        pyroshock db export rehearsal --out rehearsal.pyroshock
    """
    progress = progress_bar(f"Exporting {campaign}", "rows")
    with open_command_store(db) as store:
        from ....schema.transfer.export import export_campaign

        with progress as step:
            rows = export_campaign(store, campaign, out, step)
    note(
        f"campaign {campaign}: {sum(rows.values())} rows, {out.stat().st_size / 1e6:.1f} MB: {out}"
    )


@click.command("import")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@db_option
@json_option
def import_(file: Path, db: str, json_to: str | None) -> None:
    """Add the campaigns of FILE, which `db export` wrote, to the store. What is there stays, and
    nothing is stored twice.

    The file may come from anybody. It is checked as `db check` checks a store before anything is
    written, and all of it is added or nothing. A campaign, material or plan that differs from a
    stored one of the same name is refused.

    \b
    Example:
        pyroshock db export first-shots --out first-shots.pyroshock
        pyroshock db import first-shots.pyroshock --db sqlite:///lab.db
    """
    progress = progress_bar(f"Importing {file.name}", "samples")
    with open_command_store(db, create=True) as store:
        from ....schema.transfer.merging import import_file

        with progress as step:
            report = import_file(store, file, step)
        if json_to is not None:
            write_json(vars(report), json_to)
    names = ", ".join(report.campaigns)
    note(
        f"{names}: {sum(report.added.values())} rows added"
        if report.added
        else f"{names}: all of it was there"
    )
    for discarded in report.discarded:
        note(f"was discarded here, and is back with the file: {discarded}")
    for discarded in report.left_behind:
        note(f"left behind: {discarded}")


@click.command()
@db_option
@json_option
@click.option(
    "--campaign",
    metavar="NAME",
    help="Check the recordings, impacts and pulses of this campaign only.",
    shell_complete=campaign_names,
)
@click.option(
    "--fast",
    is_flag=True,
    help="Count and compare rows, but read no series, pulse, dataset or model.",
)
@click.option(
    "--repair",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="First read damaged series again from this campaign folder.",
)
def check(
    db: str, json_to: str | None, campaign: str | None, fast: bool, repair: Path | None
) -> None:
    """Verify hashes, references and counts of the store. The exit code is 1 if anything is wrong,
    and it is named.

    Every series is decoded and compared with the SHA-256 of what was recorded. Every reference must
    lead to a row, every dataset must give its hash, and every registered model must load.

    \b
    Example:
        pyroshock db check --fast
        pyroshock db check --campaign rehearsal
    """
    progress = progress_bar("Checking the store", "samples")
    with open_command_store(db) as store:
        from ....schema.engine import describe
        from ...operations.store.check import Wanted, datasets_without_source, findings_of

        if repair is not None:
            _repair(store, repair)
        with progress as step:
            findings = list(findings_of(store, db, Wanted(campaign, fast), step))
        if json_to is not None:
            write_json(
                {"sound": not findings, "findings": [finding.as_json() for finding in findings]},
                json_to,
            )
        else:
            for finding in findings:
                click.echo(str(finding))
        if not fast and campaign is None:
            with store.reading() as session:
                for words in datasets_without_source(session):
                    note(words)
        address = describe(store.engine)
    note(f"{address}: {len(findings)} findings" if findings else f"{address} is sound")
    if findings:
        raise click.exceptions.Exit(1)


def _repair(store: object, folder: Path) -> None:
    from ....ingest.storing.series_repair import repair_series

    report = repair_series(store, folder)  # type: ignore[arg-type]
    for finding in report.mended:
        note(f"mended: {report.campaign}, {finding}")
    for finding, reason in report.left.items():
        note(f"left as it is: {report.campaign}, {finding}: {reason}")


@click.command()
@db_option
@listing_options
def roles(db: str, listing: Listing) -> None:
    """Make the roles reader, operator and admin of a store on PostgreSQL, grant what they lack, and
    list who has them.

    The migrations do this, too, if their login may make roles. A login gets a role in SQL: GRANT
    pyroshock_operator TO "alice".

    \b
    Example:
        pyroshock db roles --db postgresql+psycopg://keeper@server/lab
    """
    with open_command_store(db) as store:
        from ....schema.access.roles import ensure_roles

        rows = [asdict(role) for role in ensure_roles(store.engine)]
    listing.show(rows, "none", lambda row: {**row, "members": ", ".join(row["members"]) or "-"})


def note_missing_roles(engine: Engine) -> None:
    """Say after `init` and `db upgrade` that a store has no roles yet, and what makes them."""
    from ....schema.access.roles import without_roles

    if (missing := without_roles(engine)) is not None:
        note(missing)


@click.command()
@click.argument("source", metavar="SRC")
@click.argument("target", metavar="DST")
@json_option
def copy(source: str, target: str, json_to: str | None) -> None:
    """Copy the store at address SRC to the empty place at address DST. The engines may differ.

    Rows and keys are the same afterwards: every table is read back and compared by a hash. DST
    becomes a store only when everything is there, and a copy that was stopped leaves it empty. A
    PostgreSQL database must exist before.

    \b
    Example:
        pyroshock db copy sqlite:///results/demo.db sqlite:///copy.db
    """
    progress = progress_bar("Copying the store", "rows")
    with open_command_store(source) as store:
        from ....schema.engine import describe, make_engine
        from ....schema.transfer.copying import copy_store

        engine = make_engine(target)
        try:
            with progress as step:
                tables = copy_store(store, engine, step)
            note_missing_roles(engine)
        finally:
            engine.dispose()
        if json_to is not None:
            write_json([vars(table) for table in tables], json_to)
        note(
            f"{describe(engine)}: {sum(table.rows for table in tables)} rows, "
            f"the same as in {describe(store.engine)}"
        )
    with errors_as_one_line():
        _say_where_models_are(source)


def _say_where_models_are(source: str) -> None:
    """Models are MLflow's, and stay where they are."""
    from ....training.registry.connection import user_environment
    from ....training.registry.model_storage import storage_for

    place = storage_for(source, user_environment())
    if place.database is not None and place.database.is_file():
        note(
            f"The models stay in {place.shown}. Set MLFLOW_TRACKING_URI to it when you work on the "
            "copy (docs/reference/store.md)."
        )
    elif place.database is None:
        note(f"models stay in {place.shown}, where MLFLOW_TRACKING_URI says")


@click.command()
@db_option
def init(db: str) -> None:
    """Make an empty store that holds the known materials. A store that exists stays as it is.

    \b
    Example:
        pyroshock init --db sqlite:///lab.db
    """
    with open_command_store(db, create=True) as store:
        from ....schema.engine import describe

        note(f"store ready: {describe(store.engine)}")
        note_missing_roles(store.engine)


@click.group(cls=CommandGroup)
def db() -> None:
    """Check, copy and upgrade a store, and carry campaigns from one store to another.

    \b
    Example:
        pyroshock db check --fast
    """


for command in (backup, check, copy, export, import_, restore, roles):
    db.add_command(command)


@db.command()
@db_option
def upgrade(db: str) -> None:
    """Bring a store that an older version made up to this version.

    \b
    Example:
        pyroshock db upgrade
    """
    with errors_as_one_line():
        from sqlalchemy.exc import DBAPIError

        from ....schema import migrate
        from ....schema.access.permissions import refusal
        from ....schema.addresses import address_for_display
        from ....schema.engine import describe, make_engine_of_existing, no_store

        engine = make_engine_of_existing(db)
        try:
            before = migrate.current_revision(engine)
            if before is None:
                raise no_store(engine, db)
            if before not in migrate.known_revisions():
                raise migrate.version_error(describe(engine), address_for_display(db), before)
            try:
                migrate.upgrade(engine)
            except DBAPIError as error:
                raise refusal(engine, error) from error
            note(f"{describe(engine)}: revision {before} -> {migrate.current_revision(engine)}")
            note_missing_roles(engine)
        finally:
            engine.dispose()
