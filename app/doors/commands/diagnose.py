"""`diagnose`: where the gap between twin and bench lies, what causes it, how far it shrinks."""

from __future__ import annotations

from typing import Any

import click

from ...operations.diagnose.make import DIAGNOSE
from ..command_line.common import open_command_store
from ..command_line.listed import Listing
from ..command_line.operation_command import command_of


def _with_list(made: click.Command) -> click.Command:
    """The command with `--list`, which lists diagnoses in place of making one."""
    make = made.callback
    assert make is not None

    def call(listed: bool, **given: Any) -> None:
        if listed:
            _tell_diagnoses_of(given["campaign"], given["db"], given["json_to"])
        else:
            make(**given)

    made.callback = call
    made.params.append(
        click.Option(
            ["--list", "listed"],
            is_flag=True,
            help="List the diagnoses of the campaign that the store holds.",
        )
    )
    return made


def _tell_diagnoses_of(campaign: str, db: str, json_to: str | None) -> None:
    from ...operations.diagnose.show import row_in_words
    from ...operations.diagnose.stored import list_diagnoses

    with open_command_store(db) as store, store.reading() as session:
        rows = [
            {key: value for key, value in row.items() if key not in ("campaign", "complete")}
            for row in list_diagnoses(session, campaign, limit=None)
        ]
    empty = f"no diagnoses of {campaign}; make one: pyroshock diagnose {campaign}"
    Listing(json_to).show(rows, empty, row_in_words)


diagnose = _with_list(command_of(DIAGNOSE))
