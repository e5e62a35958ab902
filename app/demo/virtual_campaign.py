"""The demo's virtual campaigns: planned, ingested from recordings that ship and from shots that are
fired on the virtual bench, and linked to their plans."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...doe.plans import StoredPlan, UnknownPlanError, read_plan
from ...ingest.load import ingest_folder
from ...ingest.storing.plan_link import link_campaign
from ...parallel.phases import Phases
from ...schema.listings import iter_shots
from ...schema.session import Store
from ..common.nominal_velocity import with_predictions
from ..figures.figure import (
    ColourRole,
    Plot,
    PlotAxis,
    PlotGrid,
    PointSeries,
    as_floats,
    equal_line,
)
from ..operations.plan.figures import run_order_figure
from ..operations.plan.planning import make_plan
from ..operations.plan.rehearsal import NAME, SEED, RehearsalResult, simulate_plan

if TYPE_CHECKING:
    from ...virtualbench.simulate import SimulatedCampaign
    from ..common.progress import Step

#: One plate without anvil, so that the virtual bench solves one plate only, and levels at which its
#: load cells do not saturate: 36 combinations.
FACTORS = """
name = "demo"
kind = "gun"

[[factors]]
name = "plate_material"
kind = "categorical"
levels = ["aluminum"]

[[factors]]
name = "anvil_material"
kind = "categorical"
levels = ["none"]

[[factors]]
name = "insulator"
kind = "categorical"
levels = ["none"]

[[factors]]
name = "tip_material"
kind = "categorical"
levels = ["PLA", "aluminum", "steel"]

[[factors]]
name = "tip_radius"
column = "tip_radius_mm"
kind = "numeric"
unit = "mm"
levels = [30, 60]

[[factors]]
name = "bullet_mass"
column = "bullet_mass_kg"
kind = "numeric"
unit = "kg"
levels = [0.4, 0.8]

[[factors]]
name = "velocity_level"
kind = "ordered"
levels = ["low", "medium", "high"]
unit = "m/s"
values = [8, 10, 12]
"""


@dataclass(frozen=True)
class VirtualCampaign:
    """A campaign of the virtual bench: `effects` are strengths by name, the others have their usual
    strength of 1.

    Its recordings ship with the software, in the folder of its name in `examples/`, but for those
    of the last `fired_runs` runs, which the demo fires itself.
    """

    name: str
    runs: int | None  # None: every combination of levels
    repetitions: int
    seed: int
    effects: Mapping[str, float] = field(default_factory=dict)
    fired_runs: int = 0

    def shipped_runs(self, plan: StoredPlan) -> range:
        """The numbers of the runs of its plan whose recordings ship."""
        return range(1, len(plan.runs) - self.fired_runs + 1)

    def open_runs(self, plan: StoredPlan) -> range:
        """The numbers of the other runs."""
        return range(len(plan.runs) - self.fired_runs + 1, len(plan.runs) + 1)


#: Seconds of a processor for a recording, where it is simulated and where it is ingested; a plate
#: is solved before the first is simulated.
_SIMULATION_S, _INGEST_S = 0.8, 0.05
#: Chapters 2 to 4.
REHEARSAL = VirtualCampaign(NAME, runs=None, repetitions=1, seed=SEED, fired_runs=10)
#: The effect that is switched on for chapter 5: the valve passes less gas, and opens more slowly,
#: than it usually does.
EFFECT, STRENGTH = "gun.valve_flow", 3.0
CHANGED = VirtualCampaign("slow-valve", runs=12, repetitions=2, seed=2, effects={EFFECT: STRENGTH})


def fire_campaign(
    store: Store, campaign: VirtualCampaign, folder: Path, step: Step
) -> RehearsalResult:
    """Plan a campaign, ingest its recordings that ship, and simulate and ingest the others into
    `folder`; what is there already is not made again."""
    plan = make_campaign_plan(store, campaign)
    shipped_count, fired_count = (
        len(runs(plan)) for runs in (campaign.shipped_runs, campaign.open_runs)
    )
    phases = Phases(
        step,
        {
            "ingesting": _INGEST_S * shipped_count,
            "simulating": _SIMULATION_S * fired_count,
            "ingesting the shots": _INGEST_S * fired_count,
        },
    )
    with as_file(files("pyroshock") / "examples" / campaign.name) as place:
        report = ingest_folder(store, place, progress=phases.of("ingesting"))
    if fired_count:
        if not (folder / "campaign.toml").is_file():
            simulating = phases.of("simulating")
            simulating(0, fired_count, "solving the plate")
            simulate_runs(plan, campaign, campaign.open_runs(plan), folder, simulating)
        report = ingest_folder(store, folder, progress=phases.of("ingesting the shots"))
    link_campaign(store, campaign.name, campaign.name)
    with store.reading() as session:
        runs = read_plan(session, campaign.name).runs
        shots = list(with_predictions(session, iter_shots(session, campaign.name)))
    ratios = np.array(
        [
            s["measured_velocity_m_s"] / s["predicted_velocity_m_s"]
            for s in shots
            if s["measured_velocity_m_s"]
        ]
    )
    return RehearsalResult(
        planned=len(runs),
        done=sum(run.status == "done" for run in runs),
        repeat=sum(run.repeats > 0 for run in runs),
        shots=len(shots),
        findings=len(report.findings),
        median_ratio=float(np.median(ratios)),
        spread=float(np.std(ratios)),
    )


def simulate_runs(
    plan: StoredPlan,
    campaign: VirtualCampaign,
    runs: Collection[int],
    folder: Path,
    progress: Step | None = None,
) -> SimulatedCampaign:
    """Fire some runs of a campaign on the virtual bench into a new campaign folder."""
    return simulate_plan(
        plan, folder, seed=campaign.seed, effects=campaign.effects, progress=progress, runs=runs
    )


def make_campaign_plan(store: Store, campaign: VirtualCampaign) -> StoredPlan:
    """The plan of a campaign, stored under its name; the one that is there already, where there is
    one."""
    with store.reading() as session:
        try:
            return read_plan(session, campaign.name)
        except UnknownPlanError:
            pass
    method, runs = ("factorial", {}) if campaign.runs is None else ("lhs", {"runs": campaign.runs})
    given = {"repetitions": campaign.repetitions, "seed": campaign.seed, "factors": FACTORS}
    return make_plan(store, method, campaign.name, **given, **runs)


def campaign_figure(store: Store, name: str) -> PlotGrid:
    """Left: the levels of the plan from run to run. Right: measured velocities over those of the
    nominal gun."""

    with store.reading() as session:
        plan = read_plan(session, name)
        shots = [
            s
            for s in with_predictions(session, iter_shots(session, name))
            if s["measured_velocity_m_s"]
        ]
    title = f"The plan: {len(plan.runs)} runs"
    order = run_order_figure(plan.space, plan.treatments("planned", "done"), title)
    nominal, measured = (
        as_floats([shot[key] for shot in shots])
        for key in ("predicted_velocity_m_s", "measured_velocity_m_s")
    )
    velocities = Plot(
        f"{len(shots)} shots on the virtual bench",
        PlotAxis("velocity of the nominal gun", "m/s"),
        PlotAxis("velocity on the virtual bench", "m/s"),
        (
            equal_line("as the nominal gun", np.zeros(1), nominal),
            PointSeries(nominal, measured, name="virtual shots", role=ColourRole.MEASURED),
        ),
    )
    return PlotGrid(f"Campaign {name}", ((order, velocities),))
