"""Plans: make one as a job, judge it, tick its runs."""

from __future__ import annotations

from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from ....doe.plans import list_plans, read_plan, tick_run
from ...common.plan_tables import plan_as_json
from ...operations.plan.quality import plan_page
from ...web.dependencies import Key, Name, OpenStore, Text

router = APIRouter(tags=["plans"])


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
