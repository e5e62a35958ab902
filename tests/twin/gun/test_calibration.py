"""What measured shots add to the gun's law."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.twin.gun.calibration import VelocityCalibration

PRESSURES, MASSES = np.array([0.2e5, 0.5e5, 1.5e5, 4e5, 7e5]), np.array([0.2, 0.5, 1.0])


def shots(law, repetitions=3, scatter=0.0, rng=None):
    """Pressures, masses, measured and predicted velocities of a full grid."""
    p, m, _ = (each.ravel() for each in np.meshgrid(PRESSURES, MASSES, np.arange(repetitions)))
    luck = np.ones(p.size) if rng is None else np.exp(scatter * rng.standard_normal(p.size))
    predicted = np.sqrt(p / m) / 20
    return p, m, predicted * law(p, m) * luck, predicted


@pytest.mark.parametrize(
    ("law", "degree"),
    [
        (lambda p, m: np.full_like(p, 0.5), 0),
        (lambda p, m: 0.5 * (p / 1e5) ** 0.1 * m**-0.05, 1),
        (lambda p, m: 0.6 * np.exp(0.05 * np.log(p / 1e5) ** 2 - 0.1 * np.log(p / 1e5) * np.log(m)), 2),
    ],
)
def test_finds_a_law_of_its_own_degree(law, degree):
    rng = np.random.default_rng(degree)
    fitted = VelocityCalibration.of(*shots(law, 20, 0.005, rng))
    unseen = np.array([0.9e5, 3e5]), np.array([0.35, 0.8])
    assert fitted.degree >= degree
    assert fitted.factor(*unseen) == pytest.approx(law(*unseen), rel=0.01)


def test_efficiency_is_degree_zero():
    p, m, measured, predicted = shots(lambda p, m: np.full_like(p, 0.5))
    fitted = VelocityCalibration.of(p[:3], m[:3], measured[:3], predicted[:3])
    assert fitted.degree == 0
    assert fitted.factor(np.array([1e5]), np.array([0.5])) == pytest.approx([0.5])


def test_scatter_is_that_of_repetitions():
    rng = np.random.default_rng(0)
    fitted = VelocityCalibration.of(*shots(lambda p, m: np.full_like(p, 0.5), 40, 0.03, rng))
    assert fitted.scatter == pytest.approx(0.03, rel=0.1)
    assert fitted.spread(np.array([1e5]), np.array([0.5]))[0] == pytest.approx(0.03, rel=0.15)


def test_covers_settings_it_has_not_seen():
    """90 % of the shots at settings left out lie in the band, over many guns."""
    rng, inside, asked = np.random.default_rng(1), 0, 0
    for _ in range(60):
        a, b, c = rng.normal(0, [0.1, 0.05, 0.05])
        p, m, measured, predicted = shots(
            lambda p, m, a=a, b=b, c=c: np.exp(a * np.log(p / 1e5) + b * np.log(m) + c * np.sin(np.log(p))),
            3,
            0.02,
            rng,
        )
        held_out = p == rng.choice(PRESSURES[1:-1])
        fitted = VelocityCalibration.of(p[~held_out], m[~held_out], measured[~held_out], predicted[~held_out])
        z = np.log(measured / predicted / fitted.factor(p, m))[held_out] / fitted.spread(p, m)[held_out]
        inside += int(np.sum(np.abs(z) < 1.645))
        asked += int(held_out.sum())
    assert 0.8 <= inside / asked <= 0.98


@given(st.floats(8e5, 50e5), st.floats(0.02, 0.15))
def test_spread_grows_away_from_the_shots(pressure, mass):
    rng = np.random.default_rng(2)
    fitted = VelocityCalibration.of(*shots(lambda p, m: 1 + 0.1 * np.sin(np.log(p)), 3, 0.02, rng))
    middle = fitted.spread(np.array([1.5e5]), np.array([0.5]))
    assert fitted.spread(np.array([pressure]), np.array([mass])) > middle


def test_one_mass_alone_is_enough():
    p, m, measured, predicted = shots(lambda p, m: 0.5 * (p / 1e5) ** 0.1)
    one = m == 0.5
    fitted = VelocityCalibration.of(p[one], m[one], measured[one], predicted[one])
    assert np.isfinite(fitted.spread(np.array([1e5]), np.array([0.5]))).all()


def test_one_setting_tells_nothing_of_others():
    p, m, measured, predicted = shots(lambda p, m: np.full_like(p, 0.5))
    same = (p == PRESSURES[2]) & (m == 0.5)
    fitted = VelocityCalibration.of(p[same], m[same], measured[same], predicted[same])
    assert fitted.spread(np.array([4e5]), np.array([0.5]))[0] >= 0.046


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan])
def test_refuses_velocities_that_are_none(bad):
    p, m, measured, predicted = shots(lambda p, m: np.full_like(p, 0.5))
    measured[3] = bad
    with pytest.raises(ValueError, match="measured_m_s"):
        VelocityCalibration.of(p, m, measured, predicted)


def test_refuses_a_single_shot():
    with pytest.raises(ValueError, match="at least two"):
        VelocityCalibration.of(np.array([1e5]), np.array([0.5]), np.array([10.0]), np.array([20.0]))
