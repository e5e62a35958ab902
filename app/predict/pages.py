"""The twin: sliders and what they give at once, and settings for a spectrum.

Charts of a prediction: pulse, acceleration and spectrum with their 90 % bands; and of proposals for a spectrum.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Form
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.datastructures import UploadFile
from starlette.requests import Request
from starlette.responses import Response

from ...schema.campaigns import Campaign
from ...schema.jobs import DONE
from ...twin.contact.laws import LAWS
from ...twin.prediction import Prediction
from ..common.number_format import finite
from ..impacts.spectra import MOST_BYTES
from ..tune.job import TUNE
from ..tune.request import Tuning, tune_job
from ..twins.building import BuiltTwin
from ..web.dependencies import Key, OpenStore, Running
from ..web.figures_base import COLOURS, Figure, Trace, band, figure, line
from ..web.jobs_pages import followed
from ..web.rendering import page, query
from .predicting import TANK_PRESSURE_PA, field_warnings, predicted, prediction_json
from .shots import Asked, PredictionOptions, Twins, shown
from .sliders import VELOCITY_M_S, sliders
from .tables import quantity_rows

#: Points of an acceleration on the screen, and how much of it is shown.
_POINTS, _UNTIL_S = 400, 0.01


def force_figure(prediction: Prediction) -> Figure:
    """Contact force in kN over ms."""
    time, force = prediction.time_s * 1e3, prediction.force_n
    traces = band(time, force.lower / 1e3, force.upper / 1e3, "90 % band")
    return figure([*traces, line(time, force.mean / 1e3, "mean")], "time since contact (ms)", "force (kN)")


def acceleration_figure(prediction: Prediction) -> Figure:
    """Acceleration of each sensor in m/s² over ms, from the beginning of contact."""
    traces: list[Trace] = []
    for i, sensor in enumerate(prediction.sensors):
        time, acceleration = prediction.acceleration(sensor, _UNTIL_S)
        every = slice(None, None, max(1, time.size // _POINTS))
        colour = COLOURS[i % len(COLOURS)]
        traces += band(
            time[every] * 1e3, acceleration.lower[every], acceleration.upper[every], f"{sensor}: 90 %", colour
        )
        traces.append(line(time[every] * 1e3, acceleration.mean[every], sensor, colour, width=1.2))
    return figure(traces, "time since contact (ms)", "acceleration (m/s²)")


def spectrum_figure(prediction: Prediction) -> Figure:
    """Maximax shock response spectrum of each sensor."""
    traces: list[Trace] = []
    lines = prediction.frequency_hz
    for i, (sensor, spectrum_band) in enumerate(prediction.spectra_m_s2.items()):
        colour = COLOURS[i % len(COLOURS)]
        traces += band(lines, spectrum_band.lower, spectrum_band.upper, f"{sensor}: 90 %", colour)
        traces.append(line(lines, spectrum_band.mean, sensor, colour))
    title = f"maximax (m/s²), Q = {prediction.q:g}"
    return figure(traces, "frequency (Hz)", title, log_x=True, log_y=True)


def prediction_figures(prediction: Prediction) -> dict[str, Figure]:
    """By name; without a plate, the force alone."""
    figures = {"force": force_figure(prediction)}
    if prediction.sensors:
        figures |= {"spectrum": spectrum_figure(prediction), "acceleration": acceleration_figure(prediction)}
    return figures


def tuned_figure(found: Mapping[str, Any], most: int = 3) -> Figure:
    """The first proposals in the tolerance of what is prescribed (`tuning.tune_job`'s result)."""
    lines = found["frequency_hz"]
    low, high = (np.asarray(found[key]) for key in ("lower_m_s2", "upper_m_s2"))
    traces = band(lines, low, high, "tolerance", "c7")
    traces.append(line(lines, found["prescribed_m_s2"], "prescribed", "quiet", dash="dash"))
    for i, proposal in enumerate(found["proposals"][:most]):
        name = f"proposal {proposal['rank']}: {proposal['probability_within']:.0%}"
        if i == 0:
            traces += band(lines, proposal["lower_m_s2"], proposal["upper_m_s2"], "90 % of the first", COLOURS[i])
        traces.append(line(lines, proposal["expected_m_s2"], name, COLOURS[i], dash="solid" if i == 0 else "dot"))
    return figure(traces, "frequency (Hz)", "maximax (m/s²)", log_x=True, log_y=True)


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
