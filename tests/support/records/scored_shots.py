"""Predictions of shots whose calibration is known by construction, and their scores."""

from __future__ import annotations

import numpy as np
from pyroshock.validation.prediction_scores.quantity_score import (
    ComparedValues,
    Measure,
    QuantityScore,
)

FORCE = Measure("peak_force", "peak force", "ln", "N")
SPECTRUM = Measure("srs_acceleration_1", "spectrum at acceleration_1", "dB", "m/s2")


def gaussian(shots: int, *, said: float = 1.0, bias: float = 0.0, seed: int = 0) -> ComparedValues:
    """Predictions with standard deviation `said` of values that scatter by 1 about a predicted mean
    that is known."""
    rng = np.random.default_rng(seed)
    mean = rng.normal(0.0, 5.0, shots)
    measured = mean + bias + rng.normal(size=shots)
    return ComparedValues.of(mean + said * rng.normal(size=(400, shots)), measured)


def score(values: ComparedValues, measure: Measure = FORCE) -> QuantityScore:
    number = np.arange(len(values))
    return QuantityScore.of(measure, values, number, number)
