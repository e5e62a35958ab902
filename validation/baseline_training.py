"""Campaigns that the random forest learns from: other seeds, and other effects outside the catalogue."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..diagnosis.options import Options
from ..parallel.executor import Crew
from ..parallel.map_tasks import mapped
from .case_plan import CaseTask, drawn
from .cases.record import record_case
from .random_forest_baseline import Forest

#: Kept apart from the seeds of cases.
_SEED, _SPLIT = 20_000_003, "development"
_PATIENCE_S = 300.0
_TIERS = ("weak", "middle", "strong", "very strong", "two")


def trained(count: int, seed: int, crew: Crew, tell: Callable[[int, int, str], None]) -> Forest | None:
    """A forest of `count` campaigns. None without scikit-learn."""
    try:
        import sklearn  # noqa: F401
    except ModuleNotFoundError:
        return None
    tasks = [CaseTask(f"learn-{i:05d}", _TIERS[i % len(_TIERS)], (_SEED + seed, i), _SPLIT) for i in range(count)]
    learnt: dict[str, dict[str, Any]] = {}
    for task, row in mapped(crew, _learnt, tasks, lost=_lost, patience_s=_PATIENCE_S):
        learnt[task.name] = row
        tell(len(learnt), count, "campaigns to learn from")
    rows = [learnt[task.name] for task in tasks if learnt[task.name]]  # in their order: so are the forest's draws
    return of_rows(rows, seed) if rows else None


def of_rows(rows: Sequence[dict[str, Any]], seed: int) -> Forest:
    x = [np.array(row["features"]) for row in rows]
    return Forest.trained([row["kind"] for row in rows], x, [row["truth"] for row in rows], seed)


def _learnt(task: CaseTask) -> dict[str, Any]:
    """Features and truth of one campaign; {} where it could not be read."""
    from threadpoolctl import threadpool_limits

    from ..diagnosis.chain import stages_of
    from ..diagnosis.gap import GapTable
    from ..diagnosis.reading import read_folder
    from .problem import GapProblem
    from .run_case import featured

    case, seed = drawn(task)
    with threadpool_limits(1), tempfile.TemporaryDirectory(prefix="pyroshock-blind-") as place:
        record_case(case, Path(place) / "campaign", seed)
        try:
            record = read_folder(Path(place) / "campaign")
            gap = GapTable.of(record, stages_of(record, Options())[0])
        except ValueError:
            return {}
    return {"kind": case.kind, "truth": "+".join(case.cause), "features": featured(GapProblem.of(gap))}


def _lost(_: CaseTask) -> dict[str, Any]:
    return {}
