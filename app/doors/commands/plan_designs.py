"""Commands that make a plan: one for each method of `doe.designs.methods`, and `plan augment`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from statistics import mode
from typing import TYPE_CHECKING, Any

import click

from ...common.progress import progress_bar
from ..command_line.common import (
    db_option,
    errors_as_one_line,
    json_option,
    note,
    open_command_store,
    print_table,
    spreadsheet_guard_option,
    write_json,
)
from ..command_line.completion import plan_names
from ..command_line.next_step import suggest_next
from ..command_line.nouns import NounGroup

if TYPE_CHECKING:
    from ....doe.plans import StoredPlan


def tell_plan(
    stored: StoredPlan, rows: Iterable[dict[str, Any]], json_to: str | None, out: Path | None
) -> None:
    """The plan as CSV in `out`, as JSON in `json_to`; `rows` of it as a table where neither is
    asked for."""
    from ...common.plan_tables import plan_as_json, write_table

    if out is not None:
        with errors_as_one_line():
            write_table(stored, out)
        note(f"written: {out}")
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
    elif out is None:
        print_table(rows, "no runs")


class DesignCommands(NounGroup):
    """The group `plan`: what is no command of its own is a method of design, made a command when it
    is asked for.

    The methods know NumPy, which `--help` of another command does not pay for.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        from ....doe.designs.methods import METHODS

        return sorted({*super().list_commands(ctx), *METHODS})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            return command
        from ....doe.designs.methods import METHODS

        if cmd_name not in METHODS:
            return None
        from ...operations.plan.make import PLAN, REQUESTS
        from ..command_line.operation_command import command_of

        return command_of(PLAN, REQUESTS[cmd_name])


@click.command()
@click.argument("name", shell_complete=plan_names)
@click.option(
    "--runs",
    type=click.IntRange(1),
    default=None,
    help="Set how many runs to add. [default: as many as were discarded]",
)
@click.option(
    "--repetitions",
    type=click.IntRange(1),
    default=None,
    help="Set the hits or shots of each run. [default: as most runs of the plan]",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed: the same seed gives the same runs.",
)
@click.option(
    "--gun",
    "bench",
    type=click.Path(path_type=Path),
    help="Take the limits of the gun of this campaign folder.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write the table of runs to FILE as CSV.",
)
@spreadsheet_guard_option
@db_option
@json_option
def augment(
    name: str,
    runs: int | None,
    repetitions: int | None,
    seed: int,
    bench: Path | None,
    out: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Add runs to a plan, so that they balance best what was recorded and what is still to do.

    \b
    Example:
        pyroshock plan discard rehearsal 17 --reason "tip broke"
        pyroshock plan augment rehearsal
    """
    progress = progress_bar(f"Adding runs to plan {name}")
    with open_command_store(db) as store, progress:
        from ....doe.plans import read_plan
        from ...operations.plan.planning import augment_plan, gun_bench

        with store.reading() as session:
            before = read_plan(session, name)
        count = runs if runs is not None else sum(run.status == "discarded" for run in before.runs)
        if not count:
            raise ValueError(
                f"plan {name!r} has no discarded runs to replace; say how many to add: --runs N"
            )
        repetitions_of_run = repetitions or mode(run.repetitions for run in before.runs)
        numbers = augment_plan(store, before, count, repetitions_of_run, seed, gun_bench(bench))
        with store.reading() as session:
            stored = read_plan(session, name)
    note(f"plan {name}: added runs {', '.join(map(str, numbers))}")
    _tell(stored, json_to, out)
    suggest_next("plan", "sheet", name, "--out", f"{name}.html")


def _tell(stored: StoredPlan, json_to: str | None, out: Path | None) -> None:
    from ...common.plan_tables import cells_of, settings_in_si

    tell_plan(
        stored,
        ({"run": run.run, **settings_in_si(cells_of(run))} for run in stored.runs),
        json_to,
        out,
    )
