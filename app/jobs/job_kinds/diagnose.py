"""A diagnosis of a campaign of the store: kept in the transaction that ends the job, for it has no
natural key."""

from __future__ import annotations

from ...operations.diagnose.request import DiagnoseArguments, DiagnosisRequest
from ..kind import Ending, JobForm, Kind, Result, RunningJob


def _do(work: RunningJob, arguments: DiagnoseArguments) -> Ending:
    from ...common.model_registry import models_extra
    from ...operations.diagnose.diagnosing import is_stored, keep, report_json, run_diagnosis
    from ...operations.diagnose.summary import summary

    if not is_stored(work.store, arguments.target):  # a folder's path is nobody's to name from afar
        raise LookupError(f"no campaign {arguments.target!r} in the store; ingest it first")
    with models_extra():
        question = DiagnosisRequest(**vars(arguments))
        verdict = run_diagnosis(work.store, work.db, question, work.step)

    def ending() -> Result:
        key = keep(work.store, verdict, question)
        return Result(
            f"/diagnoses/{key}",
            f"{verdict.campaign}: {summary(verdict)}",
            {"id": key, **report_json(verdict)},
        )

    return ending


def _form(arguments: DiagnoseArguments) -> JobForm:
    from urllib.parse import urlencode

    from ...operations.diagnose.form import fields_of

    return JobForm(f"/diagnoses?{urlencode(fields_of(vars(arguments)))}#diagnose")


DIAGNOSE = Kind("diagnose", DiagnoseArguments, _do, form=_form)
