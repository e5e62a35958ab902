"""Plans: make one as a job (what would only be refused after the search is refused before), judge
it, tick its runs."""

from __future__ import annotations

import secrets
from dataclasses import replace
from typing import Annotated, Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select

from ...doe.designs.methods import METHODS, get_method
from ...doe.plans import PlanExistsError, list_plans, read_plan, tick_run
from ...doe.space import space_from_form
from ...schema.campaigns import Plan
from ...schema.session import Store
from ..common.plan_tables import plan_as_json
from ..jobs.queue import JobView
from ..web.dependencies import Key, Name, OpenStore, Running, Text
from ..web.jobs import Jobs
from .job import PLAN, PlanArguments
from .quality import plan_page

#: More runs than a laboratory fires in a year, and more than the search can balance in minutes.
MOST_RUNS = 2000
#: Nothing, what an address takes for a way up, and the page that makes plans.
_NO_NAMES = ("", ".", "..", "new")


def plan_job(jobs: Jobs, store: Store, wanted: PlanArguments) -> JobView:
    """Queue the making of a plan, with its seed drawn. Raises `ValueError` for what cannot be
    made."""
    _check(store, wanted)
    drawn = wanted.seed if wanted.seed is not None else secrets.randbelow(2**31)
    return jobs.ask(store, PLAN, f"Plan {wanted.name}", replace(wanted, seed=drawn))


def _check(store: Store, wanted: PlanArguments) -> None:
    if wanted.name.strip() in _NO_NAMES:
        raise ValueError(f"{wanted.name!r} cannot name a plan; expected a word or two")
    if wanted.runs is not None and not 1 <= wanted.runs <= MOST_RUNS:
        raise ValueError(f"{wanted.runs} runs; expected 1 to {MOST_RUNS}")
    if wanted.seed is not None and not 0 <= wanted.seed < 2**31:
        raise ValueError(f"seed is {wanted.seed}; expected 0 to {2**31 - 1}, or none to draw one")
    get_method(wanted.method).checked(wanted.options)
    if wanted.factors:
        space_from_form(wanted.factors)
    with store.reading() as session:
        if session.scalar(select(Plan.id).where(Plan.name == wanted.name)) is not None:
            raise PlanExistsError(
                f"plan {wanted.name!r} is in the store already; choose another name"
            )


router = APIRouter(tags=["plans"])


class NewPlan(BaseModel):
    """`factors`: text of a factors file in TOML; `table`: text of a CSV to import. Empty: the
    shipped ones.

    `options` are those of the method, such as {"criterion": "maximin"} of "lhs". The whole design
    comes `replicates` times; `order` "random" is full randomisation, and `blocks` visit every heavy
    set-up so many times.
    """

    name: Text = Field(min_length=1, max_length=200)
    method: Annotated[str, Field(json_schema_extra={"enum": [*METHODS]})] = "lhs"
    kind: Literal["gun", "hammer"] = "gun"
    runs: Annotated[int, Field(ge=1, le=MOST_RUNS)] = 105
    repetitions: Annotated[int, Field(ge=1, le=1000)] = 10
    seed: Annotated[int | None, Field(ge=0, le=2**31 - 1)] = None
    factors: Text = Field("", max_length=200_000)
    table: Text = Field("", max_length=800_000)
    description: Text = Field("", max_length=10_000)
    options: Annotated[dict[Text, Text | int | float], Field(max_length=20)] = {}
    replicates: Annotated[int, Field(ge=1, le=100)] = 1
    centre_points: Annotated[int, Field(ge=0, le=200)] = 0
    order: Literal["split-plot", "random"] = "split-plot"
    blocks: Annotated[int, Field(ge=1, le=100)] = 1


class Tick(BaseModel):
    """`note`: why. A discarded run needs one, and one that is done with fewer repetitions than
    planned."""

    status: Literal["planned", "done", "discarded"]
    note: Text | None = Field(None, max_length=2000)


@router.get("/plans")
def plans(store: OpenStore) -> list[dict[str, Any]]:
    """Every plan with its counts of runs by state."""
    with store.reading() as session:
        return list_plans(session)


@router.post("/plans")
def make(plan: NewPlan, store: OpenStore, running: Running) -> dict[str, Any]:
    """Make a plan; answers with the job, whose result is the plan."""
    return plan_job(running, store, PlanArguments(**plan.model_dump())).as_json()


@router.get("/plans/{name}")
def plan(name: Name, store: OpenStore) -> dict[str, Any]:
    """A plan with its runs in order."""
    with store.reading() as session:
        return plan_as_json(read_plan(session, name))


@router.get("/plans/{name}/quality")
def quality(name: Name, store: OpenStore) -> dict[str, Any]:
    """Balance, spread, changeovers and confounding with time of the runs that are not discarded."""
    with store.reading() as session:
        return plan_page(read_plan(session, name))


@router.post("/plans/{name}/runs/{run}")
def tick(name: Name, run: Key, tick_request: Tick, store: OpenStore) -> dict[str, Any]:
    """Decide about a run at the bench. A run is done by itself when all its repetitions are
    recorded and accepted."""
    ticked = tick_run(store, name, run, status=tick_request.status, note=tick_request.note)
    return {
        "run": ticked.run,
        "status": ticked.status,
        "reason": ticked.reason,
        "recorded": len(ticked.accepted),
        "rejected": list(ticked.rejected),
    }
