"""`simulate`: a plan played on the virtual bench, into a campaign folder."""

from __future__ import annotations

from pathlib import Path

import click

from .common import db_option, json_option, note, opened, write_json
from .completion import plan_names


@click.command()
@click.argument("plan", shell_complete=plan_names)
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="FOLDER", help="A new folder.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="The same seed, the same files.")
@click.option(
    "--effect",
    "effects",
    multiple=True,
    metavar="NAME=STRENGTH",
    help="Set an effect: 0 takes it away, 1 is a realistic bench's. Repeat for several.",
)
@click.option("--echoes", is_flag=True, help="The plate's edges act on what strikes it while it touches.")
@click.option("--name", default=None, help="The campaign's name. [the plan's]")
@click.option("--repetitions", type=click.IntRange(1), default=None, help="[the plan's]")
@click.option("--trigger", metavar="5%|none", default=None, help="Of a gun: share of the tank's pressure lost. [5%]")
@click.option("--pre-trigger", metavar="300ms", default=None, help="Recorded before the trigger. [300ms]")
@click.option("--jobs", type=click.IntRange(1), default=None, help="Processes. [cores, at most 4]")
@db_option
@json_option
def simulate(
    plan: str,
    out: Path,
    seed: int,
    effects: tuple[str, ...],
    echoes: bool,
    name: str | None,
    repetitions: int | None,
    trigger: str | None,
    pre_trigger: str | None,
    jobs: int | None,
    db: str,
    json_to: str | None,
) -> None:
    """Play PLAN on the virtual bench: recordings as a real bench would leave them, to try everything on.

    What was set and what really happened goes to FOLDER.sealed.json, for whoever scores a diagnosis afterwards.

    \b
    Example:
        pyroshock plan lhs spring --runs 105
        pyroshock simulate spring --out spring/ --effect gun.blow_by=3
        pyroshock ingest spring/
    """
    with opened(db) as store:
        from ...doe.plans import read_plan
        from ..plans.simulation import simulate_plan
        from ..progress import progress_bar

        with store.reading() as session:
            stored = read_plan(session, plan)
        with progress_bar(plan, "recordings") as step:
            made = simulate_plan(
                stored,
                out,
                seed=seed,
                effects=_strengths(effects),
                echoes=echoes,
                name=name,
                repetitions=repetitions,
                trigger=trigger,
                pre_trigger=pre_trigger,
                jobs=jobs,
                progress=step,
            )
    note(f"{made.folder}: {made.recordings} recordings, {made.hits} hits; sealed: {made.seal}")
    if json_to is not None:
        write_json(
            {"folder": str(made.folder), "recordings": made.recordings, "hits": made.hits, "seal": str(made.seal)},
            json_to,
        )


def _strengths(texts: tuple[str, ...]) -> dict[str, float]:
    """Effect -> strength, of NAME=STRENGTH; 1 where none is given. Raises `ValueError`."""
    strengths = {}
    for text in texts:
        name, sign, strength = text.partition("=")
        try:
            strengths[name.strip()] = float(strength) if sign else 1.0
        except ValueError as error:
            raise ValueError(f"--effect {text!r}; expected NAME=STRENGTH, such as gun.blow_by=2") from error
    return strengths
