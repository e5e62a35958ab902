"""From a prescribed spectrum to settings, as a job."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from ....schema.session import Store
from ...jobs.job_kinds.tune import TUNE, TuneArguments
from ...jobs.queue import JobView
from ...web.dependencies import OpenStore, Running, Word
from ...web.jobs import Jobs


class Tuning(BaseModel):
    """As the options of `pyroshock tune`: `target` is the text of its CSV, `factors` the text of a
    factors file."""

    target: str = Field(max_length=260_000)
    tolerance: Word = ""
    measured: Annotated[list[Word], Field(max_length=20)] = []
    campaign: Word | None = None
    plate: Word | None = None
    contact: Word | None = None
    sensor: Word | None = None
    factors: Annotated[str, Field(max_length=200_000)] = ""
    share: Annotated[float, Field(gt=0, le=1)] = 1.0
    q: Annotated[float, Field(gt=0.5, le=1000)] = 10.0
    extrapolate: bool = False
    adopted: bool = True
    at_least: Annotated[float, Field(gt=0, le=1)] = 0.5
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0


def tune_job(jobs: Jobs, store: Store, question: Tuning) -> JobView:
    """Queue a tuning; its result: proposals as of `tune --json`, whether the target is met, what to
    avoid, and notes.

    Raises `ValueError` for a target or factors that cannot be read.
    """
    arguments = TuneArguments(**question.model_dump())
    arguments.ask()
    return jobs.ask(store, TUNE, "Tuning to a spectrum", arguments)


router = APIRouter(tags=["twin"])


@router.post("/tune")
def tune(question: Tuning, store: OpenStore, running: Running) -> dict[str, Any]:
    """Settings of the bench for a spectrum; answers with the job, whose result is `tune --json`."""
    return tune_job(running, store, question).as_json()
