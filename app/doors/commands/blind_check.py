"""`blind-check`: the diagnosis scored on campaigns whose cause is withheld from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...common.progress import progress_bar
from ..command_line.common import errors_as_one_line, json_option, worker_options, write_json
from ..command_line.options import split_names

if TYPE_CHECKING:
    from ....parallel.executor import ExecutorConfig
    from ....validation.report import Pool, Report


@click.command("blind-check")
@click.option("--cases", type=click.IntRange(1), help="Set the number of campaigns of each tier.")
@click.option(
    "--seed", type=click.IntRange(0), help="Set the seed of the cases. [default: that of the split]"
)
@click.option(
    "--tier",
    "tiers",
    multiple=True,
    callback=split_names,
    metavar="NAME",
    help="Take only this tier. Repeat the option, or give a list: a,b. [default: all]",
)
@click.option(
    "--kind",
    "kinds",
    multiple=True,
    callback=split_names,
    metavar="NAME",
    help="Take only this kind of campaign, where a tier has several. Repeat the "
    "option, or give a list: a,b.",
)
@click.option(
    "--split",
    type=click.Choice(["development", "calibration", "sealed"]),
    default="sealed",
    show_default=True,
    help="Choose which families, laws and seeds may be drawn.",
)
@click.option(
    "--time-limit",
    type=click.FloatRange(1),
    default=900.0,
    show_default=True,
    help="Stop a case after this number of seconds.",
)
@worker_options("Set the number of processes.")
@click.option(
    "--folder",
    type=click.Path(file_okay=False, path_type=Path),
    help="Keep the answers in this folder, and continue those that are there.",
)
@click.option(
    "--pool",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help=(
        "Run no new check, but make one table of the answers kept here, from several nights "
        "or machines. The option can be repeated."
    ),
)
@click.option(
    "--no-baselines",
    is_flag=True,
    help="Leave out the simpler methods that are shown beside the diagnosis.",
)
@click.option(
    "--no-shrinkage",
    is_flag=True,
    help="Leave out the reduction of the gap, which takes a third of the time.",
)
@json_option
def blind_check(
    cases: int | None,
    seed: int | None,
    tiers: tuple[str, ...],
    kinds: tuple[str, ...],
    split: str,
    time_limit: float,
    executor: ExecutorConfig,
    folder: Path | None,
    pool: tuple[Path, ...],
    no_baselines: bool,
    no_shrinkage: bool,
    json_to: str | None,
) -> None:
    """Score the diagnosis on virtual campaigns whose effects are drawn and sealed before.

    The virtual bench records the campaigns, and their folders are diagnosed. Salted hashes of the
    labels are published before the first diagnosis (in FOLDER, and in the JSON), and the labels are
    opened after the last one.

    \b
    Example:
        pyroshock blind-check --cases 8 --seed 7 --tier realistic --split development
    """
    with errors_as_one_line():
        if pool:
            _tell(_pooled(pool), json_to)
            return
        if cases is None:
            raise ValueError(
                "--cases is missing; give it, or --pool FOLDER for checks that are finished"
            )
        progress = progress_bar(f"Diagnosing {cases} campaigns of known cause", "cases")
        from ....validation.blind_check import OPTIONS, run
        from ....validation.case_plan import SEEDS

        with progress as step:
            report = run(
                cases,
                SEEDS[split] if seed is None else seed,
                _tiers_named(tiers),
                executor=executor,
                folder=folder,
                progress=step,
                options=replace(OPTIONS, shrink=not no_shrinkage),
                baselines=not no_baselines,
                oracle=not no_shrinkage,
                split=split,
                kinds=kinds,
                patience_s=time_limit,
            )
        _tell(report, json_to)


def _tell(report: Report | Pool, json_to: str | None) -> None:
    from ...common.number_format import finite

    if json_to is not None:
        write_json(finite(report.as_json()), json_to)
    else:
        click.echo(report.text())


def _pooled(folders: tuple[Path, ...]) -> Pool:
    """Of folders, or of the files with scored rows themselves."""
    from ....validation.bench_figures import bench_tables
    from ....validation.case_plan import BENCHES
    from ....validation.cause_figures import cause_tables
    from ....validation.report import SCORED, Pool, pooled
    from ....validation.tally import kinds, tables

    checks, rows = pooled([path if path.is_file() else path / SCORED for path in folders])
    names = tuple(BENCHES)
    return Pool(
        tuple(checks),
        tables(rows),
        kinds(rows),
        bench_tables(rows, names),
        cause_tables(rows, names),
    )


def _tiers_named(tiers: tuple[str, ...]) -> tuple[str, ...]:
    """Tiers by name, or by the name of several, every one where none is named. Raises `ValueError`
    for another one."""
    from ....validation.case_plan import GROUPS, TIERS

    named: list[str] = []
    for tier in tiers:
        if tier not in TIERS and tier not in GROUPS:
            raise ValueError(f"--tier is {tier!r}; expected one of {', '.join([*TIERS, *GROUPS])}")
        named += GROUPS.get(tier, (tier,))
    return tuple(named) or tuple(TIERS)
