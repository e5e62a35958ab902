"""The twin: sliders and what they give at once, as charts of pulse, acceleration and spectrum with their 90 % bands."""

from __future__ import annotations

import time
from typing import Any

from fastapi import APIRouter
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...schema.campaigns import Campaign
from ...twin.contact.laws import LAWS
from ...twin.prediction import Prediction
from ..common.number_format import finite
from ..twins.building import BuiltTwin
from ..web.dependencies import OpenStore
from ..web.figures_base import COLOURS, Figure, Trace, band, figure, line
from ..web.rendering import page, query
from .predicting import TANK_PRESSURE_PA, field_warnings, predict_shot, prediction_json
from .shots import VELOCITY_M_S, Asked, PredictionOptions, Twins, link_arguments, sliders
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


router = APIRouter()
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
    prediction = predict_shot(built, question.shot(), draws=question.draws, seed=question.seed)
    data = prediction_json(built, prediction)
    return {
        "prediction": {key: value for key, value in data.items() if key not in _SERIES},
        "figures": prediction_figures(prediction),
        "numbers": list(quantity_rows(prediction)),
        "beside": field_warnings(prediction),
        "link": "/twin" + query(link_arguments(question)),
        "seconds": time.perf_counter() - begun,
    }


@router.get("/twin/answer")
def answer(question: Asked, twins: Twins) -> dict[str, Any]:
    """What the sliders ask for while they move."""
    built = twins.get(question.request())
    answer: dict[str, Any] = finite(answered(twins, _complete(question, built)))
    return answer
