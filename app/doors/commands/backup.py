"""`db backup` and `db restore`."""

from __future__ import annotations

from pathlib import Path

import click

from ...common.progress import progress_bar
from ..command_line.common import db_option, errors_as_one_line, note, open_command_store


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@db_option
def backup(folder: Path, db: str) -> None:
    """Write the store, its model registry and the models' files into FOLDER, which must not exist.
    Others may work meanwhile.

    The folder holds one consistent set: every dataset and file that a registered version needs. `db
    restore` puts it back, on either engine.

    \b
    Example:
        pyroshock db backup results/backup --db sqlite:///results/demo.db
    """
    progress = progress_bar("Backing the store up", "rows")
    with open_command_store(db) as store:
        from ...operations.store.backup import back_up

        with progress as step:
            report = back_up(store, db, folder, step)
    models = (
        f"{report.model_files} files of models" if report.has_registry else "no model registry yet"
    )
    note(f"{report.rows} rows, {models}, {report.size_bytes / 1e6:.1f} MB: {folder}")


@click.command()
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@db_option
def restore(folder: Path, db: str) -> None:
    """Put the backup in FOLDER back: the store into the empty place that --db names, the model
    registry and the models' files where they belong there. Every file is held against its SHA-256
    first.

    \b
    Example:
        pyroshock db backup kept
        pyroshock db restore kept --db sqlite:///restored.db
    """
    progress = progress_bar("Restoring the store", "rows")
    with errors_as_one_line():
        from ...operations.store.backup import restore as restore_backup

        with progress as step:
            report = restore_backup(folder, db, step)
    note(
        f"{report.rows} rows and {report.model_files} files of models are "
        f"back; check them: pyroshock db check"
    )
