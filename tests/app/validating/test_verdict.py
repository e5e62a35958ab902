"""What scores whose calibration is known by construction are called."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.validate.validation import score_rows
from pyroshock.app.operations.validate.verdict import (
    failure_rows,
    failure_sentences,
    is_calibrated,
    verdict_text,
)
from pyroshock.validation.prediction_scores.failure_rules import EVERYWHERE, PredictionFailure
from pyroshock.validation.prediction_scores.quantity_score import QuantityScore
from support.records.scored_shots import FORCE, SPECTRUM, gaussian, score


def data_of(*scores: QuantityScore) -> dict[str, Any]:
    return {"quantities": [each.as_json() for each in scores]}


def test_verdict_names_bands_that_hold_and_wide_ones() -> None:
    data = data_of(score(gaussian(300)))
    assert is_calibrated(data)
    assert verdict_text(data).startswith("The 90 % bands hold: 9")
    assert "in 300 shots of 300 configurations" in verdict_text(data)
    data = data_of(score(gaussian(300, said=3.0)))
    assert is_calibrated(data)
    assert "wider than needed" in verdict_text(data)
    data = data_of(score(gaussian(5)))
    assert is_calibrated(data)
    assert verdict_text(data).startswith(
        "Too little to judge the 90 % bands, 5 shots of 5 configurations: inside lie"
    )


def test_overconfident_predictions_are_called_so() -> None:
    data = data_of(score(gaussian(100, said=0.4)), score(gaussian(100, seed=1), SPECTRUM))
    assert not is_calibrated(data)
    text = verdict_text(data)
    assert text.startswith("Not calibrated: the 90 % bands hold only ")
    assert "of the measured values of peak force" in text
    assert "spectrum" not in text.split(".")[0]


@pytest.mark.parametrize("shots", [5, 60])
def test_false_alarms_are_rare(shots: int) -> None:
    alarms = [
        not is_calibrated(
            data_of(*(score(gaussian(shots, seed=10 * run + part), FORCE) for part in range(3)))
        )
        for run in range(100)
    ]
    assert np.mean(alarms) <= 0.1


def test_interval_that_is_shown_is_the_one_that_decides() -> None:
    """Of eight quantities one interval alone may miss 90 % by chance, which all together allow."""
    row = {
        "name": "peak_force", "unit": "ln", "shots": 24, "configurations": 24, "values": 24,
        "effective_values": 24.0, "coverage90": 0.7, "coverage90_ci95": [0.48, 0.868],
        "median_abs_error": 0.05,
    }  # fmt: skip
    assert verdict_text({"quantities": [row]}).startswith("Not calibrated")
    others = [{**row, "coverage90": 0.95, "name": f"peak_acceleration_{n}"} for n in range(7)]
    data = {"quantities": [row, *others]}
    assert verdict_text(data).startswith("The 90 % bands hold: 70 % to 95 % of the measured")
    (shown, *_) = score_rows({"quantities": [{**SHOWN, **each} for each in data["quantities"]]})
    assert int(shown["at least"].split()[0]) < 90 < int(shown["at most"].split()[0])


#: What the table shows beside what the verdict reads.
SHOWN = {"coverage50": 0.5, "bias": 0.0, "sharpness90": 0.2, "crps": 0.03}


@pytest.mark.parametrize(("measure", "factor", "words"), [
    (FORCE, 1.27, "27 % too high"),
    (FORCE, 0.8, "20 % too low"),
    (SPECTRUM, 2.0, "6.0 dB too high"),
])  # fmt: skip
def test_a_failure_has_one_number_in_its_sentence_its_row_and_the_scores(
    measure: Any, factor: float, words: str
) -> None:
    """Predictions of `factor` times the measured values: the sentence said 27 % too high, the table
    a mean deviation of −21.4 %."""
    failure = PredictionFailure(EVERYWHERE, measure, factor - 1, 24, 0.01)
    data = data_of(score(gaussian(24), measure)) | {"failures": [failure.as_json()]}
    assert words in str(failure_sentences(data)[0])
    assert failure_rows(data)[0]["prediction"] == words
    measured_less_predicted = float(measure.level(np.array([1.0]))[0]) - float(
        measure.level(np.array([factor]))[0]
    )
    data["quantities"][0]["bias"] = measured_less_predicted
    deviation = next(score_rows(data))["mean deviation of the prediction"]
    size = words.split()[0].rstrip("%")
    sign = "+" if "high" in words else "−"
    assert deviation.startswith(f"{sign}{size}".rstrip("0").rstrip("."))
