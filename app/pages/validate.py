"""Validations of the twin: ask for one, those that were made, and the page of each with its
charts."""

from __future__ import annotations

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ...schema.conditions import list_campaign_names
from ..jobs.queue import list_jobs
from ..operations.form import controls
from ..operations.validate.figures import (
    comparison_figures,
    coverage_figure,
    line_figures,
    rank_figure,
)
from ..operations.validate.report import validation_document
from ..operations.validate.validating import VALIDATE
from ..operations.validate.validation import (
    COLUMNS,
    adopted_lines,
    adopted_rows,
    reason_lines,
    score_rows,
)
from ..operations.validate.verdict import (
    failure_rows,
    failure_sentences,
    is_calibrated,
    needed_values,
    verdict_text,
)
from ..twins.contact_names import list_contact_names
from ..web.dependencies import Key, OpenStore, Running
from ..web.jobs import finished_result
from ..web.rendering import page
from .report import Ending, report_file

router = APIRouter()


@router.get("/validations")
def validations(request: Request, store: OpenStore) -> Response:
    """The form, with the values of the address in its fields, and the validations that were
    made."""
    with store.reading() as session:
        names = list_campaign_names(session)
        contacts = list_contact_names(session)
    made = [job for job in list_jobs(store) if job.kind == VALIDATE.name]
    values = dict(request.query_params)
    further = set(VALIDATE.request.model_fields) - {"campaign"}
    return page(
        request,
        "validations.html",
        campaigns=names,
        campaign=values.get("campaign", ""),
        controls=controls(VALIDATE, values, names=further, choices={"contact": ["", *contacts]}),
        jobs=made,
    )


@router.get("/validations/{job}")
def validation(request: Request, job: Key, running: Running) -> Response:
    data = finished_result(running, job, VALIDATE.name, "validation")
    return page(
        request,
        "validation.html",
        job=job,
        validation=data | {"verdict": verdict_text(data), "calibrated": is_calibrated(data)},
        columns=COLUMNS,
        rows=list(score_rows(data)),
        adopted=adopted_lines(data),
        adopted_table=adopted_rows(data),
        failures=failure_sentences(data),
        failure_table=failure_rows(data),
        needed=needed_values(len(data["quantities"])),
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
