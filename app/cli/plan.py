"""`plan`: designs made, kept and worked off."""

from __future__ import annotations

from pathlib import Path

import click

from .common import db_option, json_option, note, opened, print_table, write_json
from .completion import plan_names
from .designs import DesignCommands, augment
from .discriminate import discriminate
from .listed import Listing, listing_options


@click.group(cls=DesignCommands, invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def plan(ctx: click.Context, db: str, listing: Listing) -> None:
    """Plan a campaign: make a design, keep it, see what is to do. Alone, it lists the plans.

    \b
    Example:
        pyroshock plan lhs spring --runs 105
        pyroshock plan sheet spring --out spring.html
        pyroshock plan status spring
    """
    if ctx.invoked_subcommand is None:
        _list(db, listing)


@plan.command("list")
@db_option
@listing_options
def list_(db: str, listing: Listing) -> None:
    """List the plans with their counts of runs."""
    _list(db, listing)


def _list(db: str, listing: Listing) -> None:
    with opened(db) as store, store.reading() as session:
        from ...doe.plans import list_plans

        rows = list_plans(session)
    listing.show(rows, "no plans; make one: pyroshock plan lhs NAME --runs 105")


@plan.command()
@click.argument("name", shell_complete=plan_names)
@click.argument("run", type=int)
@click.option("--reason", required=True, help="Why; it stays with the run.")
@db_option
def discard(name: str, run: int, reason: str, db: str) -> None:
    """Take a run out of a plan: it broke, it was refused, its records are no good."""
    from ...doe.plans import discard_run

    with opened(db) as store:
        discard_run(store, name, run, reason)
    note(f"plan {name}: run {run} discarded; pyroshock plan augment {name} replaces it")


@plan.command()
@click.argument("name", shell_complete=plan_names)
@click.option(
    "--against",
    default=None,
    metavar="OTHER",
    help="Another plan, or a table (CSV) of the same factors.",
    shell_complete=plan_names,
)
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False), help="Draw the quality into FILE.png.")
@db_option
@json_option
def quality(name: str, against: str | None, plot: Path | None, db: str, json_to: str | None) -> None:
    """How good a plan is: balance of levels, pairs and triples, space filling, changeovers, confounding with time.

    \b
    Example:
        pyroshock plan quality spring --against table_a1_lhs_105_runs.csv --plot quality.png
    """
    from ..plans.quality import designs_of, draw, figures_as_json, tables

    with opened(db) as store:
        space, designs = designs_of(store, name, against)
        if plot is not None:
            draw(space, designs, plot)
            note(f"plot: {plot}")
    if json_to is not None:
        write_json(figures_as_json(space, designs), json_to)
        return
    for rows in tables(space, designs):
        print_table(rows, "nothing to show")
        click.echo()


@plan.command()
@click.argument("name", shell_complete=plan_names)
@db_option
@json_option
def status(name: str, db: str, json_to: str | None) -> None:
    """What of a plan is done, to do, and discarded."""
    from ...doe.plans import read_plan
    from ..plans.tables import plan_as_json

    with opened(db) as store, store.reading() as session:
        stored = read_plan(session, name)
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
        return
    counts = {state: sum(run.status == state for run in stored.runs) for state in ("done", "planned", "discarded")}
    begun = sum(0 < run.recorded < run.repetitions for run in stored.runs if run.status == "planned")
    click.echo(
        f"{name}: {counts['done']} done, {counts['planned']} to do ({begun} begun), {counts['discarded']} discarded"
    )
    print_table(
        (
            {"run": run.run, "status": run.status, "recorded": f"{run.recorded}/{run.repetitions}", **run.row}
            | ({"reason": run.reason} if run.reason else {})
            for run in stored.runs
        ),
        "no runs",
    )


@plan.command()
@click.argument("name", shell_complete=plan_names)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    metavar="FILE.html|.csv|.xlsx",
    help="Its ending says as what.",
)
@db_option
def sheet(name: str, out: Path, db: str) -> None:
    """The run sheet for the bench, in order of run, with a box to tick.

    \b
    Example:
        pyroshock plan sheet spring --out spring.html
    """
    from ...doe.plans import read_plan
    from ...doe.sheet import write_sheet

    with opened(db) as store, store.reading() as session:
        write_sheet(read_plan(session, name), out)
    note(f"written: {out}")


for command in (augment, discriminate):
    plan.add_command(command)
