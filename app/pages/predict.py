"""The twin: sliders and what they give at once, as charts with 90 % bands and the nearest measured
shots."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from fastapi import APIRouter
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...schema.campaigns import Campaign
from ...schema.session import Store
from ...twin.contact.laws import LAWS
from ...twin.prediction import Prediction
from ..common.number_format import finite
from ..common.quantities import display_of
from ..figures.plotly_base import COLOURS, Figure, Trace, band, figure, line, points
from ..operations.predict.nearest_shots import (
    MeasuredShot,
    measured_spectra,
    nearest,
    nearest_rows,
    setting_values,
    shots_of,
    velocity_basis,
)
from ..operations.predict.predicting import (
    TANK_PRESSURE_PA,
    field_warnings,
    predict_shot,
    prediction_json,
)
from ..operations.predict.tables import quantity_rows
from ..twins.building import BuiltTwin
from ..web.dependencies import OpenStore
from ..web.predicted_shots import (
    VELOCITY_M_S,
    Asked,
    PredictionOptions,
    Twins,
    link_arguments,
    sliders,
)
from ..web.rendering import page, query
from ..web.shot_address import read_address, twin_at

#: Points of an acceleration on the screen, and how much of it is shown.
_POINTS, _UNTIL_S = 400, 0.01


def _shown(key: str) -> tuple[str, float]:
    """Unit and scale of a quantity on the page."""
    display = display_of(key)
    return display.unit, display.scale


def force_figure(prediction: Prediction, shots: Sequence[MeasuredShot] = ()) -> Figure:
    """Contact force in kN over ms, and that of measured shots."""
    (time_unit, per_s), (unit, per_n) = _shown("contact_time_s"), _shown("peak_force_n")
    seconds, force = prediction.time_s * per_s, prediction.force_n
    traces = band(seconds, force.lower * per_n, force.upper * per_n, "90 % band")
    for shot in shots:
        if shot.contact_time_s is not None and len(shot.force_n) > 1:
            times = np.linspace(0.0, shot.contact_time_s * per_s, len(shot.force_n))
            measured = np.asarray(shot.force_n, dtype=np.float64) * per_n
            name = "nearest measured shots" if shot is shots[0] else shot.name
            traces.append(line(times, measured, name, "c3", width=1, showlegend=shot is shots[0]))
    mean = line(seconds, force.mean * per_n, "mean")
    return figure([*traces, mean], f"time since contact ({time_unit})", f"force ({unit})")


def acceleration_figure(prediction: Prediction) -> Figure:
    """Acceleration of each sensor in g over ms, from the beginning of contact."""
    traces: list[Trace] = []
    (time_unit, per_s), (unit, scale) = _shown("contact_time_s"), _shown("peak_acceleration_m_s2")
    for i, sensor in enumerate(prediction.sensors):
        seconds, acceleration = prediction.acceleration(sensor, _UNTIL_S)
        every = slice(None, None, max(1, seconds.size // _POINTS))
        colour, shown = COLOURS[i % len(COLOURS)], seconds[every] * per_s
        low, high = acceleration.lower[every] * scale, acceleration.upper[every] * scale
        traces += band(shown, low, high, f"{sensor}: 90 %", colour)
        traces.append(line(shown, acceleration.mean[every] * scale, sensor, colour, width=1.2))
    return figure(traces, f"time since contact ({time_unit})", f"acceleration ({unit})")


#: Sensor -> frequencies and maximax, by the key of the impact.
Spectra = Mapping[int, Mapping[str, tuple[Any, Any]]]


def spectrum_figure(prediction: Prediction, spectra: Spectra | None = None) -> Figure:
    """Maximax shock response spectrum of each sensor in g; `spectra` are those of measured shots,
    at Q = 10."""
    traces: list[Trace] = []
    lines, (unit, scale) = prediction.frequency_hz, _shown("peak_acceleration_m_s2")
    for i, (sensor, spectrum_band) in enumerate(prediction.spectra_m_s2.items()):
        colour = COLOURS[i % len(COLOURS)]
        low, high = spectrum_band.lower * scale, spectrum_band.upper * scale
        traces += band(lines, low, high, f"{sensor}: 90 %", colour)
        traces.append(line(lines, spectrum_band.mean * scale, sensor, colour))
        measured = [
            of_sensor[sensor] for of_sensor in (spectra or {}).values() if sensor in of_sensor
        ]
        if measured and prediction.q == _MEASURED_Q:
            frequency, maximax = (np.concatenate(values) for values in zip(*measured, strict=True))
            inside = (frequency >= lines[0]) & (frequency <= lines[-1])
            name = f"{sensor}, measured"
            traces.append(
                points(frequency[inside], maximax[inside] * scale, name, colour, opacity=0.7)
            )
    title = f"maximax SRS ({unit}), Q = {prediction.q:g}"
    return figure(traces, "natural frequency (Hz)", title, log_x=True, log_y=True)


#: Of the spectra that are stored of measured shots.
_MEASURED_Q = 10.0


def velocity_figure(
    prediction: Prediction, shots: Sequence[MeasuredShot], near: Sequence[MeasuredShot]
) -> Figure:
    """The predicted velocity with its band at its tank pressure, and the measured shots; the
    nearest are filled."""
    unit, scale = _shown("tank_pressure_pa")
    pressure, velocity = prediction.setting.tank_pressure_pa or 0.0, prediction.velocity_m_s
    traces: list[Trace] = []
    for group, name, colour in (
        (shots, "measured shots", "c7"),
        (near, "nearest measured shots", "c3"),
    ):
        pairs = [(s.setting["tank_pressure_pa"], s.velocity_m_s) for s in group if _has_velocity(s)]
        if pairs:
            x, y = np.array(pairs, dtype=np.float64).T
            traces.append(points(x * scale, y, name, colour))
    low, high = velocity.ci90
    ends = {
        "type": "data",
        "symmetric": False,
        "array": [high - velocity.mean],
        "arrayminus": [velocity.mean - low],
    }
    traces.append(
        points(
            [pressure * scale], [velocity.mean], "prediction with its 90 % band", "c0", error_y=ends
        )
    )
    return figure(traces, f"tank pressure, gauge ({unit})", "impact velocity (m/s)")


def _has_velocity(shot: MeasuredShot) -> bool:
    return shot.velocity_m_s is not None and "tank_pressure_pa" in shot.setting


def prediction_figures(
    prediction: Prediction,
    shots: Sequence[MeasuredShot] = (),
    near: Sequence[MeasuredShot] = (),
    spectra: Spectra | None = None,
) -> dict[str, Figure]:
    """By name; without a plate no spectrum, without a gun no velocity."""
    figures = {"force": force_figure(prediction, near)}
    if prediction.sensors:
        figures["spectrum"] = spectrum_figure(prediction, spectra)
    if prediction.setting.tank_pressure_pa is not None:
        figures["velocity"] = velocity_figure(prediction, shots, near)
    if prediction.sensors:
        figures["acceleration"] = acceleration_figure(prediction)
    return figures


router = APIRouter()
#: Of a prediction what the page shows as figures.
_SERIES = ("force", "acceleration", "srs")


@router.get("/twin")
def twin(request: Request, twins: Twins, store: OpenStore) -> Response:
    """The page; a value of the address that cannot be used is named at its control, and the others
    are kept."""
    question, faults = read_address(request.query_params.multi_items())
    status = 422 if faults else 200
    question, built, unknown = twin_at(twins, question)
    status = 404 if unknown else status
    with store.reading() as session:
        campaigns = _campaigns(session)
    controls = sliders(built)
    question, absent = _offered(_complete(question, built), controls)
    answer, why_not = _answer(twins, question, store)
    return page(
        request,
        "twin.html",
        status=status,
        question=question,
        faults={**absent, **unknown, **faults},
        sliders=controls,
        notes=built.notes,
        plates=sorted({material.name for material in built.materials.values()}, key=str.lower),
        plate=built.plate.name,
        campaigns=campaigns,
        laws=list(LAWS),
        tune_query=query(
            {name: getattr(question, name) for name in ("contact", "plate")}
            | {"campaign": question.campaign if built.bench.has_gun else None}
        ),
        answer=answer,
        why_not=why_not,
    )


def _offered(
    question: PredictionOptions, controls: Mapping[str, Any]
) -> tuple[PredictionOptions, dict[str, str]]:
    """With the usual word where a control does not offer the one of the address, and what is said
    of that."""
    faults: dict[str, str] = {}
    for name, choice in controls["choices"].items():
        word = getattr(question, name)
        offered = [option["name"] for option in choice["options"]]
        if word is not None and word.lower() not in [other.lower() for other in offered]:
            faults[name] = f"{word!r} is not known here; expected one of {', '.join(offered)}."
            question = question.model_copy(update={name: choice["default"]})
    return question, faults


def _complete(question: PredictionOptions, built: BuiltTwin) -> PredictionOptions:
    """A shot of a gun is set by its pressure unless a velocity is said, one of a hammer by its
    velocity; the mass is the bench's where none is said."""
    update: dict[str, float] = {}
    if question.tank_pressure_pa is None and question.impact_velocity_m_s is None:
        by_gun = built.twin.gun is not None
        update = (
            {"tank_pressure_pa": TANK_PRESSURE_PA}
            if by_gun
            else {"impact_velocity_m_s": VELOCITY_M_S}
        )
    if question.bullet_mass_kg is None:
        update["bullet_mass_kg"] = built.bench.impactor_mass_kg
    return question.model_copy(update=update)


def _campaigns(session: Session) -> list[tuple[str, str]]:
    """Names and kinds of the newest campaigns: the twin is that of a campaign's bench, gun or
    hammer."""
    query = select(Campaign.name, Campaign.kind).order_by(Campaign.date.desc(), Campaign.name)
    return [(name, kind) for name, kind in session.execute(query.limit(500))]


def _answer(
    twins: Twins, question: PredictionOptions, store: Store
) -> tuple[dict[str, Any] | None, str]:
    """What the page shows of a shot; and why there is nothing (a bullet that stays in the
    barrel)."""
    try:
        return answered(twins, question, store), ""
    except (ValueError, LookupError) as error:
        return None, str(error)


def answered(twins: Twins, question: PredictionOptions, store: Store) -> dict[str, Any]:
    """The prediction as `/api/predict` gives it, its series drawn as figures, and how long it took.

    `numbers` are its figures in the units of the lab, `beside` warnings by the slider that sets the
    quantity, `nearest` the measured shots that are nearest to it, `basis` what the band of the
    velocity stands on.
    """
    begun = time.perf_counter()
    built = twins.get(question.request())
    prediction = predict_shot(built, question.shot(), draws=question.draws, seed=question.seed)
    data = prediction_json(built, prediction)
    shots, wanted = shots_of(store, built), setting_values(prediction.setting)
    near = nearest(wanted, shots)
    return {
        "prediction": {key: value for key, value in data.items() if key not in _SERIES},
        "figures": prediction_figures(prediction, shots, near, measured_spectra(store, near)),
        "numbers": [_number_row(row) for row in quantity_rows(prediction)],
        "nearest": nearest_rows(wanted, near),
        "basis": velocity_basis(built, prediction.setting.tank_pressure_pa),
        "beside": field_warnings(prediction),
        "link": "/twin" + query(link_arguments(question)),
        "seconds": time.perf_counter() - begun,
    }


def _number_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A quantity as words of the page, with a true minus sign."""
    mean, low, high = (row[end].replace("-", "−") for end in ("mean", "low", "high"))
    return {
        "quantity": row["quantity"],
        "mean": mean,
        "unit": row["unit"],
        "band": f"{low} to {high}",
    }


@router.get("/twin/answer")
def answer(question: Asked, twins: Twins, store: OpenStore) -> dict[str, Any]:
    """What the sliders ask for while they move."""
    built = twins.get(question.request())
    answer: dict[str, Any] = finite(answered(twins, _complete(question, built), store))
    return answer
