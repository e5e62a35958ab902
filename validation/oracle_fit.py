"""What the right effects would have done: the twin's laws of them, fitted on the same kind of
folds."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..array_types import Floats
from ..diagnosis.gap import GapMetric, GapTable
from ..diagnosis.gap_reduction import measure_reduction
from ..diagnosis.inference.held_out import fit_fold
from ..diagnosis.inference.model_search import search
from ..diagnosis.inference.problem import InferenceProblem
from ..diagnosis.observables.base import Stage
from ..diagnosis.options import Options
from ..parallel.task import one_thread
from ..training.evaluation.summary import fraction
from ..twin.effects import Effect, catalogue, effect_from_json
from .case_plan import CaseTask, case_of_task
from .cases.case import Case
from .cases.record import record_case
from .run_case import gap_of_folder

#: Of the same bench without scatter, in tolerances: what its gap truly is.
_QUIET = 0.02


@dataclass(frozen=True)
class OpenedTask:
    """A task whose label was opened, with the effects that the first answer named, as it fitted
    them."""

    task: CaseTask
    options: Options
    fitted: tuple[dict[str, Any], ...]


def oracle(task: OpenedTask) -> dict[str, Any]:
    """`fraction` of the right effect, held out by configuration; `true_fraction` that the answer's
    effects remove.

    The latter is measured against a recording of the same bench with next to no scatter; None for
    an answer without effects. {"error": ...} where there is none.
    """
    case, seed = case_of_task(task.task)
    try:
        with one_thread():
            stages, gap = _staged(case, seed, task.options)
            # On a bench with many effects the right ones are not fitted: that is the diagnosis's
            # own task.
            best = (
                _best(case, stages, gap, task.options)
                if len(case.strengths) == 1
                else {"fraction": None}
            )
            fit = {"case": task.task.name, **best}
            return fit | {"true_fraction": _true(case, seed, gap, task) if task.fitted else None}
    except Exception as error:  # noqa: BLE001
        # An oracle that fails must not take the answers with it.
        return {"case": task.task.name, "error": f"{type(error).__name__}: {error}"}


def oracle_without_answer(task: OpenedTask) -> dict[str, Any]:
    return {"case": task.task.name, "error": "its process died, or took too long"}


def _staged(case: Case, seed: int, options: Options) -> tuple[tuple[Stage, ...], GapTable]:
    with tempfile.TemporaryDirectory(prefix="pyroshock-blind-") as place:
        record_case(case, Path(place) / "campaign", seed)
        return gap_of_folder(Path(place) / "campaign", options)


def _best(case: Case, stages: Sequence[Stage], gap: GapTable, options: Options) -> dict[str, Any]:
    problem = InferenceProblem.of(
        gap, stages, [catalogue()[name] for name in sorted(case.strengths)]
    )
    library = search(problem)
    together = [fit for fit in library.fits.values() if set(fit.effects) == set(problem.effects)]
    right = max(together, key=library.log_joint)
    scales, rng = GapMetric.of(gap).scales(gap), np.random.default_rng(options.seed)
    entries = measure_reduction(
        stages, lambda rows: fit_fold(library, rows, only=[right]), rng, scales, pulses=False
    )
    held = next(asdict(entry) for entry, _ in entries if entry.held_out_by == "configuration")
    return {"fraction": held["fraction"], "before": held["before"], "after": held["after"]}


def _true(case: Case, seed: int, gap: GapTable, task: OpenedTask) -> float | None:
    """With the scatter's part added to both sides, as the report has it."""
    stages, quiet = _staged(replace(case, floor=_QUIET), seed, task.options)
    metric = GapMetric.of(quiet)
    effects = [effect_from_json(effect) for effect in task.fitted]
    change = np.concatenate([_change(stage, effects) for stage in stages], axis=1)
    before, after = metric.rms(quiet.mean), metric.rms(quiet.mean - change)
    floor = metric.rms(np.sqrt(gap.floor_variance))
    squares = (np.array(rms**2) for rms in (np.hypot(before, floor), np.hypot(after, floor), floor))
    value = float(fraction(*squares))
    return value if np.isfinite(value) else None


def _change(stage: Stage, effects: Sequence[Effect]) -> Floats:
    shown = [effect for effect in effects if effect.id in stage.shows]
    return np.asarray(np.nan_to_num(stage.changes([shown])[0]))
