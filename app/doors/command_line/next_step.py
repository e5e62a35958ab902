"""The next step after a job: one line on standard error, for people."""

from __future__ import annotations

import shlex

import click

from .common import note


def suggest_next(*words: str) -> None:
    """Say which command comes next: `suggest_next("train", "spring")`. A script that reads JSON is
    told nothing."""
    context = click.get_current_context()
    if context.params.get("json_to") is None:
        note(f"next: {shlex.join(('pyroshock', *words))}{_store(context)}")


def _store(context: click.Context) -> str:
    """`--db URL` where this command was typed with it: the next one means the same store."""
    from click.core import ParameterSource

    from ....schema.addresses import address_for_display

    typed = context.get_parameter_source("db") is ParameterSource.COMMANDLINE
    if not typed or "db" not in context.params:
        return ""
    return f" --db {shlex.quote(address_for_display(context.params['db']))}"
