"""Predictions as `pyroshock predict --json` prints them."""

from __future__ import annotations

from typing import Any

from pyroshock.app.operations.predict.predicting import predict_shot, prediction_json
from pyroshock.app.operations.predict.request import DRAWS, ShotRequest
from pyroshock.app.twins.building import BuiltTwin


def predicted_json(
    built: BuiltTwin, shot: ShotRequest, *, draws: int = DRAWS, seed: int = 0
) -> dict[str, Any]:
    """The JSON of one shot."""
    return prediction_json(built, predict_shot(built, shot, draws=draws, seed=seed))
