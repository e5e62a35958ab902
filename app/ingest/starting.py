"""A new campaign folder from a plan of the store, or from recordings that are there already."""

from __future__ import annotations

from pathlib import Path

from ...doe.plans import read_plan
from ...ingest.new_folder import KIND_OF_START, NewFolder, start_folder
from ...schema.session import Store


def start_campaign(
    store: Store | None, folder: Path, start: str, plan: str | None, recordings: str | None
) -> NewFolder:
    """Write campaign.toml and runs.csv into `folder`. Without a plan no `store` is needed.

    Raises `UnknownPlanError`, `IngestError`, `OSError`, and `ValueError` for a plan of another kind.
    """
    rows = planned_rows(store, plan, start) if store is not None and plan is not None else []
    new = start_folder(folder, start, recordings, rows)
    new.write(folder)
    return new


def planned_rows(store: Store, name: str, start: str) -> list[dict[str, str]]:
    """A row of runs.csv for each repetition of the plan's open runs, in their order, with factors and settings.

    Raises `UnknownPlanError`, and `ValueError` for a plan of another kind or without an open run.
    """
    with store.reading() as session:
        plan = read_plan(session, name)
    if plan.space.kind != KIND_OF_START[start]:
        raise ValueError(f"plan {name!r} is one of a {plan.space.kind}, and --kind is {start!r}")
    rows = [
        {
            "run": str(run.run),
            "repetition": str(repetition),
            **run.row,
            **{column: repr(value) for column, value in run.settings.items()},
        }
        for run in plan.runs
        if run.status == "planned"
        for repetition in range(1, run.repetitions + 1)
    ]
    if not rows:
        raise ValueError(f"plan {name!r} has no run that is still to do")
    return rows
