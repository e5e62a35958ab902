"""The twin: sliders and what they give at once, and settings for a spectrum."""

from __future__ import annotations

import time
from typing import Annotated, Any

from fastapi import APIRouter, Form
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ....schema.campaigns import Campaign
from ....schema.jobs import DONE
from ....twin.contact.laws import LAWS
from ...finite import finite
from ...jobs.kinds.tune import TUNE
from ...predictions.predicting import TANK_PRESSURE_PA, predicted, prediction_json
from ...predictions.tables import quantity_rows
from ...predictions.warnings import field_warnings
from ...spectra.targets import MOST_BYTES
from ...twins.building import BuiltTwin
from ...twins.sliders import VELOCITY_M_S, sliders
from ..dependencies import Key, OpenStore, Running
from ..figures.twin import prediction_figures, tuned_figure
from ..rendering import page, query
from ..tuning import Tuning, tune_job
from ..twins import Asked, PredictionOptions, Twins, shown
from .jobs import followed

router = APIRouter()
_SETTINGS = ("tank_pressure_pa", "bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material", "insulator",
             "impact_position")  # fmt: skip
#: Of a prediction what the page shows as figures.
_SERIES = ("force", "acceleration", "srs")


@router.get("/twin")
def twin(request: Request, question: Asked, twins: Twins, store: OpenStore) -> Response:
    built = twins.get(question.request())
    with store.reading() as session:
        campaigns = _campaigns(session)
    question = _complete(question, built)
    answer, why_not = _answer(twins, question)
    return page(
        request,
        "twin.html",
        question=question,
        sliders=sliders(built),
        notes=built.notes,
        plates=sorted({material.name for material in built.materials.values()}, key=str.lower),
        plate=built.plate.name,
        campaigns=campaigns,
        laws=list(LAWS),
        answer=answer,
        why_not=why_not,
    )


def _complete(question: PredictionOptions, built: BuiltTwin) -> PredictionOptions:
    """A shot of a gun is set by its pressure unless a velocity is said, one of a hammer by its velocity; the mass is
    the bench's where none is said."""
    update: dict[str, float] = {}
    if question.tank_pressure_pa is None and question.impact_velocity_m_s is None:
        by_gun = built.twin.gun is not None
        update = {"tank_pressure_pa": TANK_PRESSURE_PA} if by_gun else {"impact_velocity_m_s": VELOCITY_M_S}
    if question.bullet_mass_kg is None:
        update["bullet_mass_kg"] = built.bench.impactor_mass_kg
    return question.model_copy(update=update)


def _campaigns(session: Session) -> list[tuple[str, str]]:
    """Names and kinds of the newest campaigns: the twin is that of a campaign's bench, gun or hammer."""
    query = select(Campaign.name, Campaign.kind).order_by(Campaign.date.desc(), Campaign.name)
    return [(name, kind) for name, kind in session.execute(query.limit(500))]


def _answer(twins: Twins, question: PredictionOptions) -> tuple[dict[str, Any] | None, str]:
    """What the page shows of a shot; and why there is nothing (a bullet that stays in the barrel)."""
    try:
        return answered(twins, question), ""
    except (ValueError, LookupError) as error:
        return None, str(error)


def answered(twins: Twins, question: PredictionOptions) -> dict[str, Any]:
    """The prediction as `/api/predict` gives it, its series drawn as figures, and how long it took.

    `numbers` are its figures in the units of the lab, `beside` warnings by the slider that sets the quantity.
    """
    begun = time.perf_counter()
    built = twins.get(question.request())
    prediction = predicted(built, question.shot(), draws=question.draws, seed=question.seed)
    data = prediction_json(built, prediction)
    return {
        "prediction": {key: value for key, value in data.items() if key not in _SERIES},
        "figures": prediction_figures(prediction),
        "numbers": list(quantity_rows(prediction)),
        "beside": field_warnings(prediction),
        "link": "/twin" + query(shown(question)),
        "seconds": time.perf_counter() - begun,
    }


@router.get("/twin/answer")
def answer(question: Asked, twins: Twins) -> dict[str, Any]:
    """What the sliders ask for while they move."""
    built = twins.get(question.request())
    answer: dict[str, Any] = finite(answered(twins, _complete(question, built)))
    return answer


@router.post("/tune")
async def tune(
    request: Request,
    store: OpenStore,
    running: Running,
    campaign: Annotated[str, Form(max_length=200)] = "",
    contact: Annotated[str, Form(max_length=200)] = "",
    plate: Annotated[str, Form(max_length=200)] = "",
    tolerance: Annotated[str, Form(max_length=200)] = "",
    measured: Annotated[str, Form(max_length=1000)] = "",
    at_least: Annotated[float, Form(gt=0, le=1)] = 0.5,
    share: Annotated[float, Form(gt=0, le=1)] = 1.0,
    text: Annotated[str, Form(max_length=MOST_BYTES)] = "",
) -> Response:
    form = await request.form()
    sent = form.get("specification")
    if isinstance(sent, UploadFile) and sent.filename:
        text = (await sent.read(MOST_BYTES + 1)).decode("utf-8-sig", "replace")
    if not text.strip():
        raise ValueError("no specification; choose its CSV, or paste it")
    names = [name for name in (text.strip() for text in measured.split(",")) if name]
    tuning = Tuning(
        target=text,
        tolerance=tolerance.strip(),
        campaign=campaign or None,
        contact=contact or None,
        plate=plate or None,
        measured=names,
        at_least=at_least,
        share=share,
    )
    return followed(tune_job(running, store, tuning))


@router.get("/tune/{job}")
def tuned(request: Request, job: Key, running: Running) -> Response:
    job_row = running.get(job)
    if job_row.state != DONE or job_row.kind != TUNE.name:
        raise LookupError(f"job {job} is no finished tuning; its page is /jobs/{job}")
    data = job_row.result
    twin = {key: value for key, value in data["twin"].items() if value}
    links = [
        "/twin" + query({**twin, **{name: proposal["settings"][name] for name in _SETTINGS}})
        for proposal in data["proposals"]
    ]
    return page(
        request, "tuned.html", found=data, links=links, figure=tuned_figure(data) if data["proposals"] else None
    )
