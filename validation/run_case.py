"""One case: recorded into a folder that is gone afterwards, and answered from that folder alone.

The most memory that a piece of work took.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..diagnosis.options import Options
from ..parallel.task import one_thread
from ..twin.effects import catalogue
from .case_plan import BENCHES, LEFT_OUT, CaseTask, case_of_task
from .cases.record import record_case

if TYPE_CHECKING:
    from ..diagnosis.gap import GapTable
    from ..diagnosis.observables.base import Stage
    from .baselines import GapProblem


_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class PeakMemory:
    """Counts from its making on, where the operating system lets a process forget its peak (Linux);
    otherwise from the start of the process."""

    def __init__(self) -> None:
        try:
            _RESET.write_text("5", encoding="ascii")
        except (
            OSError
        ):  # another system, or not allowed: then the peak is that of the whole process
            return

    def used_mb(self) -> float:
        """Resident memory in MB at its highest."""
        try:
            rows = dict(
                line.split(":", 1)
                for line in _STATUS.read_text(encoding="ascii").splitlines()
                if ":" in line
            )
            return float(rows["VmHWM"].split()[0]) / 1000
        except (OSError, KeyError):
            return _of_process_mb()


def _of_process_mb() -> float:
    import sys

    if sys.platform == "win32":
        return float("nan")
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)


#: What of a report is scored; sets are not in every one.
KEPT = ("gap", "where", "causes", "shrinkage", "effects", "sets", "unexplained", "path")
#: A case that takes longer has no answer.
PATIENCE_S = 900.0


@dataclass(frozen=True)
class CaseJob:
    """A task, and how it is answered: with the options of the diagnosis, and with the simple ways
    or without."""

    task: CaseTask
    options: Options
    simple: bool = True


def answer_case(job: CaseJob) -> dict[str, Any]:
    """A line of the journal. An error of the diagnosis is an answer, too: {"case", "error"}."""
    case, seed = case_of_task(job.task)
    with one_thread(), tempfile.TemporaryDirectory(prefix="pyroshock-blind-") as place:
        folder = Path(place) / "campaign"
        record_case(case, folder, seed)
        # From here on nothing but the folder is known. The names of effects that are left out are
        # the exception.
        left_out = next(iter(case.strengths)) if job.task.tier == LEFT_OUT else None
        answer = _from_folder(folder, job, left_out)
    return {"case": job.task.name, **answer}


def answer_of_lost_worker(job: CaseJob) -> dict[str, Any]:
    """What stands for a case whose process died, or never ended."""
    return {"case": job.task.name, "error": "its process died, or took too long", "seconds": None}


def _from_folder(folder: Path, job: CaseJob, left_out: str | None) -> dict[str, Any]:
    try:
        if left_out is None:
            simple = _simply(folder, job.options) if job.simple else {}
            naive = (
                {"naive": _naive(folder, job.options)}
                if job.task.tier in BENCHES and job.options.shrink
                else {}
            )
            return {**diagnosed(folder, job.options), **simple, **naive}
        catalogue_names = tuple(
            name for name in job.options.catalogue or tuple(catalogue()) if name != left_out
        )
        without = diagnosed(folder, replace(job.options, catalogue=catalogue_names, shrink=False))
        return {**without, "added": diagnosed(folder, job.options)}
    except Exception as error:  # noqa: BLE001
        # Whatever went wrong, the case was not answered, and is counted.
        return {"error": f"{type(error).__name__}: {error}", "seconds": None}


def diagnosed(folder: Path, options: Options) -> dict[str, Any]:
    """What is said of a folder: the report, the first answer's effects as they were fitted, and the
    time it took."""
    from ..diagnosis.diagnose import diagnose
    from ..diagnosis.reading import read_folder
    from ..diagnosis.verdict import plain

    memory = PeakMemory()
    began, used = time.perf_counter(), time.process_time()
    verdict = diagnose(read_folder(folder), options=options)
    seconds, cpu = time.perf_counter() - began, time.process_time() - used
    report = verdict.as_json()
    kept = {key: report[key] for key in KEPT if key in report}
    fitted = [effect.as_json() for effect in verdict.first.fitted]
    cost = {"seconds": seconds, "cpu_s": cpu, "memory_mb": memory.used_mb()}
    text = json.dumps(
        {
            "verdict": kept,
            "fitted": fitted,
            "unknown_figures": plain(verdict.unknown_figures),
            **cost,
        }
    )
    # JSON knows no NaN
    return json.loads(text, parse_constant=lambda _: None)  # type: ignore[no-any-return]


def gap_of_folder(folder: Path, options: Options) -> tuple[tuple[Stage, ...], GapTable]:
    """The stages of a recorded campaign, and its gap. Raises `ValueError` for a folder that cannot
    be read."""
    from ..diagnosis.chain import stages_of
    from ..diagnosis.gap import GapTable
    from ..diagnosis.reading import read_folder

    record = read_folder(folder)
    stages, _ = stages_of(record, options)
    return stages, GapTable.of(record, stages, options.tolerance_scale)


def _simply(folder: Path, options: Options) -> dict[str, Any]:
    """The same folder by the simple ways; `features` for the forest, which learns later."""
    from ..diagnosis.inference.problem import InferenceProblem
    from .baselines import BASELINES, GapProblem

    stages, gap = gap_of_folder(folder, options)
    problem = GapProblem.of(gap, InferenceProblem.of(gap, stages, list(catalogue().values())))
    simple = {name: _short(answer(problem)) for name, answer in BASELINES.items()}
    return {"simple": simple, "features": featured(problem)}


def _naive(folder: Path, options: Options) -> dict[str, Any]:
    """The gap that all effects together take away, by a fit without selection; {"error"} where it
    fails."""
    from .joint_ridge import joint_ridge

    try:
        return joint_ridge(*gap_of_folder(folder, options))
    except Exception as error:  # noqa: BLE001
        # A baseline that fails must not take the answer with it.
        return {"error": f"{type(error).__name__}: {error}"}


def featured(problem: GapProblem) -> list[float]:
    """What the forest sees of a campaign."""
    from .baselines import features

    return [round(float(value), 3) for value in features(problem)]


def _short(probabilities: Mapping[str, float]) -> dict[str, float]:
    return {name: float(f"{p:.6g}") for name, p in probabilities.items() if p > 1e-9}
