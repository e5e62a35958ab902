"""A validation of the twin on a campaign of the store, as a job."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from ....schema.listings import get_campaign_id
from ....schema.session import Store
from ...jobs.job_kinds.validate import VALIDATE, ValidateArguments
from ...jobs.queue import JobView
from ...web.dependencies import OpenStore, Running, Word
from ...web.jobs import Jobs


class ValidationQuestion(BaseModel):
    """As the options of `pyroshock validate`."""

    campaign: Word
    contact: Word | None = None
    folds: Annotated[int, Field(ge=2, le=1000)] = 5
    draws: Annotated[int, Field(ge=20, le=2000)] = 64
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0


def validate_job(jobs: Jobs, store: Store, question: ValidationQuestion) -> JobView:
    """Queue a validation; its result is `validate --json`. Raises `LookupError` for a campaign
    there is none of."""
    with store.reading() as session:
        get_campaign_id(session, question.campaign)
    arguments = ValidateArguments(**question.model_dump())
    return jobs.ask(store, VALIDATE, f"Validation of the twin on {question.campaign}", arguments)


router = APIRouter(tags=["twin"])


@router.post("/validate")
def validate(question: ValidationQuestion, store: OpenStore, running: Running) -> dict[str, Any]:
    """Validate the twin on a campaign; answers with the job, whose result is `pyroshock validate
    --json`."""
    return validate_job(running, store, question).as_json()
