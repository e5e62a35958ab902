"""Names for the shell's completion: campaigns, plans, datasets, materials, models and effects.

They are read by the database's driver alone from the store that `--db` or PYROSHOCK_DB names, for a
shell waits with each key: SQLAlchemy and MLflow would take longer to import than the whole answer
takes. A store that is missing, busy or unreadable has no names, and none is made.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path

import click

from ....plugins import EFFECTS, list_plugins
from ....schema.addresses import AddressError, sqlite_file
from ...common.default_store import DEFAULT_DB

Completion = Callable[[click.Context, click.Parameter, str], list[str]]

#: More names than these help nobody who reads them.
_MOST_NAMES = 200
#: A server that does not answer in this time is not waited for, in seconds; the driver takes no
#: less than two.
_PATIENCE_S = 2


def _names(table: str) -> Completion:
    statement = f"SELECT name FROM {table} ORDER BY name"  # noqa: S608  # a table of ours

    def complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
        """Behind a comma where the option takes a list."""
        before, comma, last = incomplete.rpartition(",")
        if not getattr(parameter, "multiple", False):
            before, comma, last = "", "", incomplete
        names = _begun((name for (name,) in _rows(_address(context), statement)), last)
        return [f"{before}{comma}{name}" for name in names]

    return complete


campaign_names = _names("campaigns")
plan_names = _names("plans")
dataset_names = _names("dataset_snapshots")
material_names = _names("materials")
view_names = _names("saved_views")


def diagnosis_numbers(context: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Numbers of the diagnoses, the newest first."""
    rows = _rows(_address(context), "SELECT CAST(id AS VARCHAR) FROM diagnoses ORDER BY id DESC")
    return _begun((number for (number,) in rows), incomplete)


def model_versions(context: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """`NAME@VERSION` of the registered models, and `NAME@champion`; of a registry in a database,
    not of a server."""
    address = _registry(_address(context))
    versions = _rows(
        address,
        "SELECT name, version FROM model_versions WHERE COALESCE(current_stage, '') <> "
        "'Deleted_Internal' ORDER BY name, version DESC",
    )
    aliases = _rows(
        address, "SELECT name, alias FROM registered_model_aliases ORDER BY name, alias"
    )
    champions = dict.fromkeys(
        f"{name}@champion" for name, alias in aliases if alias.startswith("champion")
    )
    return _begun([*champions, *(f"{name}@{version}" for name, version in versions)], incomplete)


def contact_models(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[str]:
    """What `--contact` takes by name: `prior`, `registered`, and registered models."""
    return [
        *_begun(("prior", "registered"), incomplete),
        *model_versions(context, parameter, incomplete),
    ]


def effect_ids(_context: click.Context, _: click.Parameter, incomplete: str) -> list[str]:
    """Effects of the catalogue, also behind a comma.

    An effect has a file of its name; importing all of them takes longer than a shell may wait.
    """
    before, comma, last = incomplete.rpartition(",")
    files = sorted((Path(__file__).parents[3] / "twin").glob("*/effects/[a-z]*.py"))
    names = [f"{file.parent.parent.name.removesuffix('s')}.{file.stem}" for file in files]
    names += [plugin.name for plugin in list_plugins(EFFECTS)]
    return [f"{before}{comma}{name}" for name in _begun(names, last)]


def subject_names(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[str]:
    """What `report` takes by name: campaigns and models."""
    return campaign_names(context, parameter, incomplete) + model_versions(
        context, parameter, incomplete
    )


def _begun(names: Iterable[str], incomplete: str) -> list[str]:
    return [name for name in names if name.startswith(incomplete)][:_MOST_NAMES]


def _address(context: click.Context) -> str:
    """`--db` of the command or of its group, as far as it is typed; else what the environment
    says."""
    from click.core import ParameterSource

    ancestor: click.Context | None = context
    while ancestor is not None:
        if ancestor.get_parameter_source(
            "db"
        ) is ParameterSource.COMMANDLINE and ancestor.params.get("db"):
            return str(ancestor.params["db"])
        ancestor = ancestor.parent
    return os.environ.get("PYROSHOCK_DB") or DEFAULT_DB


def _registry(store: str) -> str:
    """As `model_storage.storage_for` has it, which imports SQLAlchemy."""
    if given := os.environ.get("MLFLOW_TRACKING_URI"):
        return given
    file = _file(store)
    models = (
        Path("pyroshock-models.db") if file is None else file.with_name(f"{file.stem}-models.db")
    )
    return f"sqlite:///{models}"


def _file(address: str) -> Path | None:
    try:
        file = sqlite_file(address)
    except AddressError:  # the next command says it
        return None
    return None if file is None else Path(file)


def _rows(address: str, statement: str) -> list[tuple[str, ...]]:
    try:
        file = _file(address)
        if file is not None:
            return _rows_of_file(file, statement) if file.is_file() else []
        return _rows_of_server(address, statement) if address.startswith("postgresql") else []
    except Exception:  # noqa: BLE001
        # whatever it is: the next command says it, the shell's prompt is no place for it
        return []


def _rows_of_file(file: Path, statement: str) -> list[tuple[str, ...]]:
    with closing(
        sqlite3.connect(f"{file.absolute().as_uri()}?mode=ro", uri=True, timeout=0.2)
    ) as connection:
        return connection.execute(statement).fetchall()


def _rows_of_server(address: str, statement: str) -> list[tuple[str, ...]]:
    import psycopg

    url = "postgresql" + address[address.index("://") :]
    with psycopg.connect(url, connect_timeout=_PATIENCE_S, autocommit=True) as connection:
        connection.execute("SET default_transaction_read_only = on")
        connection.execute(f"SET statement_timeout = {1000 * _PATIENCE_S}")
        return connection.execute(statement.encode()).fetchall()
