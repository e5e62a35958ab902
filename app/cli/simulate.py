"""`simulate`: a plan played on the virtual bench, into a campaign folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..library.quantities import parse_quantity
from .common import db_option, json_option, note, opened, write_json
from .completion import plan_names

if TYPE_CHECKING:
    from ...virtualbench.effects import Effects
    from ...virtualbench.gun.channels import Trigger


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
        from ...virtualbench.simulate import simulate as play
        from ..plans.simulation import rows_of
        from ..progress import progress_bar

        kind, rows, planned = rows_of(store, plan)
        with progress_bar(plan, "recordings") as step:
            made = play(
                rows,
                kind,
                out,
                seed=seed,
                effects=_effects(effects),
                echoes=echoes,
                repetitions=repetitions or planned,
                jobs=jobs,
                progress=step,
                name=name or plan,
                trigger=_trigger(trigger, pre_trigger),
            )
    note(f"{made.folder}: {made.recordings} recordings, {made.hits} hits; sealed: {made.seal}")
    if json_to is not None:
        write_json(
            {"folder": str(made.folder), "recordings": made.recordings, "hits": made.hits, "seal": str(made.seal)},
            json_to,
        )


def _effects(texts: tuple[str, ...]) -> Effects:
    from ...virtualbench.effects import Effects

    effects = Effects.default()
    for text in texts:
        name, sign, strength = text.partition("=")
        try:
            value = float(strength) if sign else 1.0
        except ValueError as error:
            raise ValueError(f"--effect {text!r}; expected NAME=STRENGTH, such as gun.blow_by=2") from error
        effects = effects.with_strength(name.strip(), value)
    return effects


def _trigger(share: str | None, pre_trigger: str | None) -> Trigger | None:
    """What the options say; None where they say nothing. Raises `ValueError`."""
    from ...virtualbench.gun.channels import Trigger

    if share is None and pre_trigger is None:
        return None
    usual = Trigger()
    before_s = usual.pre_trigger_s if pre_trigger is None else parse_quantity(pre_trigger, "s", "--pre-trigger")
    if share is None or share == "none":
        return Trigger(None if share else usual.share, before_s)
    number, percent, rest = share.partition("%")
    try:
        if not percent or rest.strip():
            raise ValueError(share)
        return Trigger(float(number) / 100, before_s)
    except ValueError as error:
        raise ValueError(f"--trigger is {share!r}; expected a share such as 5%, or none") from error
