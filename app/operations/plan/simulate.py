"""Fire a plan on the virtual bench, which writes recordings as a real bench does."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ....doe.plans import read_plan
from ....schema.person_roles import ENGINEER
from ..fields import Presentation, Seed, pairs, quantity, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Result
from .rehearsal import simulate_plan
from .status import PlanName

if TYPE_CHECKING:
    from ....virtualbench.simulate import SimulatedCampaign


def _strength(field: str, effect: str, value: Any) -> float:
    """1 where none is given: the strength of a realistic bench."""
    try:
        strength = 1.0 if value == "" else float(value)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{field} is '{effect}={value}'; expected NAME=STRENGTH, such as gun.blow_by=2"
        ) from error
    if not math.isfinite(strength):
        raise ValueError(f"{field} is '{effect}={value}'; expected a finite strength")
    return strength


class Simulation(Request):
    """A plan, and the bench that it is fired on."""

    plan: PlanName = request_field(
        help="Name the plan.", presentation=Presentation(positional=True, completion="plan_names")
    )
    out: Path = request_field(
        help="Write the campaign to this new folder.", presentation=Presentation(metavar="FOLDER")
    )
    seed: Seed = request_field(0, help="Set the seed: the same seed gives the same files.")
    effects: pairs(_strength, float) = request_field(  # type: ignore[valid-type]
        {},
        help="Set the strength of an effect: 0 removes it, 1 is the strength of a realistic bench. "
        "Repeat the option, or give a list: a=2,b=3.",
        example="gun.blow_by=3",
        presentation=Presentation(
            metavar="NAME=STRENGTH", option="effect", completion="effect_ids"
        ),
    )
    echoes: bool = request_field(
        False, help="Let reflections from the edges of the plate act on the contact."
    )
    name: str | None = request_field(
        None, help="Name the campaign. [default: the name of the plan]", max_length=200
    )
    repetitions: Annotated[int, Field(ge=1, le=1000)] | None = request_field(
        None, help="Set the number of repetitions of each run. [default: that of the plan]"
    )
    trigger: str | float | None = request_field(
        None,
        help="Set the share of the tank pressure whose loss triggers the record of a gun. "
        "[default: 5%]",
        presentation=Presentation(metavar="5%|none"),
    )
    pre_trigger: quantity("s") | None = request_field(  # type: ignore[valid-type]
        None,
        help="Set the time that is recorded before the trigger. [default: 300ms]",
        presentation=Presentation(metavar="300ms"),
    )


@dataclass(frozen=True)
class SimulatedPlan(Result):
    """What was written: a campaign folder, and beside it the settings and true values."""

    campaign: SimulatedCampaign
    kind: str

    def notes(self) -> Sequence[str]:
        """Folder, counts, and the file with the true values."""
        made, what = self.campaign, "shots" if self.kind == "gun" else "hits"
        return (
            f"{made.folder}: {made.recordings} recordings with {made.hits} {what}; settings and "
            f"true values: {made.seal}",
        )

    def to_json(self) -> dict[str, Any]:
        """Folder, counts, and the file with the true values."""
        made = self.campaign
        return {
            "folder": str(made.folder),
            "recordings": made.recordings,
            "hits": made.hits,
            "seal": str(made.seal),
        }

    def next_command(self) -> Sequence[str]:
        """The folder is ingested next."""
        return ("ingest", str(self.campaign.folder))


def _simulate(request: Simulation, laboratory: Laboratory, progress: Progress) -> SimulatedPlan:
    with laboratory.store.reading() as session:
        stored = read_plan(session, request.plan)
    made = simulate_plan(
        stored,
        request.out,
        seed=request.seed,
        effects=request.effects,
        echoes=request.echoes,
        name=request.name,
        repetitions=request.repetitions,
        trigger=request.trigger,
        pre_trigger=request.pre_trigger,
        jobs=laboratory.executor.jobs,
        progress=progress,
    )
    return SimulatedPlan(made, stored.space.kind)


_FOLDER = "It writes a folder of the machine that it runs on."

SIMULATE: Operation[Simulation, SimulatedPlan] = Operation(
    name="simulate",
    role=ENGINEER,
    request=Simulation,
    run=_simulate,
    help="""Fire PLAN on the virtual bench, which writes recordings as a real bench does, to try
everything on.

The settings and the true values are written to FOLDER.sealed.json, for the person who scores a
diagnosis afterwards.""",
    example="pyroshock simulate slow-valve --out autumn/ --name autumn --effect gun.blow_by=3\n"
    "pyroshock ingest autumn/",
    command=("simulate",),
    long=True,
    steps="recordings",
    workers="Set the number of processes.",
    label=lambda request: request.plan,
    absent={"json": _FOLDER, "form": _FOLDER},
)
