"""A diagnosis of a campaign of the store: kept in the transaction that ends the job, for it has no natural key."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..jobs.kind import Ending, Kind, Result, RunningJob


@dataclass(frozen=True)
class DiagnoseArguments:
    """What a user asks of a diagnosis, of what any worker can read. `tolerances` by stage, in the unit of its levels:
    shares for gun and contact, dB for the plate; `uncertain` are standard deviations of nominal numbers,
    "gun.friction_coefficient", in SI; `with_effects`: ids of the effects that alone are considered (none: all),
    `without_effects`: of those that are not."""

    target: str
    simulator: str | None = None
    tolerances: Mapping[str, float] = field(default_factory=dict)
    uncertain: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    with_effects: Sequence[str] = ()
    without_effects: Sequence[str] = ()


def _do(work: RunningJob, arguments: DiagnoseArguments) -> Ending:
    from ..common.model_registry import models_extra
    from .diagnosing import is_stored, keep, report_json, run_diagnosis
    from .request import DiagnosisRequest
    from .summary import summary

    if not is_stored(work.store, arguments.target):  # a folder's path is nobody's to name from afar
        raise LookupError(f"no campaign {arguments.target!r} in the store; ingest it first")
    with models_extra():
        question = DiagnosisRequest(**vars(arguments))
        verdict = run_diagnosis(work.store, work.db, question, work.step)

    def ending() -> Result:
        key = keep(work.store, verdict, question)
        return Result(
            f"/diagnoses/{key}", f"{verdict.campaign}: {summary(verdict)}", {"id": key, **report_json(verdict)}
        )

    return ending


DIAGNOSE = Kind("diagnose", DiagnoseArguments, _do)
