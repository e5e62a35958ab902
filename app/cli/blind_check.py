"""`blind-check`: the diagnosis scored on campaigns whose cause is withheld from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from .common import errors_as_one_line, json_option, write_json


@click.command("blind-check")
@click.option("--cases", type=click.IntRange(1), required=True, help="Campaigns of each tier.")
@click.option("--seed", type=click.IntRange(0), required=True, help="Drawn after the code was fixed, used once.")
@click.option("--tier", "tiers", multiple=True, metavar="NAME", help="Only this tier: repeat. [all]")
@click.option("--jobs", type=click.IntRange(1), default=2, show_default=True, help="Processes.")
@click.option("--folder", type=click.Path(file_okay=False, path_type=Path), help="Keep answers here, and go on.")
@click.option("--no-baselines", is_flag=True, help="Without the simpler ways of answering beside it.")
@click.option("--no-shrinkage", is_flag=True, help="Only where and why, in two thirds of the time.")
@json_option
def blind_check(
    cases: int,
    seed: int,
    tiers: tuple[str, ...],
    jobs: int,
    folder: Path | None,
    no_baselines: bool,
    no_shrinkage: bool,
    json_to: str | None,
) -> None:
    """Record campaigns on the virtual bench whose effect is drawn and sealed, diagnose their folders, then score.

    Salted hashes of the labels are published before the first diagnosis (in FOLDER, and in the JSON); the labels are
    opened after the last.

    \b
    Example:
        pyroshock blind-check --cases 20 --seed 7 --tier strong
    """
    with errors_as_one_line():
        from ...diagnosis.blind.run import OPTIONS, run
        from ..finite import finite
        from ..progress import progress_bar

        with progress_bar("blind check", "cases") as step:
            report = run(
                cases,
                seed,
                _known(tiers),
                jobs=jobs,
                folder=folder,
                progress=step,
                options=replace(OPTIONS, shrink=not no_shrinkage),
                baselines=not no_baselines,
                oracle=not no_shrinkage,
            )
    if json_to is not None:
        write_json(finite(report.as_json()), json_to)
    else:
        click.echo(report.text())


def _known(tiers: tuple[str, ...]) -> tuple[str, ...]:
    """Tiers by name, every one where none is named. Raises `ValueError` for another one."""
    from ...diagnosis.blind.tasks import TIERS

    for tier in tiers:
        if tier not in TIERS:
            raise ValueError(f"--tier is {tier!r}; expected one of {', '.join(TIERS)}")
    return tiers or tuple(TIERS)
