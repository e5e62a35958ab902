"""Measured shots of the very setting that is predicted, held against its bands."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.predict.nearest_shots import MeasuredShot
from pyroshock.app.operations.predict.same_setting import (
    is_contradicted,
    measured_ranges,
    range_cells,
    setting_sentences,
    shots_of_setting,
)
from pyroshock.app.operations.predict.service import ShotPrediction
from pyroshock.twin.chain import Twin
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.prediction import Quantity
from support.records.twin_parts import BENCH, HalfSine, setting

SHOT = Twin(HalfSine(), gun=GunStage(BENCH, 0.05)).predict(
    setting(tank_pressure_pa=3e5), draws=4, rng=np.random.default_rng(0)
)
WANTED = {"tank_pressure_pa": 8e5, "bullet_mass_kg": 0.4, "tip_radius_m": 0.045,
          "tip_material": "steel"}  # fmt: skip


def shot(velocity: float | None = 7.4, peak: float | None = 14e3, **setting: Any) -> MeasuredShot:
    return MeasuredShot(1, 1, 1, WANTED | setting, velocity, 0.5e-3, peak, ())


def predicted(velocity: float, low: float, high: float) -> Any:
    return SimpleNamespace(
        setting=SimpleNamespace(tank_pressure_pa=8e5),
        velocity_m_s=Quantity(velocity, (low, high)),
        contact_time_s=Quantity(0.5e-3, (0.4e-3, 0.6e-3)),
        peak_force_n=Quantity(14e3, (10e3, 20e3)),
    )


@pytest.mark.parametrize(("setting", "same"), [
    ({}, True),
    ({"tank_pressure_pa": 8.04e5}, True),  # the regulator sets no finer
    ({"tank_pressure_pa": 8.1e5}, False),
    ({"bullet_mass_kg": 0.42}, False),
    ({"tip_radius_m": 0.0454}, True),
    ({"tip_material": "Steel"}, True),
    ({"tip_material": "PLA"}, False),
])  # fmt: skip
def test_a_setting_is_the_same_within_the_steps_of_the_bench(setting, same):
    assert bool(shots_of_setting(WANTED, [shot(**setting)])) == same


def test_what_a_shot_does_not_state_counts_as_the_same():
    unstated = MeasuredShot(1, 1, 1, {"tank_pressure_pa": 8e5}, 7.4, None, None, ())
    assert shots_of_setting(WANTED, [unstated]) == [unstated]


@pytest.mark.parametrize(("velocities", "words"), [
    ((7.376, 7.567), "Outside of the 90 % band lie 1 of 2 of the impact velocity"),
    ((8.1, 9.2), "All of these values lie within the predicted 90 % bands."),
    ((), ""),
])  # fmt: skip
def test_the_command_says_what_shots_at_the_setting_measured(
    velocities: tuple[float, ...], words: str
) -> None:
    prediction = replace(
        SHOT,
        velocity_m_s=Quantity(10.9, (7.5, 14.8)),
        contact_time_s=Quantity(0.5e-3, (0.4e-3, 0.6e-3)),
        peak_force_n=Quantity(14e3, (10e3, 20e3)),
    )
    ranges = measured_ranges(prediction, [shot(velocity) for velocity in velocities])
    answer = ShotPrediction(SimpleNamespace(notes=()), prediction, ranges)
    text = " ".join(map(str, setting_sentences(ranges, prediction)))
    assert words in text and [str(own) for own in answer.sentences() if "setting" in str(own)] == [
        str(own) for own in setting_sentences(ranges, prediction) if "setting" in str(own)
    ]
    rows = {row["quantity"]: row for row in answer.tables()[0].rows}
    assert ("measured" in rows["impact velocity"]) == bool(velocities)
    for own in answer.sentences():
        for number_shown in own.numbers:
            if number_shown.kind == "quantity":
                assert any(number_shown.cell in row["measured"] for row in rows.values())


def test_a_prediction_beside_its_own_shots_is_said_to_be_too_high():
    """The twin of a slow valve: 10.9 m/s (7.5 to 14.8) where two shots had 7.4 and 7.6 m/s."""
    prediction = predicted(10.9, 7.5, 14.8)
    ranges = measured_ranges(prediction, [shot(7.376), shot(7.567)])
    assert is_contradicted(ranges)
    text = " ".join(map(str, setting_sentences(ranges, prediction)))
    assert text.startswith("2 shots at this setting measured: impact velocity 7.376 to 7.567 m/s")
    assert "1 of 2 of the impact velocity; the prediction lies above what was measured" in text
    assert range_cells(ranges, "velocity_m_s") == {"measured": "7.376 to 7.567",
                                                   "outside": "1 of 2"}  # fmt: skip
    assert range_cells(ranges, "impulse_n_s") == {"measured": "–", "outside": "–"}


def test_shots_within_the_bands_contradict_nothing():
    prediction = predicted(7.5, 7.0, 8.0)
    ranges = measured_ranges(prediction, [shot(7.4, None)])
    assert not is_contradicted(ranges) and "peak_force_n" not in ranges
    text = " ".join(map(str, setting_sentences(ranges, prediction)))
    assert text.startswith("1 shot at this setting measured: impact velocity 7.4 m/s")
    assert "All of these values lie within" in text


def test_a_setting_without_shots_says_nothing():
    assert list(setting_sentences({}, predicted(7.5, 7.0, 8.0))) == []
