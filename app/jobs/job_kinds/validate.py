"""A validation of the twin on a campaign: nothing is stored but the scores, from which the job's
page is drawn."""

from __future__ import annotations

from dataclasses import dataclass

from ..kind import Ending, JobForm, Kind, Result, RunningJob, ending_of


@dataclass(frozen=True)
class ValidateArguments:
    """As the options of `pyroshock validate`."""

    campaign: str
    contact: str | None = None
    folds: int = 5
    draws: int = 64
    seed: int = 0


def _do(work: RunningJob, arguments: ValidateArguments) -> Ending:
    from ...common.model_registry import models_extra
    from ...operations.validate.validation import ValidationRequest, run_validation

    with models_extra():
        validation = run_validation(
            work.store, work.db, ValidationRequest(**vars(arguments)), work.step
        )
    data = validation.as_json()
    return ending_of(
        Result(f"/validations/{work.job}", f"{arguments.campaign}: {data['verdict']}", data)
    )


def _form(arguments: ValidateArguments) -> JobForm:
    return JobForm(
        "/validations",
        "validate",
        {"campaign": arguments.campaign, "contact": arguments.contact or ""},
    )


VALIDATE = Kind("validate", ValidateArguments, _do, form=_form)
