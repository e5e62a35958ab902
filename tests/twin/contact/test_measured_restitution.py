"""Restitution measured from pulses: Newton, Poisson and Stronge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.impact import impact
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact.measured_restitution import (
    RecordedPulse,
    newton,
    poisson,
    stronge,
    turn_of,
    wave_work,
)
from support.records.contact_bodies import impacts

VELOCITY = np.array([0.5, 1.2, 3.0])
BODIES = impacts(impact_velocity_m_s=VELOCITY)
MASS = np.full(3, 0.32)
LOSSES = {"none": [], "viscous": [ViscousLoss(0.3)], "yield": [PlasticYield()]}


def _recorded(effects: list, points: int = 1001) -> tuple[RecordedPulse, np.ndarray]:
    pulse = impact(BODIES, effects)
    return RecordedPulse.of(pulse, MASS, VELOCITY, points), newton(
        VELOCITY, pulse.separation_velocity_m_s
    )


@pytest.mark.parametrize(
    ("loss", "points", "by_impulse", "by_work"),
    [
        ("none", 1001, 1e-4, 1e-4),
        ("viscous", 1001, 1e-4, 1e-4),
        ("yield", 1001, 1e-4, 1e-4),
        ("viscous", 20, 1e-3, 7e-3),
        ("viscous", 65, 1e-4, 8e-4),
    ],
)
def test_the_three_agree_on_a_direct_impact(
    loss: str, points: int, by_impulse: float, by_work: float
) -> None:
    """One degree of freedom: P_r / P_c = v / u, W_r / W_c = (v / u)^2. Few samples are enough: 20
    points of a contact, as the thesis keeps, and 65."""
    record, expected = _recorded(LOSSES[loss], points)
    assert poisson(record) == pytest.approx(expected, abs=by_impulse)
    assert stronge(record) == pytest.approx(expected, abs=by_work)


def test_noise_scatters_as_stated_and_the_peak_is_no_substitute_for_the_turn() -> None:
    record, expected = _recorded(LOSSES["viscous"], 201)
    rng = np.random.default_rng(5)
    deviation = 0.05 * float(record.force_n.max())
    draws = [
        poisson(
            replace(
                record,
                force_n=record.force_n + deviation * rng.standard_normal(record.force_n.shape),
            )
        )
        for _ in range(400)
    ]
    assert np.std(draws, axis=0) == pytest.approx(record.noise(deviation), rel=0.12)
    assert np.mean(draws, axis=0) == pytest.approx(expected, abs=0.01)
    # The peak of a damped pulse comes before the turn: the restitution from it is too large. A gain
    # error of the load cell acts on one plus e.
    record, expected = _recorded(LOSSES["viscous"])
    pulse = impact(BODIES, LOSSES["viscous"])
    assert turn_of(record) * record.interval_s == pytest.approx(pulse.compression_time_s, rel=1e-4)
    at_the_peak = poisson(record, turn=np.argmax(record.force_n, axis=1).astype(float))
    assert np.all(at_the_peak > expected + 0.05)
    louder = replace(record, force_n=1.03 * record.force_n)
    assert poisson(louder) == pytest.approx(1.03 * (1 + expected) - 1, abs=1e-4)


def test_waves_explain_what_an_elastic_contact_does_not() -> None:
    """Zener's plate: the contact gives its work back, eq. 1.11 says 1; eq. 1.12 is Newton's to
    first order."""
    thick = impacts(impact_velocity_m_s=VELOCITY, plate_thickness_m=0.06)
    impedance = Impacts.of(thick).plate_impedance_n_s_m
    assert impedance is not None
    pulse = impact(thick, [PlateCompliance()])
    record = RecordedPulse.of(pulse, MASS, VELOCITY, 4001)
    rate = record.velocity_m_s - record.force_n / impedance[:, None]
    lost = 1 - pulse.restitution.value
    assert np.all((lost > 0.01) & (lost < 0.05))
    assert stronge(record, rate) == pytest.approx(np.ones(3), abs=1e-4)
    waves = wave_work(record, impedance)
    kinetic = MASS / 2 * VELOCITY**2
    assert waves == pytest.approx(kinetic * (1 - pulse.restitution.value**2), rel=1e-3)
    assert np.all(np.abs(stronge(record, rate, waves) - pulse.restitution.value) < 1.2 * lost**2)
    assert stronge(record) == pytest.approx(pulse.restitution.value, abs=1e-4)


def test_restitution_wants_an_approach_three_points_and_a_whole_record() -> None:
    record, _ = _recorded([])
    assert stronge(record, record.velocity_m_s, MASS * VELOCITY**2).tolist() == [0.0] * 3
    cut = replace(record, force_n=record.force_n[:, :400])
    assert np.isnan(poisson(cut)).all()
    assert np.isnan(stronge(cut)).all()
    assert newton(np.array([2.0]), np.array([1.0])) == pytest.approx([0.5])
    with pytest.raises(ValueError, match="approach_m_s: expected positive"):
        newton(np.array([0.0]), np.array([1.0]))

    def one_impact(*force_n: float) -> RecordedPulse:
        return RecordedPulse(
            np.array([force_n]), *(np.array([value]) for value in (1e-4, 0.3, 1.0))
        )

    assert one_impact(0.0, 4e3, 0.0).velocity_m_s[0] == pytest.approx(
        [1.0, 1 - 0.2 / 0.3, 1 - 0.4 / 0.3]
    )
    with pytest.raises(
        ValueError, match=r"force_n has shape \(1, 2\): expected \(n, p\) with 3 points or more"
    ):
        one_impact(0.0, 4e3)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("mass_kg", np.zeros(3)),
        ("interval_s", np.ones(2)),
        ("force_n", np.full((3, 9), np.nan)),
        ("force_n", MASS),
    ],
)
def test_records_that_do_not_fit_are_refused(name: str, value: np.ndarray) -> None:
    with pytest.raises(ValueError, match=name):
        replace(_recorded([])[0], **{name: value})
