"""A plan deleted from the store, as long as nothing was recorded for it."""

from __future__ import annotations

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign, Plan, PlannedRun, plan_turn
from ..schema.impacts import Impact, Shot
from ..schema.run_predictions import RunPrediction
from ..schema.session import Store
from ..schema.transactions import take_advisory_lock
from .plans import read_plan


class PlanInUseError(ValueError):
    """Something was recorded for the plan; the message says in which campaigns, and what to do."""


def check_plan_unused(session: Session, name: str) -> None:
    """Raises `UnknownPlanError`, and `PlanInUseError` for a plan that a campaign has recorded
    repetitions of."""
    recorded = sum(len(run.accepted) + len(run.rejected) for run in read_plan(session, name).runs)
    campaigns = _campaigns(session, name)
    if campaigns:
        raise PlanInUseError(
            f"plan {name!r} cannot be deleted: {recorded} repetitions of it are recorded in "
            f"campaign {', '.join(campaigns)}; to take a single run out of the plan: pyroshock "
            f"plan discard {name} RUN --reason TEXT"
        )


def delete_plan(store: Store, name: str) -> int:
    """Delete plan `name` with its runs and what was predicted of them, and return how many runs
    there were. Raises as `check_plan_unused`."""

    def work(session: Session) -> int:
        take_advisory_lock(session, plan_turn(name))
        check_plan_unused(session, name)
        plan = select(Plan.id).where(Plan.name == name).scalar_subquery()
        count = session.scalar(select(func.count()).where(PlannedRun.plan_id == plan)) or 0
        runs = select(PlannedRun.id).where(PlannedRun.plan_id == plan)
        session.execute(delete(RunPrediction).where(RunPrediction.planned_run_id.in_(runs)))
        session.execute(delete(PlannedRun).where(PlannedRun.plan_id == plan))
        session.execute(delete(Plan).where(Plan.name == name))
        return count

    return store.write(work)


def _campaigns(session: Session, name: str) -> list[str]:
    """Campaigns with impacts or shots of the plan."""
    names: set[str] = set()
    for table in (Impact, Shot):
        query = select(Campaign.name).join(table, table.campaign_id == Campaign.id)
        query = query.join(PlannedRun, table.planned_run_id == PlannedRun.id).join(
            Plan, PlannedRun.plan_id == Plan.id
        )
        names.update(session.scalars(query.where(Plan.name == name).distinct()))
    return sorted(names)
