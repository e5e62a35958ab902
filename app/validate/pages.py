"""Validations of the twin: ask for one, those that were made, and the page of each with its
charts."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Form
from starlette.requests import Request
from starlette.responses import Response

from ...schema.conditions import list_campaign_names
from ..common.model_registry import models_extra
from ..report.pages import Ending, report_file
from ..twins.building import check_contact
from ..web.dependencies import Configured, Key, OpenStore, Running, Word
from ..web.forms import FieldError
from ..web.jobs_pages import finished_result, followed
from ..web.rendering import page
from .api import ValidationQuestion, validate_job
from .figures import comparison_figures, coverage_figure, line_figures, rank_figure
from .job import VALIDATE
from .report import validation_document
from .validation import (
    COLUMNS,
    adopted_lines,
    failure_lines,
    reason_lines,
    score_rows,
)

router = APIRouter()


@router.get("/validations")
def validations(
    request: Request, store: OpenStore, running: Running, campaign: str = "", contact: Word = ""
) -> Response:
    """`campaign` and `contact` are in the form from the start."""
    with store.reading() as session:
        names = list_campaign_names(session)
    made = [job for job in running.listed() if job.kind == VALIDATE.name]
    return page(
        request, "validations.html", campaigns=names, campaign=campaign, contact=contact, jobs=made
    )


@router.post("/validations")
def validate(
    store: OpenStore,
    running: Running,
    settings: Configured,
    campaign: Annotated[str, Form(max_length=200)],
    contact: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    if contact.strip():
        try:
            with models_extra():
                check_contact(settings.db, contact.strip())
        except LookupError as error:
            raise FieldError("contact", str(error)) from error
    question = ValidationQuestion(campaign=campaign, contact=contact.strip() or None)
    try:
        job = validate_job(running, store, question)
    except LookupError as error:
        error.field = "campaign"  # type: ignore[attr-defined]  # `field_of` reads it
        raise
    return followed(job)


@router.get("/validations/{job}")
def validation(request: Request, job: Key, running: Running) -> Response:
    data = finished_result(running, job, VALIDATE.name, "validation")
    return page(
        request,
        "validation.html",
        job=job,
        validation=data,
        columns=COLUMNS,
        rows=list(score_rows(data)),
        adopted=adopted_lines(data),
        failures=failure_lines(data),
        left_out=reason_lines(data["left_out"]),
        coverage=coverage_figure(data),
        ranks=rank_figure(data),
        comparisons=comparison_figures(data),
        lines=line_figures(data),
    )


@router.get("/validations/{job}/report.{ending}")
def report(job: Key, ending: Ending, running: Running) -> Response:
    data = finished_result(running, job, VALIDATE.name, "validation")
    return report_file(validation_document(data), f"validation-{data['campaign']}", ending)
