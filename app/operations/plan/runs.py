"""Decisions about the runs of a plan, and further runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mode
from typing import Annotated, Any, Literal
from urllib.parse import quote

from pydantic import Field

from ....doe.plans import StoredPlan, StoredRun, read_plan, tick_run
from ....schema.person_roles import ENGINEER
from ...common.plan_tables import write_table
from ..faults import Fault, RequestError
from ..fields import Presentation, Seed, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress, Request, Result
from .planning import PlanAddition, draft_addition, gun_bench
from .service import PlannedDesign
from .status import NAMED, PlanName

Run = Annotated[int, Field(ge=0, le=2**31 - 1)]
_RUN = Presentation(positional=True)


class RunDecision(Request):
    """What is decided about a run at the bench."""

    name: PlanName = request_field(help="Name the plan.", presentation=NAMED)
    run: Run = request_field(help="Give the number of the run.", presentation=_RUN)
    status: Literal["planned", "done", "discarded"] = request_field(
        help="Decide: done with fewer repetitions than planned, discarded, or planned again."
    )
    note: str = request_field(
        "",
        max_length=2000,
        help="Say why. A run that is discarded, or done with fewer repetitions, needs a reason.",
    )


class RunToDiscard(Request):
    """A run that is taken out of a plan."""

    name: PlanName = request_field(help="Name the plan.", presentation=NAMED)
    run: Run = request_field(help="Give the number of the run.", presentation=_RUN)
    reason: str = request_field(
        min_length=1, max_length=2000, help="Say why. The plan keeps the reason with the run."
    )


@dataclass(frozen=True)
class DecidedRun(Result):
    """A run after a decision."""

    plan: str
    run: StoredRun

    def notes(self) -> Sequence[str]:
        """The decision."""
        return (f"plan {self.plan}: run {self.run.run} {self.run.status}",)

    def to_json(self) -> dict[str, Any]:
        """The run with its state, its reason, and what is recorded of it."""
        return {
            "run": self.run.run,
            "status": self.run.status,
            "reason": self.run.reason,
            "recorded": len(self.run.accepted),
            "rejected": list(self.run.rejected),
        }

    def address(self) -> str:
        """The run sheet: at this run where it is planned again, else at the next one."""
        place = f"?run={self.run.run}" if self.run.status == "planned" else ""
        return f"/plans/{quote(self.plan, safe='')}/sheet{place}"

    def next_command(self) -> Sequence[str]:
        """A discarded run is replaced by another one."""
        return ("plan", "augment", self.plan) if self.run.status == "discarded" else ()


def _decide(request: RunDecision, laboratory: Laboratory, _: Progress) -> DecidedRun:
    decided = tick_run(
        laboratory.store,
        request.name,
        request.run,
        status=request.status,
        note=request.note or None,
    )
    return DecidedRun(request.name, decided)


def _discard(request: RunToDiscard, laboratory: Laboratory, _: Progress) -> DecidedRun:
    decided = tick_run(
        laboratory.store, request.name, request.run, status="discarded", note=request.reason
    )
    return DecidedRun(request.name, decided)


PLAN_DECIDE: Operation[RunDecision, DecidedRun] = Operation(
    name="plan-decide",
    request=RunDecision,
    run=_decide,
    help="Decide about a run of a plan at the bench. A run is done by itself when all its "
    "repetitions are recorded and accepted.",
    example='pyroshock plan decide rehearsal 17 --status done --note "the tip broke at the end"',
    command=("plan", "decide"),
    route=("POST", "/plans/{name}/runs/{run}"),
    form=FormPage("/plans/{name}/sheet", "decide", "/plans/{name}/runs/{run}"),
)
PLAN_DISCARD: Operation[RunToDiscard, DecidedRun] = Operation(
    name="plan-discard",
    request=RunToDiscard,
    run=_discard,
    help="Take a run out of a plan, for example because a part broke or its records are bad.",
    example='pyroshock plan discard rehearsal 17 --reason "tip broke"',
    command=("plan", "discard"),
    route=("POST", "/plans/{name}/runs/{run}/discard"),
)


class PlanExtension(Request):
    """Runs that are added to a plan."""

    name: PlanName = request_field(help="Name the plan.", presentation=NAMED)
    runs: Annotated[int, Field(ge=1, le=2000)] | None = request_field(
        None, help="Set how many runs to add. [default: as many as were discarded]"
    )
    repetitions: Annotated[int, Field(ge=1, le=1000)] | None = request_field(
        None, help="Set the hits or shots of each run. [default: as most runs of the plan]"
    )
    seed: Seed = request_field(0, help="Set the seed: the same seed gives the same runs.")
    gun: Path | None = request_field(
        None,
        help="Take the limits of the gun of this campaign folder.",
        presentation=Presentation(metavar="FOLDER"),
    )


class ExtendedPlan(PlannedDesign):
    """A plan with the numbers of the runs that were added."""

    def __init__(self, stored: StoredPlan, added: Sequence[int]) -> None:
        super().__init__(stored)
        self.added = tuple(added)

    def notes(self) -> Sequence[str]:
        """The numbers of the runs."""
        return (f"plan {self.name}: added runs {', '.join(map(str, self.added))}",)


def _check(request: PlanExtension, laboratory: Laboratory) -> None:
    with laboratory.store.reading() as session:
        _runs_to_add(request, read_plan(session, request.name))


def _runs_to_add(request: PlanExtension, stored: StoredPlan) -> int:
    runs = request.runs or sum(run.status == "discarded" for run in stored.runs)
    if not runs:
        message = (
            f"runs is missing, and plan {request.name!r} has no discarded runs to replace; "
            "expected how many to add"
        )
        raise RequestError([Fault("runs", message)])
    return runs


def _draft(request: PlanExtension, laboratory: Laboratory, progress: Progress) -> PlanAddition:
    progress(0, 0, "balancing the runs")
    with laboratory.store.reading() as session:
        stored = read_plan(session, request.name)
    runs = _runs_to_add(request, stored)
    repetitions = request.repetitions or mode(run.repetitions for run in stored.runs)
    gun = gun_bench(request.gun)
    return draft_addition(laboratory.store, stored, runs, repetitions, request.seed, gun)


def _extend(addition: PlanAddition, laboratory: Laboratory) -> ExtendedPlan:
    added = addition.store(laboratory.store)
    with laboratory.store.reading() as session:
        return ExtendedPlan(read_plan(session, addition.name), added)


PLAN_AUGMENT: Operation[PlanExtension, ExtendedPlan] = Operation(
    name="plan-augment",
    role=ENGINEER,
    request=PlanExtension,
    run=_draft,
    keep=_extend,
    check=_check,
    long=True,
    help="Add runs to a plan, so that they balance best what was recorded and what is still to do.",
    example='pyroshock plan discard rehearsal 17 --reason "tip broke"\n'
    "pyroshock plan augment rehearsal",
    command=("plan", "augment"),
    route=("POST", "/plans/{name}/augment"),
    outputs=(
        Output(
            "out",
            "Write the table of runs to FILE as CSV.",
            lambda planned, path: write_table(planned.stored, path),
            (".csv",),
            in_place_of_tables=True,
        ),
    ),
)
