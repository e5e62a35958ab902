"""`plan`: designs made, kept and worked off."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .common import db_option, errors_as_one_line, json_option, note, opened, print_table, write_json
from .discriminate import discriminate

if TYPE_CHECKING:
    from ...doe.plans import StoredPlan
    from ...schema.session import Store

Function = TypeVar("Function", bound=Callable[..., Any])


@click.group(invoke_without_command=True)
@db_option
@json_option
@click.pass_context
def plan(ctx: click.Context, db: str, json_to: str | None) -> None:
    """Plan a campaign: make a design, keep it, see what is to do. Alone, it lists the plans.

    \b
    Example:
        pyroshock plan lhs spring --runs 105
        pyroshock plan sheet spring --out spring.html
        pyroshock plan status spring
    """
    if ctx.invoked_subcommand is not None:
        return
    with opened(db) as store, store.reading() as session:
        from ...doe.plans import list_plans

        rows = list_plans(session)
    if json_to is not None:
        write_json(rows, json_to)
    else:
        print_table(rows, "no plans; make one: pyroshock plan lhs NAME --runs 105")


def _making(function: Function) -> Function:
    """Options of every command that makes a plan."""
    for option in (
        db_option,
        json_option,
        click.option("--repetitions", type=click.IntRange(1), default=10, show_default=True),
        click.option(
            "--seed", type=click.IntRange(0), default=None, help="The same seed, the same plan. [drawn, and told]"
        ),
        click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the table as CSV."),
        click.option("--kind", type=click.Choice(["gun", "hammer"]), default="gun", show_default=True),
        click.option("--factors", type=click.Path(path_type=Path), help="Your own factors, a TOML file."),
        click.option("--gun", "bench", type=click.Path(path_type=Path), help="A campaign folder whose gun fires it."),
    ):
        function = option(function)
    return function


@plan.command()
@click.argument("name")
@click.option("--runs", type=click.IntRange(1), required=True)
@_making
def lhs(name: str, runs: int, **given: Any) -> None:
    """Balanced Latin hypercube: every level, and every pair of levels, as often as any other.

    \b
    Example:
        pyroshock plan lhs spring --runs 105 --seed 1 --out spring.csv
    """
    _make(name, "lhs", given, runs=runs)


@plan.command()
@click.argument("name")
@_making
def factorial(name: str, **given: Any) -> None:
    """Every feasible treatment, in an order with few changeovers.

    \b
    Example:
        pyroshock plan factorial hammer --kind hammer
    """
    _make(name, "factorial", given)


@plan.command("import")
@click.argument("name")
@click.argument("table", type=click.Path(path_type=Path))
@_making
def import_(name: str, table: Path, **given: Any) -> None:
    """A design that somebody else has made: a CSV table, kept in its order.

    \b
    Example:
        pyroshock plan import thesis table_a1_lhs_105_runs.csv
    """
    _make(name, "import", given, table=table)


def _make(name: str, method: str, given: dict[str, Any], **own: Any) -> None:
    from ...doe.toml_space import read_text
    from ..planning import make_plan

    with opened(given["db"], create=True) as store:
        factors = read_text(given["factors"]) if given["factors"] else None
        common = {key: given[key] for key in ("kind", "repetitions", "seed")}
        stored = make_plan(store, method, name, factors=factors, gun=given["bench"], **common, **own)
    told = f", seed {stored.seed}" if stored.seed is not None else ""
    note(f"plan {name}: {len(stored.runs)} runs of {given['repetitions']} repetitions, {stored.method}{told}")
    _tell(stored, given["json_to"], given["out"])


def _read(store: Store, name: str) -> StoredPlan:
    from ...doe.plans import read_plan

    with store.reading() as session:
        return read_plan(session, name)


def _tell(stored: StoredPlan, json_to: str | None, out: Path | None) -> None:
    from ..planning import plan_as_json, write_table

    if out is not None:
        with errors_as_one_line():
            write_table(stored, out)
        note(f"written: {out}")
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
    elif out is None:
        print_table(({"run": run.run, **run.row, **run.settings} for run in stored.runs), "no runs")


@plan.command()
@click.argument("name")
@click.option("--runs", type=click.IntRange(1), default=None, help="How many to add. [as many as were discarded]")
@click.option("--repetitions", type=click.IntRange(1), default=10, show_default=True)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@click.option("--gun", "bench", type=click.Path(path_type=Path), help="A campaign folder whose gun fires it.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the table as CSV.")
@db_option
@json_option
def augment(
    name: str,
    runs: int | None,
    repetitions: int,
    seed: int,
    bench: Path | None,
    out: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Add runs to a plan, the ones that balance best what was recorded and what is still to do.

    \b
    Example:
        pyroshock plan discard spring 17 --reason "tip broke"
        pyroshock plan augment spring
    """
    from ..planning import augment_plan, gun_bench

    with opened(db) as store:
        before = _read(store, name)
        count = runs if runs is not None else sum(run.status == "discarded" for run in before.runs)
        if not count:
            raise ValueError(f"plan {name!r} has no discarded runs to replace; say how many to add: --runs N")
        numbers = augment_plan(store, before, count, repetitions, seed, gun_bench(bench))
        stored = _read(store, name)
    note(f"plan {name}: added runs {', '.join(map(str, numbers))}")
    _tell(stored, json_to, out)


@plan.command()
@click.argument("name")
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
@click.argument("name")
@click.option("--against", default=None, metavar="OTHER", help="Another plan, or a table (CSV) of the same factors.")
@click.option("--plot", type=click.Path(path_type=Path, dir_okay=False), help="Draw the quality into FILE.png.")
@db_option
@json_option
def quality(name: str, against: str | None, plot: Path | None, db: str, json_to: str | None) -> None:
    """How good a plan is: balance of levels, pairs and triples, space filling, changeovers, confounding with time.

    \b
    Example:
        pyroshock plan quality spring --against table_a1_lhs_105_runs.csv --plot quality.png
    """
    from ..plan_quality import designs_of, draw, figures_as_json, tables

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
@click.argument("name")
@db_option
@json_option
def status(name: str, db: str, json_to: str | None) -> None:
    """What of a plan is done, to do, and discarded."""
    with opened(db) as store:
        stored = _read(store, name)
    from ..planning import plan_as_json

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
@click.argument("name")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, metavar="FILE.html|.csv|.xlsx")
@db_option
def sheet(name: str, out: Path, db: str) -> None:
    """The run sheet for the bench, in order of run, with a box to tick.

    \b
    Example:
        pyroshock plan sheet spring --out spring.html
    """
    from ...doe.sheet import write_sheet

    with opened(db) as store:
        write_sheet(_read(store, name), out)
    note(f"written: {out}")


plan.add_command(discriminate)
