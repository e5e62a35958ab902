"""A plan as other programs read it: JSON in SI, and a CSV table."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...files.atomic_write import atomic_file
from ...files.delimited_text import parse_number
from ...files.spreadsheet_guard import GuardedCsv
from ...schema.known_factors import BY_COLUMN

if TYPE_CHECKING:
    from ...doe.plans import StoredPlan, StoredRun


def plan_as_json(plan: StoredPlan) -> dict[str, Any]:
    """A plan as the command line prints it: SI numbers, the unit in the key."""
    return {
        "name": plan.name,
        "kind": plan.space.kind,
        "method": plan.method,
        "seed": plan.seed,
        "runs": [
            {
                "run": run.run,
                "position": run.position,
                "status": run.status,
                "repetitions": run.repetitions,
                "recorded": len(run.accepted),
                "rejected": list(run.rejected),
                **settings_in_si(cells_of(run)),
                **({"reason": run.reason} if run.reason else {}),
            }
            for run in plan.runs
        ],
    }


def cells_of(run: StoredRun) -> dict[str, str]:
    """Factors and settings of a run by column, as a table of runs writes them."""
    return {**run.row, **{column: repr(value) for column, value in run.settings.items()}}


def run_counts(plan: StoredPlan) -> dict[str, int]:
    """Runs by state, and of those that are planned the ones that are "begun", and that ask for a
    "repeat"."""
    from ...schema.campaigns import STATUSES

    counts = {status: sum(run.status == status for run in plan.runs) for status in STATUSES}
    begun = sum(run.status == "planned" and bool(run.accepted) for run in plan.runs)
    return {**counts, "begun": begun, "repeat": sum(run.repeats > 0 for run in plan.runs)}


def settings_in_si(row: Mapping[str, str]) -> dict[str, Any]:
    """Column to cell: numbers that recordings know in SI with the unit in the key, all else as the
    table has it."""
    cells: dict[str, Any] = {}
    for column, text in row.items():
        factor = BY_COLUMN.get(column)
        if factor is not None and factor.si_unit is not None:
            cells[f"{factor.name}_{factor.si_unit.lower()}"] = float(
                f"{parse_number(text) * factor.scale:.12g}"
            )
        else:
            cells[column] = text
    return cells


def write_table(plan: StoredPlan, path: Path) -> None:
    """The plan's table as CSV: `run` and the factors' columns, in order of run, without what was
    discarded."""
    with atomic_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = GuardedCsv(file)
        writer.write_row(["run", *plan.space.columns])
        for run in plan.runs:
            if run.status != "discarded":
                writer.write_row([run.run, *(run.row[column] for column in plan.space.columns)])
