"""Diagnoses: what is kept, run one, its page, the plan and the twin that come of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Form, Query
from pydantic import Field
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.conditions import list_campaign_names
from ...schema.diagnoses import Diagnosis
from ..twins.adopted_effects import adopt, adoptable_names, effects_of_stages
from ..web.dependencies import Key, OpenStore, Running, Text
from ..web.jobs_pages import followed
from ..web.rendering import page, part, query
from .api import diagnose_job
from .discriminating_plan import plan_name, store_experiment_of
from .request import DiagnoseArguments, restrictions_among
from .stored import kept_options, kept_report, kept_verdict, list_diagnoses

if TYPE_CHECKING:
    from ...diagnosis.verdict import Verdict

router = APIRouter()
EffectId = Annotated[Text, Field(max_length=200)]
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
        campaigns = list_campaign_names(session)
    following = query({"campaign": campaign, "after": rows[PAGE - 1]["id"]}) if len(rows) > PAGE else ""
    return page(
        request,
        "diagnoses.html",
        rows=rows[:PAGE],
        campaigns=campaigns,
        campaign=campaign,
        stages=_STAGES,
        following=following,
        beginning=query({"campaign": campaign}) or "/diagnoses" if after else "",
    )


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
    seed: Annotated[int, Form(ge=0, le=2**31 - 1)] = 0,
    only: Annotated[list[EffectId], Form(alias="with")] = [],  # noqa: B006 - a form's default, which nobody changes
    without: Annotated[list[EffectId], Form()] = [],  # noqa: B006
) -> Response:
    arguments = DiagnoseArguments(
        campaign,
        simulator=simulator or None,
        tolerances=_tolerances({"gun": gun, "contact": contact, "plate": plate}),
        uncertain=_uncertain(uncertain),
        seed=seed,
        with_effects=only,
        without_effects=without,
    )
    return followed(diagnose_job(jobs, store, arguments))


@router.post("/diagnoses/{diagnosis}/what-if")
def what_if(
    diagnosis: Key,
    store: OpenStore,
    jobs: Running,
    only: Annotated[list[EffectId], Form(alias="with")] = [],  # noqa: B006
    without: Annotated[list[EffectId], Form()] = [],  # noqa: B006
) -> Response:
    """Diagnose the same campaign with the same options, but with the ticked effects alone, or without them."""
    with store.reading() as session:
        campaign = kept_report(session, diagnosis)["campaign"]
        options = kept_options(session, diagnosis)
    arguments = DiagnoseArguments(**{**options, "target": campaign, "with_effects": only, "without_effects": without})
    return followed(diagnose_job(jobs, store, arguments))


def _tolerances(given: dict[str, str]) -> dict[str, float]:
    """Shares from percent, dB as they are."""
    tolerances = {
        stage: _positive(text, f"the tolerance of the {stage}") for stage, text in given.items() if text.strip()
    }
    return {stage: size if stage == "plate" else size / 100 for stage, size in tolerances.items()}


def _uncertain(text: str) -> dict[str, float]:
    """`gun.friction_coefficient=0.05`, one a line."""
    values = {}
    for line in filter(None, map(str.strip, text.splitlines())):
        name, _, size = (part.strip() for part in line.partition("="))
        if "." not in name:
            raise ValueError(f"{line!r} names no number of the twin; expected gun.friction_coefficient=0.05")
        values[name] = _positive(size, name)
    return values


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
        options = kept_options(session, diagnosis)
        try:
            drawn = _charts_of(kept_verdict(session, diagnosis))
            older = ""
        except LookupError as error:
            drawn, older = _Drawn(), str(error)
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


@dataclass(frozen=True)
class _Drawn:
    """What the page shows of a verdict: sections as HTML (escaped where they are made) before and after the table of
    effects, the rows of that table (`explained`: with their figures), and what can be adopted."""

    sentence: str = ""
    restriction: str = ""
    before: str = ""
    after: str = ""
    explained: bool = False
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = ()
    adoptable: Sequence[str] = ()


def _charts_of(verdict: Verdict) -> _Drawn:
    from .report import EFFECT_COLUMNS, EFFECTS, FIRST_SECTIONS, section_html, sections
    from .summary import summary

    titled = [
        (section.title, f"<section><h2>{escape(section.title)}</h2>{section_html(section)}</section>")
        for section in sections(verdict)
        if section.title != EFFECTS
    ]
    return _Drawn(
        sentence=summary(verdict),
        restriction=" ".join(restrictions_among(verdict.assumptions)),
        before="".join(html for title, html in titled if title in FIRST_SECTIONS),
        after="".join(html for title, html in titled if title not in FIRST_SECTIONS),
        explained=bool(verdict.effects),
        columns=EFFECT_COLUMNS if verdict.effects else EFFECT_COLUMNS[:2],
        rows=_rows(verdict),
        adoptable=adoptable_names(verdict),
    )


def _rows(verdict: Verdict) -> list[tuple[Any, ...]]:
    """The effects with their figures, then those that the diagnosis did not look at, and what is unexplained."""
    from .report import EFFECT_COLUMNS, effect_rows
    from .wording import effect_subject

    rows = effect_rows(verdict)
    shown = {effect.effect for effect in verdict.effects}
    blank = ("",) * (len(EFFECT_COLUMNS) - 2 if shown else 0)
    others = [(name, effect_subject(name), *blank) for name in effects_of_stages(verdict) if name not in shown]
    return [*rows[: len(shown)], *others, *rows[len(shown) :]]


@router.post("/diagnoses/{diagnosis}/plan")
def plan(diagnosis: Key, store: OpenStore, name: Annotated[str, Form(max_length=200)] = "") -> Response:
    stored, _ = store_experiment_of(store, diagnosis, name.strip())
    return RedirectResponse(f"/plans/{part(stored.name)}", 303)


@router.post("/diagnoses/{diagnosis}/adopt")
def adopted(diagnosis: Key, store: OpenStore, effect: Annotated[str, Form(max_length=200)]) -> Response:
    with store.reading() as session:
        verdict = kept_verdict(session, diagnosis)
    adopt(store, verdict, effect, diagnosis)
    return RedirectResponse(f"/diagnoses?campaign={part(verdict.campaign)}", 303)
