"""`plan lhs`, `plan factorial`, `plan import`, `plan augment`: ways to make a plan, each with its own options."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from statistics import mode
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .common import db_option, json_option, note, opened
from .completion import plan_names
from .made_plan import tell_plan

if TYPE_CHECKING:
    from ...doe.plans import StoredPlan

Function = TypeVar("Function", bound=Callable[..., Any])


def _making(function: Function) -> Function:
    """Options of every command that makes a plan."""
    for option in (
        db_option,
        json_option,
        click.option(
            "--repetitions", type=click.IntRange(1), default=10, show_default=True, help="Hits or shots of each run."
        ),
        click.option(
            "--seed", type=click.IntRange(0), default=None, help="The same seed, the same plan. [drawn, and told]"
        ),
        click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the table as CSV."),
        click.option(
            "--kind", type=click.Choice(["gun", "hammer"]), default="gun", show_default=True, help="Whose factors."
        ),
        click.option("--factors", type=click.Path(path_type=Path), help="Your own factors, a TOML file."),
        click.option("--gun", "bench", type=click.Path(path_type=Path), help="A campaign folder whose gun fires it."),
    ):
        function = option(function)
    return function


@click.command()
@click.argument("name")
@click.option("--runs", type=click.IntRange(1), required=True, help="How many treatments.")
@_making
def lhs(name: str, runs: int, **given: Any) -> None:
    """Balanced Latin hypercube: every level, and every pair of levels, as often as any other.

    \b
    Example:
        pyroshock plan lhs spring --runs 105 --seed 1 --out spring.csv
    """
    _make(name, "lhs", given, runs=runs)


@click.command()
@click.argument("name")
@_making
def factorial(name: str, **given: Any) -> None:
    """Every feasible treatment, in an order with few changeovers.

    \b
    Example:
        pyroshock plan factorial hammer --kind hammer
    """
    _make(name, "factorial", given)


@click.command("import")
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


def _factors(path: Path) -> str:
    from ...doe.space import space_from_text
    from ...schema.toml_text import read_toml_text

    try:
        text = read_toml_text(path)
        space_from_text(text)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return text


def _make(name: str, method: str, given: dict[str, Any], **own: Any) -> None:
    from ..plans.planning import make_plan

    with opened(given["db"], create=True) as store:
        factors = _factors(given["factors"]) if given["factors"] else None
        common = {key: given[key] for key in ("kind", "repetitions", "seed")}
        stored = make_plan(store, method, name, factors=factors, gun=given["bench"], **common, **own)
    told = f", seed {stored.seed}" if stored.seed is not None else ""
    note(f"plan {name}: {len(stored.runs)} runs of {given['repetitions']} repetitions, {stored.method}{told}")
    _tell(stored, given["json_to"], given["out"])


@click.command()
@click.argument("name", shell_complete=plan_names)
@click.option("--runs", type=click.IntRange(1), default=None, help="How many to add. [as many as were discarded]")
@click.option(
    "--repetitions", type=click.IntRange(1), default=None, help="Hits or shots of each run. [as most runs of the plan]"
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="The same seed, the same runs.")
@click.option("--gun", "bench", type=click.Path(path_type=Path), help="A campaign folder whose gun fires it.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the table as CSV.")
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
    """Add runs to a plan, the ones that balance best what was recorded and what is still to do.

    \b
    Example:
        pyroshock plan discard spring 17 --reason "tip broke"
        pyroshock plan augment spring
    """
    from ...doe.plans import read_plan
    from ..plans.planning import augment_plan
    from ..plans.settings import gun_bench

    with opened(db) as store:
        with store.reading() as session:
            before = read_plan(session, name)
        count = runs if runs is not None else sum(run.status == "discarded" for run in before.runs)
        if not count:
            raise ValueError(f"plan {name!r} has no discarded runs to replace; say how many to add: --runs N")
        each = repetitions or mode(run.repetitions for run in before.runs)
        numbers = augment_plan(store, before, count, each, seed, gun_bench(bench))
        with store.reading() as session:
            stored = read_plan(session, name)
    note(f"plan {name}: added runs {', '.join(map(str, numbers))}")
    _tell(stored, json_to, out)


def _tell(stored: StoredPlan, json_to: str | None, out: Path | None) -> None:
    tell_plan(stored, ({"run": run.run, **run.row, **run.settings} for run in stored.runs), json_to, out)
