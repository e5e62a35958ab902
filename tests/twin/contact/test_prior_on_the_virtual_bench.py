"""Bands of the contact on shots that were not learned from, of a bench whose laws are others than
the twin's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.twin.contact.prior import PriorContact
from pyroshock.twin.contact_interface import ImpactBatch
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.prediction import HIGH, LOW, stratified_normals
from support.records.virtual_pulses import gun_shots, hammer_shots

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Scores:
    """Of peak force, contact time and impulse: share of shots in their 90 % bands (3,), and the
    errors' median size."""

    coverage: Floats
    error: Floats


def scores(stage: PriorContact, shots: MeasuredShots, velocity: Floats) -> Scores:
    """Measured pulses against 64 draws at the true velocity; errors are ln(mean of the draws /
    measured)."""
    rng = np.random.default_rng(0)
    measured = np.column_stack([shots.peak_force_n, shots.contact_time_s, shots.impulse_n_s])
    inside, errors = [], []
    for row, setting in enumerate(shots.settings):
        strikes = ImpactBatch([setting] * 64, np.full(64, velocity[row]))
        pulses = stage.pulses(strikes, stratified_normals(64, stage.normals, rng))
        draws = np.column_stack([pulses.peak_force_n, pulses.contact_time_s, pulses.impulse_n_s])
        low, high = np.quantile(draws, (LOW, HIGH), axis=0, method="hazen")
        inside.append((measured[row] >= low) & (measured[row] <= high))
        errors.append(np.abs(np.log(draws.mean(axis=0) / measured[row])))
    return Scores(np.mean(inside, axis=0), np.median(errors, axis=0))


def left_out(
    shots: MeasuredShots,
    velocity: Floats,
    stage: PriorContact,
    configurations: int,
    repetitions: int,
    seed: int,
) -> Scores:
    """Scores on all other configurations after that many, of each the first repetitions."""
    order = np.random.default_rng(seed).permutation(shots.configuration.max() + 1)[:configurations]
    rows = [np.flatnonzero(shots.configuration == each)[:repetitions] for each in order]
    learned = stage.updated(shots.take(np.concatenate(rows)))
    rest = np.flatnonzero(~np.isin(shots.configuration, order))
    return scores(learned, shots.take(rest), velocity[rest])


def test_eight_configurations_of_a_gun_narrow_the_bands_around_the_others() -> None:
    shots, velocity = gun_shots(120, configurations=16, repetitions=1)
    before = scores(PriorContact(), shots, velocity)
    after = left_out(shots, velocity, PriorContact(), 8, 1, seed=0)
    assert np.all(before.coverage >= 0.85)
    assert np.all(after.coverage >= 0.75)
    assert after.error[0] < 0.5 * before.error[0]


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("kind", ["gun", "hammer"])
def test_bands_hold_nine_shots_of_ten_and_peaks_come_near(kind: str) -> None:
    """Means over three campaigns: 30 configurations of a gun by 3, or 60 of a hammer by 4. Ten
    shots of as many configurations, or two thirds of the configurations, foretell the others."""
    campaign, size = (gun_shots, 30) if kind == "gun" else (hammer_shots, 60)
    nothing, ten, most = [], [], []
    for seed in range(120, 123):
        shots, velocity = campaign(seed)
        stage = PriorContact(hand_held=kind == "hammer")
        nothing.append(scores(stage, shots, velocity))
        ten.append(left_out(shots, velocity, stage, 10, 1, seed))
        most.append(left_out(shots, velocity, stage, 2 * size // 3, 9, seed))
    mean = {
        name: (
            np.mean([each.coverage for each in of], axis=0),
            np.mean([each.error for each in of], axis=0),
        )
        for name, of in (("nothing", nothing), ("ten", ten), ("most", most))
    }
    for name, (coverage, error) in mean.items():
        print(
            f"{kind}, learned from {name}: coverage {coverage.round(3)}, "
            f"median error {error.round(3)}"
        )
    assert np.all(mean["nothing"][0] >= 0.85)
    assert np.all(mean["ten"][0] >= 0.85)
    assert np.all((mean["most"][0] >= 0.82) & (mean["most"][0] <= 0.98))
    assert mean["most"][1][0] <= 0.08
    assert mean["ten"][1][0] <= (0.5 if kind == "gun" else 0.8) * mean["nothing"][1][0]
