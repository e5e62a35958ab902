"""What makes, moves and keeps whole stores: new ones, upgrades, copies, backups, roles, and
campaigns that go from one laboratory to another in a file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo

from ....schema.person_roles import ADMINISTRATOR, ENGINEER
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Outcome, Progress, Request, Rows

if TYPE_CHECKING:
    from sqlalchemy import Engine

_WRITES_HERE = "It writes files of this machine."
_READS_HERE = "It reads files of this machine."
_KEEPER = "Whoever keeps the database does this, on the command line."
_OPENED_AFTER = "In Python a store is open before anything is asked of it."
_NO_NETWORK = {"json": _WRITES_HERE, "form": _WRITES_HERE}


def _existing(path: Path, info: ValidationInfo) -> Path:
    is_file = info.field_name == "file"
    if not (path.is_file() if is_file else path.is_dir()):
        kind = "file" if is_file else "folder"
        raise ValueError(f"{info.field_name} is '{path}'; expected a {kind} that exists")
    return path


_Existing = Annotated[Path, AfterValidator(_existing)]


def _missing_roles(engine: Engine) -> tuple[str, ...]:
    """That a store has no roles yet, and what makes them."""
    from ....schema.access.roles import without_roles

    missing = without_roles(engine)
    return () if missing is None else (missing,)


def _init(_: Request, laboratory: Laboratory, __: Progress) -> Outcome:
    from ....schema.engine import describe

    store = laboratory.store
    engine, entry = store.engine, store.audit
    if store.is_new and entry is not None:
        # The tables were made before anything could stand in them.
        entry.recorded = True
        store.write(lambda session: session.add(entry.row()))
    lines = (f"store ready: {describe(engine)}", *_missing_roles(engine))
    return Outcome(lines, {"store": describe(engine)})


INIT: Operation[Request, Outcome] = Operation(
    name="init",
    role=ADMINISTRATOR,
    request=Request,
    run=_init,
    help="Make an empty store that holds the known materials. A store that exists stays as it is.",
    example="pyroshock init --db sqlite:///lab.db",
    creates_store=True,
    absent={**_NO_NETWORK, "python": "`pyroshock.open` makes a store that does not exist."},
)


def _upgrade(_: Request, laboratory: Laboratory, __: Progress) -> Outcome:
    from sqlalchemy.exc import DBAPIError

    from ....schema import migrate
    from ....schema.access.permissions import refusal
    from ....schema.addresses import address_for_display
    from ....schema.campaign_counts import recount
    from ....schema.engine import describe, make_engine_of_existing, no_store
    from ....schema.session import Store, Writer

    engine = make_engine_of_existing(laboratory.db)
    try:
        before = migrate.current_revision(engine)
        if before is None:
            raise no_store(engine, laboratory.db)
        if before not in migrate.known_revisions():
            raise migrate.version_error(
                describe(engine), address_for_display(laboratory.db), before
            )
        try:
            migrate.upgrade(engine)
            Store(engine, Writer("db upgrade", "")).write(recount, idempotent=True)
        except DBAPIError as error:
            raise refusal(engine, error) from error
        after = migrate.current_revision(engine)
        lines = (f"{describe(engine)}: revision {before} -> {after}", *_missing_roles(engine))
        return Outcome(lines, {"before": before, "after": after})
    finally:
        engine.dispose()


UPGRADE: Operation[Request, Outcome] = Operation(
    name="db-upgrade",
    role=ADMINISTRATOR,
    changes_elsewhere=True,
    request=Request,
    run=_upgrade,
    help="""Bring a store that an older version made up to this version.

It also counts anew the impacts and shots of each campaign, whose numbers the store keeps.""",
    example="pyroshock db upgrade",
    command=("db", "upgrade"),
    opens_store=False,
    absent={"json": _KEEPER, "form": _KEEPER, "python": _OPENED_AFTER},
)


class RoleRows(Rows):
    """Roles of a store with the logins that have them."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """The logins in one cell."""
        return {**row, "members": ", ".join(row["members"]) or "-"}


def _roles(_: Request, laboratory: Laboratory, __: Progress) -> RoleRows:
    from ....schema.access.roles import ensure_roles

    return RoleRows([asdict(role) for role in ensure_roles(laboratory.store.engine)], "none")


ROLES: Operation[Request, RoleRows] = Operation(
    name="db-roles",
    role=ADMINISTRATOR,
    request=Request,
    run=_roles,
    help="""Make the roles reader, operator and admin of a store on PostgreSQL, grant what they
lack, and list who has them.

The migrations do this, too, if their login may make roles. A login gets a role in SQL: GRANT
pyroshock_operator TO "alice".""",
    example="pyroshock db roles --db postgresql+psycopg://keeper@server/lab",
    command=("db", "roles"),
    listing=True,
    absent={"json": _KEEPER, "form": _KEEPER, "python": _KEEPER},
)


class StoreCopy(Request):
    """Where a store is, and where its copy is to be."""

    source: str = request_field(
        help="Copy the store at this address.",
        presentation=Presentation(positional=True, metavar="SRC"),
    )
    target: str = request_field(
        help="Copy it to this address, where no store is yet.",
        presentation=Presentation(positional=True, metavar="DST"),
    )


def _copy(request: StoreCopy, _: Laboratory, progress: Progress) -> Outcome:
    from ....schema.engine import describe, make_engine
    from ....schema.session import Writer, open_store
    from ....schema.transfer.copying import copy_store

    with open_store(request.source, Writer("db copy", "")) as store:
        engine = make_engine(request.target)
        try:
            tables = copy_store(store, engine, progress)
            lines = _missing_roles(engine)
        finally:
            engine.dispose()
        counted = (
            f"{describe(engine)}: {sum(table.rows for table in tables)} rows, the same as in "
            f"{describe(store.engine)}"
        )
    lines = (*lines, counted, *_place_of_models(request.source))
    return Outcome(lines, [vars(table) for table in tables])


def _place_of_models(source: str) -> tuple[str, ...]:
    """Models are MLflow's, and stay where they are."""
    from ....training.registry.connection import user_environment
    from ....training.registry.model_storage import storage_for

    place = storage_for(source, user_environment())
    if place.database is None:
        return (f"models stay in {place.shown}, where MLFLOW_TRACKING_URI says",)
    if not place.database.is_file():
        return ()
    return (
        f"The models stay in {place.shown}. Set MLFLOW_TRACKING_URI to it when you work on the "
        "copy (docs/reference/store.md).",
    )


COPY: Operation[StoreCopy, Outcome] = Operation(
    name="db-copy",
    role=ADMINISTRATOR,
    request=StoreCopy,
    run=_copy,
    help="""Copy the store at address SRC to the empty place at address DST. The engines may differ.

Rows and keys are the same afterwards: every table is read back and compared by a hash. DST becomes
a store only when everything is there, and a copy that was stopped leaves it empty. A PostgreSQL
database must exist before.""",
    example="pyroshock db copy sqlite:///results/demo.db sqlite:///copy.db",
    command=("db", "copy"),
    steps="rows",
    long=True,
    uses_store=False,
    absent=_NO_NETWORK,
)


class CampaignExport(Request):
    """A campaign that is written to a file."""

    campaign: Annotated[str, Field(min_length=1, max_length=1000)] = request_field(
        help="Name the campaign.",
        presentation=Presentation(positional=True, completion="campaign_names"),
    )
    out: Path = request_field(
        help="Write to FILE, which must not exist.", presentation=Presentation(metavar="FILE")
    )


def _export(request: CampaignExport, laboratory: Laboratory, progress: Progress) -> Outcome:
    from ....schema.transfer.export import export_campaign

    tables = export_campaign(laboratory.store, request.campaign, request.out, progress)
    rows, size_bytes = sum(tables.values()), request.out.stat().st_size
    line = f"campaign {request.campaign}: {rows} rows, {size_bytes / 1e6:.1f} MB: {request.out}"
    return Outcome((line,), {"file": str(request.out), "rows": dict(tables)})


EXPORT: Operation[CampaignExport, Outcome] = Operation(
    name="db-export",
    role=ENGINEER,
    request=CampaignExport,
    run=_export,
    help="""Write CAMPAIGN with everything that belongs to it into one file, which is an SQLite
store of that campaign only.

The file holds bench, materials, configurations, recordings with their series, impacts, all versions
of pulses, shots, findings, the plan and its runs, diagnoses, and who wrote what. Any command can
read it with --db sqlite:///FILE.""",
    example="pyroshock db export rehearsal --out rehearsal.pyroshock",
    command=("db", "export"),
    steps="rows",
    long=True,
    absent=_NO_NETWORK,
)


class CampaignImport(Request):
    """A file with campaigns of another store."""

    file: _Existing = request_field(
        help="Read this file, which `db export` wrote.",
        presentation=Presentation(positional=True),
    )


def _import(request: CampaignImport, laboratory: Laboratory, progress: Progress) -> Outcome:
    from ....schema.transfer.merging import import_file

    report = import_file(laboratory.store, request.file, progress)
    rows = sum(report.added.values())
    lines = (
        f"{', '.join(report.campaigns)}: "
        + (f"{rows} rows added" if report.added else "all of it was there"),
        *(f"was discarded here, and is back with the file: {line}" for line in report.discarded),
        *(f"left behind: {line}" for line in report.left_behind),
    )
    return Outcome(lines, vars(report))


IMPORT: Operation[CampaignImport, Outcome] = Operation(
    name="db-import",
    role=ADMINISTRATOR,
    request=CampaignImport,
    run=_import,
    help="""Add the campaigns of FILE, which `db export` wrote, to the store. What is there stays,
and nothing is stored twice.

The file may come from anybody. It is checked as `db check` checks a store before anything is
written, and all of it is added or nothing. A campaign, material or plan that differs from a stored
one of the same name is refused.""",
    example="pyroshock db export first-shots --out first-shots.pyroshock\n"
    "pyroshock db import first-shots.pyroshock --db sqlite:///lab.db",
    command=("db", "import"),
    steps="samples",
    long=True,
    creates_store=True,
    absent={"json": _READS_HERE, "form": _READS_HERE},
)


class StoreBackup(Request):
    """Where a backup is to lie."""

    folder: Path = request_field(
        help="Write to this folder, which must not exist.",
        presentation=Presentation(positional=True),
    )


def _backup(request: StoreBackup, laboratory: Laboratory, progress: Progress) -> Outcome:
    from .backup import back_up

    report = back_up(laboratory.store, laboratory.db, request.folder, progress)
    files = f"{report.model_files} files of models"
    models = files if report.has_registry else "no model registry yet"
    line = f"{report.rows} rows, {models}, {report.size_bytes / 1e6:.1f} MB: {request.folder}"
    return Outcome((line,), {**vars(report), "folder": str(report.folder)})


BACKUP: Operation[StoreBackup, Outcome] = Operation(
    name="db-backup",
    role=ADMINISTRATOR,
    request=StoreBackup,
    run=_backup,
    help="""Write the store, its model registry and the models' files into FOLDER, which must not
exist. Others may work meanwhile.

The folder holds one consistent set: every dataset and file that a registered version needs. `db
restore` puts it back, on either engine.""",
    example="pyroshock db backup results/backup --db sqlite:///results/demo.db",
    command=("db", "backup"),
    steps="rows",
    long=True,
    absent=_NO_NETWORK,
)


class StoreReturn(Request):
    """The backup that is put back."""

    folder: _Existing = request_field(
        help="Read the backup in this folder.", presentation=Presentation(positional=True)
    )


def _restore(request: StoreReturn, laboratory: Laboratory, progress: Progress) -> Outcome:
    from .backup import restore

    report = restore(request.folder, laboratory.db, progress)
    line = (
        f"{report.rows} rows and {report.model_files} files of models are back; check them: "
        "pyroshock db check"
    )
    return Outcome((line,), {**vars(report), "folder": str(report.folder)})


RESTORE: Operation[StoreReturn, Outcome] = Operation(
    name="db-restore",
    role=ADMINISTRATOR,
    changes_elsewhere=True,
    request=StoreReturn,
    run=_restore,
    help="""Put the backup in FOLDER back: the store into the empty place that --db names, the model
registry and the models' files where they belong there. Every file is held against its SHA-256
first.""",
    example="pyroshock db backup kept\npyroshock db restore kept --db sqlite:///restored.db",
    command=("db", "restore"),
    steps="rows",
    long=True,
    opens_store=False,
    absent={**_NO_NETWORK, "python": _OPENED_AFTER},
)
