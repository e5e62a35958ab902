"""Diagnoses: what is kept, run one, its page, the plan and the twin that come of it."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Form, Query
from pydantic import Field
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.conditions import list_campaign_names
from ...schema.diagnoses import Diagnosis
from ..doors.api.diagnose import diagnose_job
from ..operations.diagnose.discriminating_plan import plan_name, store_experiment_of
from ..operations.diagnose.form import (
    FIELDS,
    STAGES,
    UnknownValueError,
    arguments_of,
    check_simulator,
)
from ..operations.diagnose.page_parts import DiagnosisParts, list_row, parts_of
from ..operations.diagnose.request import DiagnoseArguments
from ..operations.diagnose.stored import (
    kept_options,
    kept_report,
    kept_summary,
    kept_verdict,
    list_diagnoses,
)
from ..operations.faults import FieldError
from ..twins.adopted_effects import adopt
from ..web.dependencies import Configured, Key, OpenStore, Running, Text
from ..web.jobs import followed
from ..web.rendering import page, part, query

router = APIRouter()
EffectId = Annotated[Text, Field(max_length=200)]
PAGE = 25


@router.get("/diagnoses")
def diagnoses(
    request: Request,
    store: OpenStore,
    campaign: str = "",
    after: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
) -> Response:
    with store.reading() as session:
        campaigns = list_campaign_names(session)
        unknown = bool(campaign) and campaign not in campaigns
        listed = [] if unknown else list_diagnoses(session, campaign or None, PAGE + 1, after)
        rows = [list_row(row, kept_summary(session, row["id"])) for row in listed[:PAGE]]
    following = query({"campaign": campaign, "after": rows[-1]["id"]}) if len(listed) > PAGE else ""
    return page(
        request,
        "diagnoses.html",
        404 if unknown else 200,
        rows=rows,
        campaigns=campaigns,
        campaign=campaign,
        unknown=unknown,
        stages=STAGES,
        given={name: request.query_params.get(name, "") for name in FIELDS},
        following=following,
        beginning=query({"campaign": campaign}) or "/diagnoses" if after else "",
    )


@router.post("/diagnoses")
def diagnose(
    store: OpenStore,
    jobs: Running,
    settings: Configured,
    campaign: Annotated[str, Form(max_length=1000)],
    simulator: Annotated[str, Form(max_length=300)] = "",
    gun: Annotated[str, Form()] = "",
    contact: Annotated[str, Form()] = "",
    plate: Annotated[str, Form()] = "",
    uncertain: Annotated[str, Form(max_length=2000)] = "",
    seed: Annotated[int, Form(ge=0, le=2**31 - 1)] = 0,
    # A form's default, which nobody changes.
    only: Annotated[list[EffectId], Form(alias="with")] = [],  # noqa: B006
    without: Annotated[list[EffectId], Form()] = [],  # noqa: B006
) -> Response:
    form = {
        "simulator": simulator,
        "gun": gun,
        "contact": contact,
        "plate": plate,
        "uncertain": uncertain,
    }
    arguments = arguments_of(campaign, form, seed, only, without)
    check_simulator(settings.db, arguments.simulator)
    try:
        return followed(diagnose_job(jobs, store, arguments))
    except LookupError as error:
        raise UnknownValueError("with" if only or without else "campaign", str(error)) from error


@router.post("/diagnoses/{diagnosis}/what-if")
def what_if(
    diagnosis: Key,
    store: OpenStore,
    jobs: Running,
    only: Annotated[list[EffectId], Form(alias="with")] = [],  # noqa: B006
    without: Annotated[list[EffectId], Form()] = [],  # noqa: B006
) -> Response:
    """Diagnose the same campaign with the same options, but with the ticked effects alone, or
    without them."""
    with store.reading() as session:
        campaign = kept_report(session, diagnosis)["campaign"]
        options = kept_options(session, diagnosis)
    if (set(only), set(without)) == tuple(
        set(options.get(f"{name}_effects", ())) for name in ("with", "without")
    ):
        raise FieldError(
            "with", "This page shows the diagnosis with these effects. Tick other effects first."
        )
    arguments = DiagnoseArguments(
        **{**options, "target": campaign, "with_effects": only, "without_effects": without}
    )
    return followed(diagnose_job(jobs, store, arguments))


@router.get("/diagnoses/{diagnosis}")
def diagnosis(request: Request, diagnosis: Key, store: OpenStore) -> Response:
    with store.reading() as session:
        report = kept_report(session, diagnosis)
        row = session.get_one(Diagnosis, diagnosis)
        facts: dict[str, Any] = {"diagnosed_at": row.diagnosed_at, "written_by": row.simulator}
        options = kept_options(session, diagnosis)
        try:
            drawn = parts_of(kept_verdict(session, diagnosis))
            older = ""
        except LookupError as error:
            drawn, older = DiagnosisParts(), str(error)
    return page(
        request,
        "diagnosis.html",
        key=diagnosis,
        report=report,
        facts=facts,
        drawn=drawn,
        ticked={name: options.get(f"{name}_effects", ()) for name in ("with", "without")},
        older=older,
        plan_name=plan_name(report["campaign"]),
    )


@router.post("/diagnoses/{diagnosis}/plan")
def plan(
    diagnosis: Key, store: OpenStore, name: Annotated[str, Form(max_length=200)] = ""
) -> Response:
    try:
        stored, _ = store_experiment_of(store, diagnosis, name.strip())
    except ValueError as error:
        raise FieldError("name", str(error)) from error
    return RedirectResponse(f"/plans/{part(stored.name)}", 303)


@router.post("/diagnoses/{diagnosis}/adopt")
def adopted(
    diagnosis: Key, store: OpenStore, effect: Annotated[str, Form(max_length=200)]
) -> Response:
    with store.reading() as session:
        verdict = kept_verdict(session, diagnosis)
    adopt(store, verdict, effect, diagnosis)
    return RedirectResponse(f"/diagnoses?campaign={part(verdict.campaign)}", 303)
