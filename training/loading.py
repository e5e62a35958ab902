"""What MLflow calls to make a model of ours from its folder: installed code, plain numbers, no pickle."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..dataset.table import Floats, Inputs, Predictor
from .models.base import ContactModel
from .models.pack import read_model


class ServedModel:
    """A contact model with arrays by name in and out, as its MLflow signature says."""

    def __init__(self, model: ContactModel, predictors: tuple[Predictor, ...]) -> None:
        self.model = model
        self.predictors = predictors

    def predict(self, model_input: Mapping[str, Any], params: Any = None) -> dict[str, Floats]:  # noqa: ARG002  # MLflow passes it
        """Force (n x 20) and contact time (n,) with spreads, NaN where the model has none."""
        x = np.asarray(model_input["x"], dtype=np.float64)
        bench = (np.asarray(model_input[name], dtype=np.float64) for name in ("impactor_mass_kg", "plate_thickness_m"))
        pulses = self.model.predict(Inputs(self.predictors, x, *bench))
        force_spread, time_spread = pulses.force_spread_n, pulses.contact_time_spread_s
        return {
            "force_n": pulses.force_n,
            "contact_time_s": pulses.contact_time_s,
            "force_spread_n": np.full_like(pulses.force_n, np.nan) if force_spread is None else force_spread,
            "contact_time_spread_s": np.full_like(pulses.contact_time_s, np.nan)
            if time_spread is None
            else time_spread,
        }


def _load_pyfunc(path: str) -> ServedModel:
    model, about = read_model(Path(path))
    predictors = tuple(Predictor(each["name"], each["unit"], tuple(each["levels"])) for each in about["predictors"])
    return ServedModel(model, predictors)
