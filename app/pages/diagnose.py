"""Diagnoses: what is kept, run one, its page, the plan and the twin that come of it."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from ...schema.conditions import list_campaign_names
from ...schema.corrected_facts import list_corrections
from ...schema.diagnoses import Diagnosis
from ...schema.person_roles import READER
from ..common.number_format import finite
from ..doors.form_route import SentTexts
from ..operations.diagnose.discriminating_plan import plan_name
from ..operations.diagnose.effect_boxes import effects_of_form, figures_with
from ..operations.diagnose.list_figure import bench_words, errors_plot, listed_error
from ..operations.diagnose.make import DIAGNOSE
from ..operations.diagnose.page_parts import DiagnosisParts, list_row, parts_of
from ..operations.diagnose.residual_figures import impacts_of, run_points
from ..operations.diagnose.stored import (
    kept_options,
    kept_report,
    kept_summary,
    kept_verdict,
    list_diagnoses,
)
from ..operations.faults import FieldError, read
from ..operations.form import controls
from ..operations.laboratory import Laboratory
from ..twins.contact_names import list_version_labels
from ..web.dependencies import Configured, Key, OpenStore, Running
from ..web.jobs import ask_operation, followed
from ..web.page_sources import THE_STORE
from ..web.rendering import page, query
from ..web.role_needs import NeedsRole

router = APIRouter()
_READS = NeedsRole(READER, "an answer about a diagnosis")
PAGE = 25
_NO_EFFECTS: list[str] = []
#: Of the form: what the campaign is asked for by itself, and what stands below "Tolerances".
_FIELDS = ("campaign", "simulator")
_DETAILS = ("tolerances", "uncertain", "seed", "modes", "bench")


@router.get("/diagnoses", dependencies=[Depends(THE_STORE)])
def diagnoses(
    request: Request,
    store: OpenStore,
    campaign: str = "",
    after: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
) -> Response:
    with store.reading() as session:
        campaigns, simulators = list_campaign_names(session), list_version_labels(session)
        unknown = bool(campaign) and campaign not in campaigns
        listed = [] if unknown else list_diagnoses(session, campaign or None, PAGE + 1, after)
        summaries = [(row, kept_summary(session, row["id"])) for row in listed[:PAGE]]
        rows = [list_row(row, verdict) for row, verdict in summaries]
        benches = bench_words(session, [row["campaign"] for row in rows])
        errors = [
            listed_error(row, verdict, benches.get(row["campaign"], "unknown bench"))
            for row, verdict in summaries
        ]
    following = query({"campaign": campaign, "after": rows[-1]["id"]}) if len(listed) > PAGE else ""
    return page(
        request,
        "diagnoses.html",
        404 if unknown else 200,
        rows=rows,
        errors=errors_plot(errors),
        campaigns=campaigns,
        campaign=campaign,
        unknown=unknown,
        controls=controls(
            DIAGNOSE,
            {**request.query_params, "campaign": campaign or next(iter(campaigns), "")},
            names=_FIELDS,
            choices={"campaign": campaigns, "simulator": ["", *simulators]},
        ),
        opened=any(request.query_params.get(name) for name in _DETAILS),
        details=controls(DIAGNOSE, request.query_params, names=_DETAILS),
        following=following,
        beginning=query({"campaign": campaign}) or "/diagnoses" if after else "",
    )


@router.post("/diagnoses/{diagnosis}/what-if", dependencies=[Depends(_READS)])
def what_if(
    diagnosis: Key,
    store: OpenStore,
    jobs: Running,
    settings: Configured,
    texts: SentTexts,
) -> Response:
    """Diagnose the same campaign with the same options, but with the ticked effects alone, or
    without them."""
    with store.reading() as session:
        campaign = kept_report(session, diagnosis)["campaign"]
        options = kept_options(session, diagnosis)
    ticked = {name: effects_of_form(texts, name) for name in ("with_effects", "without_effects")}
    again = read(DIAGNOSE.request, {**options, "campaign": campaign, **ticked}, "network")
    if all(set(getattr(again, name)) == set(options.get(name, ())) for name in ticked):
        raise FieldError(
            "with_effects",
            "This page shows the diagnosis with these effects. Tick other effects first.",
        )
    laboratory = Laboratory(store, settings.db, folders=settings.folders)
    return followed(ask_operation(DIAGNOSE, again, laboratory, jobs))


@router.get("/diagnoses/{diagnosis}/figures", dependencies=[Depends(THE_STORE)])
def figures(
    diagnosis: Key, store: OpenStore, effect: Annotated[list[str], Query()] = _NO_EFFECTS
) -> Response:
    """The waterfall and the residuals with exactly these effects, for the page's script."""
    with store.reading() as session:
        verdict = kept_verdict(session, diagnosis)
        impacts = impacts_of(session, verdict.campaign)
    data = figures_with(verdict, effect, run_points(verdict, impacts))
    return JSONResponse(finite(data))


@router.get("/diagnoses/{diagnosis}", dependencies=[Depends(THE_STORE)])
def diagnosis(
    request: Request,
    diagnosis: Key,
    store: OpenStore,
    effect: Annotated[list[str] | None, Query()] = None,
) -> Response:
    """`effect`: the effects that are ticked; "" for none of them."""
    names = None if effect is None else [name for name in effect if name]
    with store.reading() as session:
        report = kept_report(session, diagnosis)
        row = session.get_one(Diagnosis, diagnosis)
        facts: dict[str, Any] = {"diagnosed_at": row.diagnosed_at, "written_by": row.simulator}
        options = kept_options(session, diagnosis)
        impacts = impacts_of(session, report["campaign"])
        corrected = list_corrections(session, [report["campaign"]], row.diagnosed_at)
        try:
            verdict = kept_verdict(session, diagnosis)
            older = ""
        except LookupError as error:
            verdict, older = None, str(error)
    restricted_to = options.get("with_effects", ())
    return page(
        request,
        "diagnosis.html",
        corrected=corrected,
        key=diagnosis,
        report=report,
        facts=facts,
        drawn=DiagnosisParts()
        if verdict is None
        else parts_of(verdict, impacts, names, restricted_to),
        without=options.get("without_effects", ()),
        older=older,
        plan_name=plan_name(report["campaign"]),
    )
