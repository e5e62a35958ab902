"""The twin: one shot foretold, what can be set of it, and settings for a spectrum."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from ...operations.predict.predicting import predicted_json
from ...web.predicted_shots import Asked, PredictionOptions, Twins, sliders

router = APIRouter(tags=["twin"])


@router.get("/predict")
def predict(question: Asked, twins: Twins) -> dict[str, Any]:
    """The JSON of `pyroshock predict`: velocity, force, acceleration, spectrum with 90 % bands."""
    return predicted_json(
        twins.get(question.request()), question.shot(), draws=question.draws, seed=question.seed
    )


@router.post("/predict")
def predict_body(question: PredictionOptions, twins: Twins) -> dict[str, Any]:
    """The same of a JSON body; nothing is stored."""
    return predict(question, twins)


@router.get("/twin")
def twin(question: Asked, twins: Twins) -> dict[str, Any]:
    """What can be set, in which ranges, what the model knows of it, and what the twin is made
    of."""
    built = twins.get(question.request())
    return {
        **sliders(built),
        "notes": list(built.notes),
        "plate": built.plate.name,
        "campaign": built.bench.campaign,
    }
