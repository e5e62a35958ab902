"""Diagnoses: what is kept, run one, its page, the plan and the twin that come of it."""

from __future__ import annotations

import math
from typing import Annotated, Any

from fastapi import APIRouter, Form, Query
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ....schema.campaigns import Campaign
from ....schema.diagnoses import Diagnosis
from ...diagnoses.discriminating import store_experiment
from ...diagnoses.kept import kept_report, kept_verdict, list_diagnoses
from ...jobs.kinds.diagnose import DiagnoseArguments
from ...twins.adopting import adopt
from ..asking import Key, OpenStore, Running
from ..diagnosing import diagnose_job
from ..rendering import page, part, query
from .jobs import followed

router = APIRouter()
PAGE = 50
_STAGES = (("gun", "gun: velocity", "%"), ("contact", "contact: force", "%"), ("plate", "plate: spectrum", "dB"))


@router.get("/diagnoses")
def diagnoses(
    request: Request,
    store: OpenStore,
    campaign: str = "",
    after: Annotated[int | None, Query(ge=1, le=2**31 - 1)] = None,
) -> Response:
    with store.reading() as session:
        rows = list_diagnoses(session, campaign or None, PAGE + 1, after)
        campaigns = _campaigns(session)
    more = len(rows) > PAGE
    rows = rows[:PAGE]
    following = query({"campaign": campaign, "after": rows[-1]["id"]}) if more else ""
    return page(
        request,
        "diagnoses.html",
        rows=rows,
        campaigns=campaigns,
        campaign=campaign,
        stages=_STAGES,
        following=following,
        beginning=query({"campaign": campaign}) or "/diagnoses" if after else "",
    )


def _campaigns(session: Session) -> list[str]:
    return list(session.scalars(select(Campaign.name).order_by(Campaign.date.desc(), Campaign.name).limit(500)))


@router.post("/diagnoses")
def diagnose(
    store: OpenStore,
    jobs: Running,
    campaign: Annotated[str, Form(max_length=1000)],
    simulator: Annotated[str, Form(max_length=300)] = "",
    gun: Annotated[str, Form()] = "",
    contact: Annotated[str, Form()] = "",
    plate: Annotated[str, Form()] = "",
    uncertain: Annotated[str, Form(max_length=2000)] = "",
    calibrate: Annotated[int, Form(ge=0, le=1000)] = 0,
    seed: Annotated[int, Form(ge=0, le=2**31 - 1)] = 0,
) -> Response:
    asked = DiagnoseArguments(
        campaign,
        simulator=simulator or None,
        tolerances=_tolerances({"gun": gun, "contact": contact, "plate": plate}),
        uncertain=_uncertain(uncertain),
        calibrate=calibrate,
        seed=seed,
    )
    return followed(diagnose_job(jobs, store, asked))


def _tolerances(given: dict[str, str]) -> dict[str, float]:
    """Shares from percent, dB as they are."""
    found = {stage: _positive(text, f"the tolerance of the {stage}") for stage, text in given.items() if text.strip()}
    return {stage: size if stage == "plate" else size / 100 for stage, size in found.items()}


def _uncertain(text: str) -> dict[str, float]:
    """`gun.friction_coefficient=0.05`, one a line."""
    found = {}
    for line in filter(None, map(str.strip, text.splitlines())):
        name, _, size = (each.strip() for each in line.partition("="))
        if "." not in name:
            raise ValueError(f"{line!r} names no number of the twin; expected gun.friction_coefficient=0.05")
        found[name] = _positive(size, name)
    return found


def _positive(text: str, what: str) -> float:
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        value = math.nan
    if not 0 < value < 100:
        raise ValueError(f"{what} is {text!r}; expected a number above 0 and below 100")
    return value


@router.get("/diagnoses/{diagnosis}")
def diagnosis(request: Request, diagnosis: Key, store: OpenStore) -> Response:
    with store.reading() as session:
        report = kept_report(session, diagnosis)
        row = session.get_one(Diagnosis, diagnosis)
        facts: dict[str, Any] = {"diagnosed_at": row.diagnosed_at, "written_by": row.simulator}
        try:
            body, sentence, effects = _drawn(session, diagnosis)
            older = ""
        except LookupError as error:
            body, sentence, effects, older = "", "", [], str(error)
    return page(
        request,
        "diagnosis.html",
        key=diagnosis,
        report=report,
        facts=facts,
        body=body,
        sentence=sentence,
        effects=effects,
        older=older,
        plan_name=f"{report['campaign']}-discriminate",
    )


def _drawn(session: Session, key: int) -> tuple[str, str, list[str]]:
    """Sections of the report as HTML (escaped where they are made), its sentence, and what can be adopted."""
    from ...reports.diagnosis import parts
    from ...reports.sentences import verdict_sentence

    verdict = kept_verdict(session, key)
    named = [effect for cause in verdict.causes for effect in cause.effects if effect not in ("none", "unknown")]
    fitted = [each for each in dict.fromkeys((*named, *verdict.fits)) if verdict.fits.get(each)]
    first = [effect for cause in verdict.causes if cause.fitted for effect in cause.effects[:1]]
    effects = list(dict.fromkeys((*first, *fitted)))
    return "".join(parts(verdict)), verdict_sentence(verdict), effects


@router.post("/diagnoses/{diagnosis}/plan")
def plan(diagnosis: Key, store: OpenStore, name: Annotated[str, Form(max_length=200)] = "") -> Response:
    with store.reading() as session:
        report = kept_report(session, diagnosis)
    wanted = name.strip() or f"{report['campaign']}-discriminate"
    stored, _ = store_experiment(store, report["campaign"], report["next_runs"], wanted)
    return RedirectResponse(f"/plans/{part(stored.name)}", 303)


@router.post("/diagnoses/{diagnosis}/adopt")
def adopted(diagnosis: Key, store: OpenStore, effect: Annotated[str, Form(max_length=200)]) -> Response:
    with store.reading() as session:
        verdict = kept_verdict(session, diagnosis)
    adopt(store, verdict, effect, diagnosis)
    return RedirectResponse(f"/diagnoses?campaign={part(verdict.campaign)}", 303)
