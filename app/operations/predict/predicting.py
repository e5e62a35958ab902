"""One shot asked of a twin, in SI: what `predict`, the web page and the JSON API share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ....twin.prediction import Prediction
from ...common.number_format import finite
from .request import DRAWS, ShotRequest
from .validity import warning_sentences

if TYPE_CHECKING:
    from ...twins.building import BuiltTwin


def predict_shot(
    built: BuiltTwin, shot: ShotRequest, *, draws: int = DRAWS, seed: int = 0
) -> Prediction:
    """The shot with its bands; the same seed, the same answer.

    Raises `LookupError` for a material or an impact position there is none of, `ValueError` as
    `Setting` and for a bullet that stays in the barrel.
    """
    return built.twin.predict(shot.setting(built), draws=draws, rng=np.random.default_rng(seed))


def prediction_json(built: BuiltTwin, prediction: Prediction) -> dict[str, Any]:
    """The JSON of a prediction, with the twin's notes and the warnings in sentences.

    The command, the page and the API show what stands here; a value that is not known is null.
    """
    plain = finite(prediction.as_json())
    assert isinstance(plain, dict)
    warnings = list(map(str, warning_sentences(prediction)))
    return {**plain, "notes": list(built.notes), "warnings": warnings}
