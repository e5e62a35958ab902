"""What measured shots add to the gun's law."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pyroshock.twin.gun.calibration import VelocityCalibration

Floats = NDArray[np.float64]

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


# --- against reckonings of their own ---


def monomials(degree: int, pressure: Floats, mass: Floats) -> Floats:
    """About zero, where the fit's are about the settings' centre: least squares give the same curve."""
    x, z = np.log(pressure), np.log(mass)
    columns = {0: [x**0], 1: [x**0, x, z], 2: [x**0, x, z, x * x, x * z, z * z]}[degree]
    return np.stack(columns, axis=1)


def refitted_errors(degree: int, pressure: Floats, mass: Floats, y: Floats) -> Floats:
    """Of each setting, by a fit to all the others."""
    rows, found = monomials(degree, pressure, mass), np.empty(len(y))
    for i in range(len(y)):
        others = np.arange(len(y)) != i
        found[i] = y[i] - rows[i] @ np.linalg.lstsq(rows[others], y[others], rcond=None)[0]
    return found


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def scattered_settings(count: int, seed: int) -> tuple[Floats, Floats]:
    rng = np.random.default_rng(seed)
    return np.exp(rng.uniform(np.log(0.2e5), np.log(8e5), count)), np.exp(rng.uniform(np.log(0.1), 0.0, count))


def calibrated(pressure: Floats, mass: Floats, y: Floats) -> VelocityCalibration:
    """From logarithms of measured over predicted."""
    predicted = np.sqrt(pressure / mass) / 20
    return VelocityCalibration.of(pressure, mass, predicted * np.exp(y), predicted)


@pytest.mark.parametrize("count", [3, 4, 5, 6, 7, 8, 9, 12, 20])
@pytest.mark.parametrize("bend", [0.0, 0.02, 0.3])
def test_degree_is_the_one_that_predicts_settings_left_out_best(count: int, bend: float) -> None:
    for seed in range(4):
        p, m = scattered_settings(count, seed)
        x, z = np.log(p / 1e5), np.log(m)
        y = -0.6 + 0.1 * x - 0.05 * z + bend * x * z + 0.02 * np.random.default_rng(seed).standard_normal(count)
        fitted = calibrated(p, m, y)
        # two settings more than terms, at least
        allowed = [degree for degree, least in ((0, 1), (1, 5), (2, 8)) if count >= least]
        errors = {degree: rms(refitted_errors(degree, p, m, y)) for degree in allowed}
        best = min(allowed, key=errors.__getitem__)
        assert fitted.degree == best
        assert fitted.misfit == pytest.approx(errors[best], rel=1e-6)
        terms = np.linalg.lstsq(monomials(best, p, m), y, rcond=None)[0]
        unseen = scattered_settings(5, seed + 100)
        assert np.log(fitted.factor(*unseen)) == pytest.approx(monomials(best, *unseen) @ terms, abs=1e-7)


def linear(p: Floats, m: Floats) -> Floats:
    return -0.6 + 0.11 * np.log(p / 1e5) - 0.07 * np.log(m)


def bent(p: Floats, m: Floats) -> Floats:
    x, z = np.log(p / 1e5), np.log(m)
    return linear(p, m) + 0.09 * x * x - 0.13 * x * z + 0.2 * z * z


@pytest.mark.parametrize(("law", "settings", "degree"), [(linear, 4, 0), (linear, 5, 1), (bent, 7, 1), (bent, 8, 2)])
def test_a_degree_takes_two_settings_more_than_its_terms(
    law: Callable[[Floats, Floats], Floats], settings: int, degree: int
) -> None:
    p, m = scattered_settings(settings, 3)
    fitted = calibrated(p, m, law(p, m))
    assert (fitted.degree, fitted.terms.size, fitted.settings) == (degree, (1, 3, 6)[degree], settings)


@pytest.mark.parametrize(("law", "degree"), [(linear, 1), (bent, 2)])
def test_a_polynomial_in_the_logarithms_is_found_exactly(law: Callable[[Floats, Floats], Floats], degree: int) -> None:
    """Down to pressures below a pascal, too."""
    p, m = scattered_settings(12, 0)
    fitted = calibrated(p, m, law(p, m))
    far = np.array([0.5, 0.9, 1.5, 3e6]), np.array([0.3, 2.0, 0.01, 0.5])
    assert fitted.degree == degree
    assert np.log(fitted.factor(*far)) == pytest.approx(law(*far), rel=1e-7)
    assert fitted.misfit < 1e-8


def test_a_mass_that_one_setting_alone_has_tells_no_slope() -> None:
    """Without that setting nothing is known of masses; a fit that leans on it would have no error there."""
    p = np.array([0.2e5, 0.5e5, 1e5, 2e5, 4e5, 8e5, 1e5])
    m = np.array([0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.1])
    y = np.array([-0.6, -0.5, -0.62, -0.58, -0.55, -0.61, 0.4])
    fitted = calibrated(p, m, y)
    assert fitted.degree == 0
    assert fitted.misfit == pytest.approx(rms(refitted_errors(0, p, m, y)), rel=1e-9)


def test_scatter_is_pooled_within_settings_with_their_degrees_of_freedom() -> None:
    p, m = np.array([1e5, 1e5, 1e5, 2e5, 2e5, 4e5]), np.array([0.5, 0.5, 0.5, 0.5, 0.5, 0.2])
    y = np.array([-0.60, -0.62, -0.67, -0.50, -0.44, -0.70])
    fitted = calibrated(p, m, y)
    # sums of squares 0.0026 and 0.0018; three shots above the three means
    assert fitted.scatter == pytest.approx(np.sqrt((0.0026 + 0.0018) / 3), rel=1e-9)
    assert (fitted.shots, fitted.settings) == (6, 3)
    means = np.array([-0.63, -0.47, -0.70])
    # a mean predicted by the mean of the two others; two shots stand for a setting
    left_out = (means - means.mean()) * 3 / 2
    assert fitted.misfit == pytest.approx(np.sqrt(rms(left_out) ** 2 - fitted.scatter**2 / 2), rel=1e-9)
    assert fitted.factor(np.array([3e5]), np.array([0.3])) == pytest.approx([np.exp(-0.6)], rel=1e-12)


def test_shots_of_one_setting_differ_by_rounding_alone() -> None:
    p, m = np.array([1e5, 1e5 * (1 + 1e-13), 2e5, 4e5]), np.array([0.5, 0.5, 0.5 * (1 - 1e-13), 0.5])
    assert calibrated(p, m, np.array([-0.6, -0.5, -0.6, -0.6])).settings == 3


def test_without_repetitions_nothing_is_known_to_scatter() -> None:
    p, m = scattered_settings(6, 1)
    assert calibrated(p, m, linear(p, m)).scatter == 0


def test_settings_that_differ_less_than_shots_leave_no_misfit() -> None:
    p, m = np.repeat(PRESSURES, 2), np.full(10, 0.5)
    fitted = calibrated(p, m, np.tile([-0.5, -0.7], 5))
    assert fitted.scatter == pytest.approx(0.2 / np.sqrt(2), rel=1e-9)
    assert fitted.misfit == 0
    assert fitted.spread(np.array([1e5]), np.array([0.5])) == pytest.approx([0.2 / np.sqrt(2)], rel=1e-9)


def test_below_three_settings_the_error_of_table_5_1_is_assumed() -> None:
    measured = np.array([10.366, 11.872, 13.799, 16.346, 18.973])
    table = rms(np.log(measured / np.array([10.58, 11.35, 14.13, 16.98, 17.53])))
    one = calibrated(np.full(2, 1e5), np.full(2, 0.5), np.array([-0.6, -0.6]))
    two = calibrated(np.array([1e5, 2e5]), np.full(2, 0.5), np.array([-0.6, -0.6]))
    three = calibrated(np.array([1e5, 2e5, 4e5]), np.full(3, 0.5), np.full(3, -0.6))
    assert [one.misfit, two.misfit] == pytest.approx([table, table], abs=5e-4)
    assert three.misfit == pytest.approx(0, abs=1e-12)
    # one setting's level hangs on that setting: its error counts twice, with what it says itself
    assert one.spread(np.array([1e5]), np.array([0.5])) == pytest.approx([np.sqrt(2) * one.misfit], rel=1e-9)


def test_two_settings_that_differ_more_say_so() -> None:
    two = calibrated(np.array([1e5, 2e5]), np.full(2, 0.5), np.array([-0.6, -0.4]))
    assert two.misfit == pytest.approx(0.2, rel=1e-9)  # each predicts the other


@pytest.mark.parametrize(("law", "degree"), [(linear, 1), (bent, 2)])
def test_spread_is_that_of_a_prediction_by_least_squares(law: Callable[[Floats, Floats], Floats], degree: int) -> None:
    """scatter^2 + misfit^2 (1 + x' (X'X)^-1 x), X of the settings."""
    rng = np.random.default_rng(5)
    at = scattered_settings(12, 2)
    p, m = (np.repeat(each, 3) for each in at)
    settings = np.repeat(0.02 * rng.standard_normal(12), 3)
    fitted = calibrated(p, m, law(p, m) + settings + 0.01 * rng.standard_normal(36))
    assert fitted.degree == degree
    design, asked = monomials(degree, *at), scattered_settings(6, 9)
    row = monomials(degree, *asked)
    leverage = np.sum((row @ np.linalg.pinv(design)) ** 2, axis=1)
    expected = np.sqrt(fitted.scatter**2 + fitted.misfit**2 * (1 + leverage))
    assert fitted.spread(*asked) == pytest.approx(expected, rel=1e-6)


def test_nothing_moves_without_pressure_so_nothing_is_corrected() -> None:
    p, m = scattered_settings(12, 4)
    fitted = calibrated(p, m, linear(p, m))
    assert fitted.factor(np.array([0.0, 1e5]), np.array([0.5, 0.5]))[0] == 1
    assert np.isfinite(fitted.spread(np.array([0.0]), np.array([0.5]))).all()


def test_one_mass_goes_with_many_pressures() -> None:
    p, m = scattered_settings(12, 4)
    fitted = calibrated(p, m, bent(p, m))
    assert fitted.factor(p, np.array(0.4)) == pytest.approx(fitted.factor(p, np.full(12, 0.4)), rel=1e-14)


@pytest.mark.parametrize("name", ["tank_pressure_pa", "bullet_mass_kg", "measured_m_s", "predicted_m_s"])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.inf])
def test_what_is_not_positive_is_refused_by_name(name: str, bad: float) -> None:
    given = dict.fromkeys(("tank_pressure_pa", "bullet_mass_kg", "measured_m_s", "predicted_m_s"), np.ones(3))
    with pytest.raises(ValueError, match=name):
        VelocityCalibration.of(**{**given, name: np.array([1.0, bad, 1.0])})
