"""Commands that make a plan: one for each method of `doe.designs.methods`, and `plan augment`."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import mode
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ..cli.common import (
    db_option,
    errors_as_one_line,
    json_option,
    note,
    open_command_store,
    print_table,
    spreadsheet_guard_option,
    write_json,
)
from ..cli.completion import plan_names
from ..cli.next_step import suggest_next
from ..cli.nouns import NounGroup
from ..common.progress import progress_bar

if TYPE_CHECKING:
    from ...doe.designs.methods import DesignMethod, Option
    from ...doe.plans import StoredPlan


def tell_plan(
    stored: StoredPlan, rows: Iterable[dict[str, Any]], json_to: str | None, out: Path | None
) -> None:
    """The plan as CSV in `out`, as JSON in `json_to`; `rows` of it as a table where neither is
    asked for."""
    from ..common.plan_tables import plan_as_json, write_table

    if out is not None:
        with errors_as_one_line():
            write_table(stored, out)
        note(f"written: {out}")
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
    elif out is None:
        print_table(rows, "no runs")


Function = TypeVar("Function", bound=Callable[..., Any])


class DesignCommands(NounGroup):
    """The group `plan`: what is no command of its own is a method of design, made a command when it
    is asked for.

    The methods know NumPy, which `--help` of another command does not pay for.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        from ...doe.designs.methods import METHODS

        return sorted({*super().list_commands(ctx), *METHODS})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        command = super().get_command(ctx, cmd_name)
        if command is not None:
            return command
        from ...doe.designs.methods import METHODS

        return _method_command(cmd_name, METHODS[cmd_name]) if cmd_name in METHODS else None


def _ranges(
    _: click.Context, __: click.Parameter, given: tuple[str, ...]
) -> dict[str, tuple[float, ...]]:
    """Column to low, high and step of each COLUMN=LOW:HIGH or COLUMN=LOW:HIGH:STEP."""
    ranges = {}
    for text in given:
        column, _sign, limits = text.partition("=")
        try:
            ranges[column] = tuple(float(number) for number in limits.split(":"))
        except ValueError:
            raise click.BadParameter(
                f"{text!r}; expected such as tank_pressure_bar=0.8:6:0.05"
            ) from None
    return ranges


def _design_options(function: Function) -> Function:
    """Options of every command that makes a plan."""
    for option in (
        db_option,
        json_option,
        click.option(
            "--repetitions",
            type=click.IntRange(1),
            default=10,
            show_default=True,
            help="Set the hits or shots of each run.",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0),
            default=None,
            help="Set the seed: the same seed gives the same plan. [default: drawn and reported]",
        ),
        click.option(
            "--out",
            type=click.Path(path_type=Path, dir_okay=False),
            help="Write the table of runs to FILE as CSV.",
        ),
        spreadsheet_guard_option,
        click.option(
            "--kind",
            type=click.Choice(["gun", "hammer"]),
            default="gun",
            show_default=True,
            help="Take the factors of this kind of bench.",
        ),
        click.option(
            "--factors",
            type=click.Path(path_type=Path),
            help="Read your own factors from a TOML file.",
        ),
        click.option(
            "--range",
            "ranges",
            callback=_ranges,
            multiple=True,
            metavar="COLUMN=LOW:HIGH[:STEP]",
            help="Make a factor continuous over a range, in the unit of its "
            "column. The option can be repeated.",
        ),
        click.option(
            "--gun",
            "bench",
            type=click.Path(path_type=Path),
            help="Take the limits of the gun of this campaign folder.",
        ),
    ):
        function = option(function)
    return function


def _layout_options(function: Function, centre_points: bool) -> Function:
    """Options of every command whose runs and their order are made here."""
    for option in (
        click.option(
            "--order",
            type=click.Choice(["split-plot", "random"]),
            default="split-plot",
            show_default=True,
            help="Choose the order of runs: a split plot changes heavy parts "
            "seldom; random is full randomisation.",
        ),
        click.option(
            "--blocks",
            type=click.IntRange(1),
            default=1,
            show_default=True,
            help=(
                "Visit every heavy set-up this many times, forwards and backwards in turn, so that "
                "a drift of the bench can be told from its effect."
            ),
        ),
        click.option(
            "--replicates",
            type=click.IntRange(1),
            default=1,
            show_default=True,
            help="Plan every treatment this many times, as runs of their own.",
        ),
    ):
        function = option(function)
    if not centre_points:
        return function
    return click.option(
        "--centre-points",
        type=click.IntRange(0),
        default=0,
        show_default=True,
        help="Add this many runs in the middle of all ordered factors, which show "
        "a curved response.",
    )(function)


def _method_command(name: str, method: DesignMethod) -> click.Command:
    """The command of a method: its own options, then those that all have."""

    def make(**given: Any) -> None:
        own = {option.name: given.pop(option.name) for option in method.options}
        _make(given.pop("name"), name, given, own)

    command = _design_options(make)
    if "table" not in method.takes:
        command = _layout_options(command, method.centre_points)
    for option in reversed(method.options):
        command = click.option(f"--{option.name}", **_of_option(option))(command)
    if "runs" in method.takes:
        command = click.option(
            "--runs", type=click.IntRange(1), required=True, help="Set the number of runs."
        )(command)
    if "table" in method.takes:
        command = click.argument("table", type=click.Path(path_type=Path))(command)
    command = click.argument("name")(command)
    lines = "".join(f"\n    pyroshock {line}" for line in method.example.splitlines())
    example = f"\n\n\b\nExample:{lines}" if lines else ""
    return click.command(name, help=f"{method.help}{example}")(command)


def _of_option(option: Option) -> dict[str, Any]:
    kind = click.Choice(option.choices) if option.choices else option.kind
    return {
        "type": kind,
        "default": option.default,
        "show_default": option.default is not None,
        "help": option.help,
    }


def _factors(path: Path) -> str:
    from ...doe.space import space_from_text
    from ...files.toml_text import read_toml_text

    try:
        text = read_toml_text(path)
        space_from_text(text)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    return text


def _make(name: str, method: str, given: dict[str, Any], options: dict[str, Any]) -> None:
    progress = progress_bar(f"Making plan {name}")
    with open_command_store(given["db"], create=True) as store, progress:
        from .service import PlanCollection

        factors = _factors(given["factors"]) if given["factors"] else None
        common = {key: given[key] for key in ("kind", "repetitions", "seed")}
        common |= {
            key: given[key]
            for key in ("order", "blocks", "replicates", "centre_points")
            if key in given
        }
        taken = {key: given[key] for key in ("runs", "table") if key in given}
        made = PlanCollection(store).make(
            name, method=method, factors=factors, gun=given["bench"], ranges=given["ranges"],
            options=options,
            **common, **taken,
        )  # fmt: skip
    stored = made.stored
    seed_text = f", seed {stored.seed}" if stored.seed is not None else ""
    note(
        f"plan {name}: {len(stored.runs)} runs of {given['repetitions']} "
        f"repetitions, {stored.method}{seed_text}"
    )
    for line in made.aliases():
        note(f"aliased: {line}")
    _tell(stored, given["json_to"], given["out"])
    suggest_next("plan", "sheet", name, "--out", f"{name}.html")


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
        from ...doe.plans import read_plan
        from .planning import augment_plan, gun_bench

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
    from ..common.plan_tables import cells_of, settings_in_si

    tell_plan(
        stored,
        ({"run": run.run, **settings_in_si(cells_of(run))} for run in stored.runs),
        json_to,
        out,
    )
