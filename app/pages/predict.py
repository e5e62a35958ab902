"""The twin: sliders and what they give at once, as charts with 90 % bands and the nearest measured
shots."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Depends
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...schema.campaigns import Campaign
from ...schema.session import Store
from ..common.number_format import finite
from ..doors.json_route import read_pairs
from ..figures.page_renderer import figure_data
from ..operations.form import texts_of
from ..operations.predict.controls import VELOCITY_M_S, sliders
from ..operations.predict.factors import answering_contact
from ..operations.predict.figures import prediction_figures
from ..operations.predict.nearest_shots import (
    known_rows,
    measured_spectra,
    nearest,
    nearest_rows,
    setting_values,
    shots_of,
    velocity_basis,
)
from ..operations.predict.predict import PREDICT
from ..operations.predict.predicting import predict_shot, prediction_json
from ..operations.predict.request import TANK_PRESSURE_PA, PredictionRequest, ShotRequest
from ..operations.predict.same_setting import (
    is_contradicted,
    measured_ranges,
    range_cells,
    setting_sentences,
    shots_of_setting,
)
from ..operations.predict.tables import QUANTITIES, quantity_rows
from ..operations.predict.validity import field_warnings
from ..operations.tune.target_words import (
    SPECIFICATION,
    AddressedTarget,
    target_of_address,
    target_sentence,
)
from ..operations.validate.stored_validation import newest_validation
from ..twins.building import BuiltTwin
from ..twins.contact_names import list_contact_names
from ..twins.twin_cache import TwinCache
from ..web.dependencies import OpenStore, Twins
from ..web.page_sources import STORE_AND_MODELS
from ..web.rendering import page, query
from ..web.role_needs import role_of
from ..web.shot_address import built_twin, read_address, twin_at

router = APIRouter()
#: Of a prediction what the page shows as figures.
_SERIES = ("force", "acceleration", "srs")
_NO_TARGET = AddressedTarget()


@router.get("/twin", dependencies=[Depends(STORE_AND_MODELS), Depends(role_of(PREDICT))])
def twin(request: Request, twins: Twins, store: OpenStore) -> Response:
    """The page; a value of the address that cannot be used is named at its control, and the others
    are kept."""
    pairs, specification = target_of_address(request.query_params.multi_items())
    question, faults = read_address(pairs)
    if specification.fault:
        faults[SPECIFICATION] = specification.fault
    status = 422 if faults else 200
    question, built, unknown = twin_at(twins, question)
    status = 404 if unknown else status
    with store.reading() as session:
        campaigns = _campaigns(session)
        contacts = list_contact_names(session)
    controls = sliders(built)
    question = _at_measured_shot(question, built, store)
    question, absent = _offered(_complete(question, built), controls)
    answer, why_not = _answer(twins, question, store, specification)
    validation = newest_validation(store, built.bench.campaign)
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
        contacts=contacts,
        specification=specification,
        specification_sentence=""
        if specification.target is None
        else target_sentence(specification.target),
        validation=validation,
        validation_sentences=[] if validation is None else list(map(str, validation.sentences())),
        tune_query=query(
            {name: getattr(question, name) for name in ("contact", "plate")}
            | {"campaign": question.campaign if built.bench.has_gun else None}
            | {"target": specification.text, "tolerance": specification.tolerance}
        ),
        answer=answer,
        why_not=why_not,
    )


def _at_measured_shot(
    question: PredictionRequest, built: BuiltTwin, store: Store
) -> PredictionRequest:
    """The shot that the page opens at: the measured one whose pressure, or velocity, is in the
    middle of all. An address that says something of the shot, and a bench without shots, keep the
    question as it is."""
    if question.model_fields_set & ShotRequest.model_fields.keys():
        return question
    driven_by = "tank_pressure_pa" if built.bench.has_gun else "impact_velocity_m_s"
    measured = [shot.setting for shot in shots_of(store, built) if driven_by in shot.setting]
    if not measured:
        return question
    measured.sort(key=lambda setting: setting[driven_by])
    middle_setting = measured[len(measured) // 2]
    fields = ShotRequest.model_fields
    return question.model_copy(
        update={name: value for name, value in middle_setting.items() if name in fields}
    )


def _offered(
    question: PredictionRequest, controls: Mapping[str, Any]
) -> tuple[PredictionRequest, dict[str, str]]:
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


def _complete(question: PredictionRequest, built: BuiltTwin) -> PredictionRequest:
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
    twins: TwinCache, question: PredictionRequest, store: Store, specification: AddressedTarget
) -> tuple[dict[str, Any] | None, str]:
    """What the page shows of a shot; and why there is nothing (a bullet that stays in the
    barrel)."""
    try:
        return answered(twins, question, store, specification), ""
    except (ValueError, LookupError) as error:
        return None, str(error)


def answered(
    twins: TwinCache,
    question: PredictionRequest,
    store: Store,
    specification: AddressedTarget = _NO_TARGET,
) -> dict[str, Any]:
    """The prediction as `/api/predict` gives it, its series as the data of figures, and the seconds
    that it took.

    `numbers` are its figures in the units of the lab beside what shots of the same setting
    measured, `here` says the latter in words (`contradicted`: some of it lies outside of the
    bands), `beside` warnings by the slider that sets the quantity, `nearest` the measured shots
    that are nearest to it, `basis` what the band of the velocity stands on. `link` pins all that
    the answer rests on but for what is measured or adopted later.
    """
    begun = time.perf_counter()
    built = built_twin(twins, question)
    prediction = predict_shot(built, question, draws=question.draws, seed=question.seed)
    data = prediction_json(built, prediction)
    shots, wanted = shots_of(store, built), setting_values(prediction.setting)
    near = nearest(wanted, shots)
    ranges = measured_ranges(prediction, shots_of_setting(wanted, shots))
    return {
        "prediction": {key: value for key, value in data.items() if key not in _SERIES},
        "figures": {
            name: figure_data(plot)
            for name, plot in prediction_figures(
                prediction, shots, near, measured_spectra(store, near), specification.target
            ).items()
        },
        "numbers": [
            _number_row(row) | range_cells(ranges, name)
            for name, row in zip(
                (*QUANTITIES, *map(_peak_key, prediction.sensors)),
                quantity_rows(prediction),
                strict=True,
            )
        ],
        "here": " ".join(map(str, setting_sentences(ranges, prediction))),
        "contradicted": is_contradicted(ranges),
        "known": known_rows(built, prediction),
        "nearest": nearest_rows(wanted, near),
        "basis": str(velocity_basis(built, prediction.setting.tank_pressure_pa) or ""),
        "beside": field_warnings(prediction),
        "link": "/twin" + query({**texts_of(_pinned(question, built)), **specification.fields}),
        "seconds": time.perf_counter() - begun,
    }


def _pinned(question: PredictionRequest, built: BuiltTwin) -> PredictionRequest:
    """The question with the campaign and the contact that answered it: a newer campaign, or another
    model in use, does not change what its address shows. The plate is the campaign's."""
    return question.model_copy(
        update={
            "campaign": question.campaign or built.bench.campaign,
            "contact": answering_contact(built, question.contact),
        }
    )


def _peak_key(sensor: str) -> str:
    return f"peak_{sensor}"


def _number_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A quantity as words of the page, with a true minus sign."""
    mean, low, high = (row[end].replace("-", "−") for end in ("mean", "low", "high"))
    return {
        "quantity": row["quantity"],
        "mean": mean,
        "unit": row["unit"],
        "band": f"{low} to {high}",
    }


@router.get("/twin/answer", dependencies=[Depends(role_of(PREDICT))])
def answer(request: Request, twins: Twins, store: OpenStore) -> dict[str, Any]:
    """What the sliders ask for while they move."""
    pairs, specification = target_of_address(request.query_params.multi_items())
    question = read_pairs(PredictionRequest, pairs)
    built = built_twin(twins, question)
    complete = _complete(question, built)
    answer: dict[str, Any] = finite(answered(twins, complete, store, specification))
    return answer
