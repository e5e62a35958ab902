"""Predictions of planned runs were made before the shots that they are about."""

from __future__ import annotations

from collections.abc import Iterator

from sqlalchemy import Connection, select
from sqlalchemy.orm import Session

from ...campaigns import Plan, PlannedRun
from ...run_predictions import LONG_AGO, RunPrediction, first_hits, late_predictions
from ..findings import IntegrityFinding, Scope

_ADVICE = (
    "nothing is to be done: it does not count, and no page shows it beside the shot. The time of a "
    "row is covered by its hash; a row that was altered has a finding of its own"
)


def check_predictions(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Predictions that were stored when the first shot of their run was stored already."""
    with Session(connection) as session:
        runs = set(session.scalars(select(RunPrediction.planned_run_id).distinct()))
        late = late_predictions(session, runs)
        if not late:
            return
        times = first_hits(session, {row.planned_run_id for row in late})
        query = select(PlannedRun.id, Plan.name, PlannedRun.run).join(
            Plan, PlannedRun.plan_id == Plan.id
        )
        places = {
            key: {"plan": plan, "run": run}
            for key, plan, run in session.execute(query.where(PlannedRun.id.in_(times)))
        }
        for row in late:
            first_hit = times[row.planned_run_id]
            shot = "at an unknown time" if first_hit == LONG_AGO else f"at {first_hit.isoformat()}"
            yield IntegrityFinding(
                "predictions",
                f"the prediction was made at {row.made_at.isoformat()}, and the first shot of its "
                f"run was stored {shot}: it was not made before the shot",
                _ADVICE,
                {"table": "run_predictions", "row": row.id, **places[row.planned_run_id]},
            )
