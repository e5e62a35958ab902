"""`db copy`: a store from one engine to another."""

from __future__ import annotations

import click

from ..common import errors_as_one_line, json_option, note, opened, write_json
from ..roles import note_missing_roles


@click.command()
@click.argument("source", metavar="SRC")
@click.argument("target", metavar="DST")
@json_option
def copy(source: str, target: str, json_to: str | None) -> None:
    """Copy the store at address SRC into the empty place at address DST; engines may differ.

    Rows and keys are the same afterwards: every table is read back and compared by a hash. DST becomes a store only
    when all of it is there; a copy that was stopped leaves it empty. A PostgreSQL database must exist.

    \b
    Example:
        pyroshock db copy sqlite:///lab.db postgresql+psycopg://lab@server/lab
    """
    with opened(source) as store:
        from ....schema.engine import describe, make_engine
        from ....schema.transfer.copying import copy_store
        from ...progress import progress_bar

        engine = make_engine(target)
        try:
            with progress_bar("Copying", "rows") as step:
                tables = copy_store(store, engine, step)
            note_missing_roles(engine)
        finally:
            engine.dispose()
        if json_to is not None:
            write_json([vars(table) for table in tables], json_to)
        note(f"{describe(engine)}: {sum(table.rows for table in tables)} rows, the same as in {describe(store.engine)}")
    with errors_as_one_line():
        _say_where_models_are(source)


def _say_where_models_are(source: str) -> None:
    """Models are MLflow's, and stay where they are."""
    from ....training.registry.connection import user_environment
    from ....training.registry.model_storage import place_beside

    place = place_beside(source, user_environment())
    if place.database is not None and place.database.is_file():
        note(
            f"The models stay in {place.shown}. Set MLFLOW_TRACKING_URI to it when you work on the copy "
            "(docs/reference/store.md)."
        )
    elif place.database is None:
        note(f"models stay in {place.shown}, where MLFLOW_TRACKING_URI says")
