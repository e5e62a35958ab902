"""A stored plan as the rows that the virtual bench plays."""

from __future__ import annotations

from ...doe.plans import read_plan
from ...schema.session import Store


def rows_of(store: Store, name: str) -> tuple[str, list[dict[str, str]], int]:
    """Kind, rows with run number, treatment and settings in order of run, and repetitions of a plan's open runs.

    Discarded runs are left out. Raises `UnknownPlanError`, and `ValueError` where nothing is left to play.
    """
    with store.reading() as session:
        plan = read_plan(session, name)
    runs = [run for run in plan.runs if run.status != "discarded"]
    if not runs:
        raise ValueError(f"plan {name!r} has no run that is not discarded")
    rows = [
        {"run": str(run.run), **run.row, **{key: repr(value) for key, value in run.settings.items()}} for run in runs
    ]
    return plan.space.kind, rows, max(run.repetitions for run in runs)
