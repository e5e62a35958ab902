"""`dataset`: pulses frozen for training, looked at, traced to their raw files, exported."""

from __future__ import annotations

from pathlib import Path

import click

from ...operations.laboratory import Laboratory
from ...operations.train.build_dataset import BUILD_DATASET
from ...operations.train.stored_datasets import LIST_DATASETS, SHOW_DATASET, TRACE_PULSE
from ..command_line.common import db_option, note, open_command_store, spreadsheet_guard_option
from ..command_line.completion import dataset_names
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import NounGroup
from ..command_line.operation_command import command_of


@click.group(cls=NounGroup, invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def dataset(ctx: click.Context, db: str, listing: Listing) -> None:
    """Freeze pulses for training, and see what a dataset holds. Without a command, list the
    datasets.

    \b
    Example:
        pyroshock dataset build both --from rehearsal,slow-valve
        pyroshock dataset show both --plot both.png
    """
    if ctx.invoked_subcommand is None:
        _list(db, listing)


def _list(db: str, listing: Listing) -> None:
    """List the datasets with their name, hash, pulses and campaigns.

    \b
    Example:
        pyroshock dataset list
    """
    with open_command_store(db) as store:
        request = LIST_DATASETS.request()
        listed = LIST_DATASETS.answer(request, Laboratory(store, db), lambda *_: None)
    listing.show(
        listed.to_json(),
        "no datasets yet; freeze one: pyroshock dataset build NAME --from CAMPAIGN",
        lambda row: {
            **row,
            "hash": row["hash"][:12],
            "campaigns": ", ".join(row["campaigns"] or []),
        },
    )
    for line in listed.notes() if listing.json_to is None else ():
        note(line)


dataset.command("list")(db_option(listing_options(_list)))


for _operation in (BUILD_DATASET, SHOW_DATASET, TRACE_PULSE):
    dataset.add_command(command_of(_operation))


@dataset.command()
@click.argument("name", shell_complete=dataset_names)
@db_option
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write to FILE.csv or FILE.parquet.",
)
@spreadsheet_guard_option
def export(name: str, db: str, out: Path) -> None:
    """Write a dataset to a file, with a row per pulse: its key, predictors, figures and points of
    force.

    \b
    Example:
        pyroshock dataset export rehearsal-pulses --out pulses.parquet
    """
    with open_command_store(db) as store:
        from ....dataset.snapshot import read_snapshot
        from ...operations.train.datasets import export_snapshot

        rows = export_snapshot(read_snapshot(store, name), out)
    note(f"{rows} rows written: {out}")
