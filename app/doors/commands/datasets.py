"""`datasets`: list, show or delete the datasets of the store."""

from __future__ import annotations

import click

from ..command_line.common import db_option, note, open_command_store
from ..command_line.completion import dataset_names
from ..command_line.nouns import noun_group
from ..command_line.options import confirm_deletion, deletion_options
from .dataset import dataset


@click.command()
@click.argument("name", shell_complete=dataset_names)
@db_option
@deletion_options
def delete(name: str, db: str, dry_run: bool) -> None:
    """Delete a dataset, given by name or hash; its pulses stay with their campaigns.

    A dataset on which registered models were trained is refused: their figures could no longer be
    computed again.

    \b
    Example:
        pyroshock dataset build autumn --from slow-valve
        pyroshock datasets delete autumn --yes
    """
    with open_command_store(db) as store:
        from ...operations.train.deletion import check_dataset_unused, delete_dataset

        check_dataset_unused(store, db, name)
        if dry_run:
            note(f"dataset {name} can be deleted; nothing was deleted")
            return
        confirm_deletion(f"dataset {name}")
        delete_dataset(store, db, name)
    note(f"dataset {name} is deleted")


dataset.add_command(delete)
datasets = noun_group(
    dataset.commands["list"],
    {"show": dataset.commands["show"], "delete": delete},
    """List the datasets; show or delete one. Without a command, list them.
    `pyroshock dataset` makes new datasets.

    \b
    Example:
        pyroshock datasets
        pyroshock datasets show rehearsal-pulses
    """,
)
