"""Validations of the twin: ask for one, those that were made, and the page of each."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Form
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import Response

from ....schema.campaigns import Campaign
from ....schema.jobs import DONE
from ...jobs.kinds.validate import VALIDATE
from ...reports.page import html_of
from ...reports.validation import validation_document
from ...validating.tables import COLUMNS, failure_lines, reason_lines, score_rows
from ..dependencies import Key, OpenStore, Running
from ..figures.validation import comparison_figures, coverage_figure, line_figures, rank_figure
from ..rendering import page
from ..validating import ValidationQuestion, validate_job
from .jobs import followed

router = APIRouter()


@router.get("/validations")
def validations(request: Request, store: OpenStore, running: Running, campaign: str = "") -> Response:
    with store.reading() as session:
        names = list(session.scalars(select(Campaign.name).order_by(Campaign.date.desc(), Campaign.name).limit(500)))
    made = [job for job in running.listed() if job.kind == VALIDATE.name]
    return page(request, "validations.html", campaigns=names, campaign=campaign, jobs=made)


@router.post("/validations")
def validate(
    store: OpenStore,
    running: Running,
    campaign: Annotated[str, Form(max_length=200)],
    contact: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    question = ValidationQuestion(campaign=campaign, contact=contact.strip() or None)
    return followed(validate_job(running, store, question))


@router.get("/validations/{job}")
def validation(request: Request, job: Key, running: Running) -> Response:
    data = _result(running, job)
    return page(
        request,
        "validation.html",
        job=job,
        validation=data,
        columns=COLUMNS,
        rows=list(score_rows(data)),
        failures=failure_lines(data),
        left_out=reason_lines(data["left_out"]),
        coverage=coverage_figure(data),
        ranks=rank_figure(data),
        comparisons=comparison_figures(data),
        lines=line_figures(data),
    )


@router.get("/validations/{job}/report.html")
def report(job: Key, running: Running) -> Response:
    return Response(html_of(validation_document(_result(running, job))), media_type="text/html")


def _result(running: Running, job: int) -> dict[str, Any]:
    done = running.get(job)
    if done.state != DONE or done.kind != VALIDATE.name:
        raise LookupError(f"job {job} is no finished validation; its page is /jobs/{job}")
    data: dict[str, Any] = done.result
    return data
