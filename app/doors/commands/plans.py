"""`plans`: list, show or delete the plans of the store."""

from __future__ import annotations

import click

from ..command_line.common import db_option, note, open_command_store
from ..command_line.completion import plan_names
from ..command_line.nouns import noun_group
from ..command_line.options import confirm_deletion, deletion_options
from .plan import plan


@click.command()
@click.argument("name", shell_complete=plan_names)
@db_option
@deletion_options
def delete(name: str, db: str, dry_run: bool) -> None:
    """Delete a plan with its runs. A plan for which something was recorded is refused.

    \b
    Example:
        pyroshock plan lhs autumn --runs 20
        pyroshock plans delete autumn --yes
    """
    with open_command_store(db) as store:
        from ....doe.plan_deletion import check_plan_unused, delete_plan

        with store.reading() as session:
            check_plan_unused(session, name)
        if dry_run:
            note(f"plan {name} can be deleted; nothing was deleted")
            return
        confirm_deletion(f"plan {name}")
        runs = delete_plan(store, name)
    note(f"plan {name} is deleted with its {runs} runs")


plans = noun_group(
    plan.commands["list"],
    {"show": plan.commands["status"], "delete": delete},
    """List the plans; show or delete one. Without a command, list them.
    `pyroshock plan` makes new plans.

    \b
    Example:
        pyroshock plans
        pyroshock plans show rehearsal
    """,
)
