"""Plans: make one, judge it, tick its runs."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from ....doe.designs.methods import METHODS
from ....doe.plans import list_plans, read_plan, tick_run
from ...jobs.kinds.plan import PlanArguments
from ...plans.quality import plan_page
from ...plans.tables import plan_as_json
from ..dependencies import Key, Name, OpenStore, Running, Text
from ..making import MOST_RUNS, plan_job

router = APIRouter(tags=["plans"])


class NewPlan(BaseModel):
    """`factors`: text of a factors file in TOML; `table`: text of a CSV to import. Empty: the shipped ones.

    `options` are those of the method, such as {"criterion": "maximin"} of "lhs".
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


class Tick(BaseModel):
    """`note`: why; a discarded run needs one, and one that is planned again though it was recorded."""

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
def tick(name: Name, run: Key, asked: Tick, store: OpenStore) -> dict[str, Any]:
    """Mark a run at the bench."""
    ticked = tick_run(store, name, run, status=asked.status, note=asked.note)
    return {"run": ticked.run, "status": ticked.status, "reason": ticked.reason, "recorded": ticked.recorded}
