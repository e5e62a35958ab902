"""A campaign before the first real one: a stored plan fired on the virtual bench, by the command
line and by notebooks alike, to be ingested and held against its plan."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ....doe.plans import StoredPlan, read_plan
from ....schema.session import Store
from ....virtualbench.effects import Effects
from ....virtualbench.gun.fire import Trigger
from ....virtualbench.simulate import simulate
from ...common.frames import si
from ...common.plan_tables import cells_of

if TYPE_CHECKING:
    from ....virtualbench.simulate import SimulatedCampaign
    from ...common.frames import Quantity
    from ...common.progress import Step


def rows_of(store: Store, name: str) -> tuple[str, list[dict[str, str]], int]:
    """Kind, rows with run number, treatment and settings in order of run, and repetitions of a
    plan's open runs.

    Discarded runs are left out. Raises `UnknownPlanError`, and `ValueError` where nothing is left
    to play.
    """
    with store.reading() as session:
        plan = read_plan(session, name)
    return rows_of_stored(plan)


def rows_of_stored(plan: StoredPlan) -> tuple[str, list[dict[str, str]], int]:
    """As `rows_of`, of a plan that was read. Raises `ValueError` where nothing is left to play."""
    runs = [run for run in plan.runs if run.status != "discarded"]
    if not runs:
        raise ValueError(f"plan {plan.name!r} has no run that is not discarded")
    rows = [{"run": str(run.run), **cells_of(run)} for run in runs]
    return plan.space.kind, rows, max(run.repetitions for run in runs)


def simulate_plan(
    plan: StoredPlan,
    folder: Path,
    *,
    seed: int = 0,
    effects: Mapping[str, float] | None = None,
    echoes: bool = False,
    name: str | None = None,
    repetitions: int | None = None,
    trigger: str | float | None = None,
    pre_trigger: Quantity | None = None,
    jobs: int | None = None,
    progress: Step | None = None,
    runs: Collection[int] | None = None,
) -> SimulatedCampaign:
    """Fire a plan on the virtual bench into a new campaign folder, as
    `virtualbench.simulate.simulate` does.

    `effects` are strengths by name; the others keep their usual strength of 1. `name` and
    `repetitions` are the plan's unless they are given, and `runs` are all of it. Raises
    `ValueError` as that function, `Effects.with_strength` and `trigger_of`.
    """

    kind, rows, planned = rows_of_stored(plan)
    acting = Effects.default()
    for effect, strength in (effects or {}).items():
        acting = acting.with_strength(effect, float(strength))
    return simulate(
        rows,
        kind,
        folder,
        seed=seed,
        effects=acting,
        echoes=echoes,
        repetitions=planned if repetitions is None else repetitions,
        jobs=jobs,
        progress=progress,
        name=name or plan.name,
        trigger=trigger_of(trigger, pre_trigger),
        runs=runs,
    )


def trigger_of(share: str | float | None, pre_trigger: Quantity | None) -> Trigger | None:
    """When recordings begin: "5%" or 0.05 of the tank's pressure lost, or "none" for a recorder
    started by hand.

    None where neither is given. Raises `ValueError`.
    """
    if share is None and pre_trigger is None:
        return None
    usual = Trigger()
    before_s = usual.pre_trigger_s if pre_trigger is None else si(pre_trigger, "s", "--pre-trigger")
    if share is None:
        return Trigger(usual.share, before_s)
    if not isinstance(share, str):
        return Trigger(float(share), before_s)
    if share == "none":
        return Trigger(None, before_s)
    number, percent, rest = share.partition("%")
    try:
        if not percent or rest.strip():
            raise ValueError(share)
        return Trigger(float(number) / 100, before_s)
    except ValueError as error:
        raise ValueError(f"--trigger is {share!r}; expected a share such as 5%, or none") from error


NAME, SEED = "rehearsal", 1


@dataclass(frozen=True)
class RehearsalResult:
    """What came of it: counts, and how far the measured velocities lie from the nominal gun's."""

    planned: int
    done: int
    repeat: int  # runs with a repetition that a check rejects
    shots: int
    findings: int
    median_ratio: float  # measured over predicted velocity
    spread: float  # standard deviation of the ratio

    def as_row(self) -> dict[str, Any]:
        return vars(self).copy()
