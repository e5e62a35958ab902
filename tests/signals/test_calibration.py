"""Straight lines through calibration points: published figures, other people's solvers, and what
points may be."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from pyroshock.signals.calibration import Calibration, Line, fit_line

#: GUM (JCGM 100:2008), Table H.6: readings of a thermometer (degrees Celsius) and its corrections.
THERMOMETER_C = [
    21.521,
    22.012,
    22.512,
    23.003,
    23.507,
    23.999,
    24.513,
    25.002,
    25.503,
    26.010,
    26.511,
]
CORRECTION_C = [
    -0.171,
    -0.169,
    -0.166,
    -0.159,
    -0.164,
    -0.165,
    -0.156,
    -0.157,
    -0.159,
    -0.161,
    -0.160,
]
#: Pearson's data with York's weights: York et al. (2004), Table I.
PEARSON_X = [0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4]
PEARSON_Y = [5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5]
WEIGHT_X = [1000.0, 1000.0, 500.0, 800.0, 200.0, 80.0, 60.0, 20.0, 1.8, 1.0]
WEIGHT_Y = [1.0, 1.8, 4.0, 8.0, 20.0, 20.0, 70.0, 70.0, 100.0, 500.0]


def test_published_lines_of_the_gum_and_of_pearson() -> None:
    """Example H.3, with the reference temperature 20 degrees: its equations H.14 a to d and Table
    H.6."""
    line = fit_line(np.array(THERMOMETER_C) - 20.0, CORRECTION_C)
    assert line.offset == pytest.approx(-0.1712, abs=5e-5)
    assert line.offset_u == pytest.approx(0.0029, abs=5e-5)
    assert line.sensitivity == pytest.approx(0.00218, abs=5e-6)
    assert line.sensitivity_u == pytest.approx(0.00067, abs=5e-6)
    assert line.correlation == pytest.approx(-0.930, abs=5e-4)
    assert line.residual_sd == pytest.approx(0.0035, abs=5e-5)
    # H.15: the correction at 30 degrees is -0.1494 with u = 0.0041.
    at_30 = line.offset + line.sensitivity * 10
    assert at_30 == pytest.approx(-0.1494, abs=5e-5)
    calibration = Calibration(line, dt.date(2026, 3, 2), 11)
    assert calibration.uncertainty(10.0) * abs(line.sensitivity) == pytest.approx(0.0041, abs=5e-5)
    # Published: a = 5.47991022, b = -0.480533407; standard errors 0.359246523 and 0.0706202695 once
    # scaled.
    line = fit_line(PEARSON_X, PEARSON_Y, 1 / np.sqrt(WEIGHT_X), 1 / np.sqrt(WEIGHT_Y))
    assert line.offset == pytest.approx(5.47991022, rel=1e-8)
    assert line.sensitivity == pytest.approx(-0.480533407, rel=1e-8)
    assert line.chi_square == pytest.approx(11.8663531941, rel=1e-8)
    assert line.offset_u == pytest.approx(0.3592, abs=2e-3)
    assert line.sensitivity_u == pytest.approx(0.0706, abs=5e-4)


def points(seed: int, x_u: float, y_u: float) -> tuple[np.ndarray, np.ndarray]:
    """Three load-unload cycles from 0 to 4 bar in steps of 1 bar, as the thesis calibrates (section
    2.2.1)."""
    rng = np.random.default_rng(seed)
    bar = np.tile([0, 1, 2, 3, 4, 3, 2, 1], 3).astype(float)
    return bar + x_u * rng.standard_normal(24), 0.3624 + 0.5621 * bar + y_u * rng.standard_normal(
        24
    )


def test_without_uncertainties_of_references_it_is_polyfit() -> None:
    x, y = points(1, 0.0, 2e-3)
    line = fit_line(x, y)
    (slope, offset), covariance = np.polyfit(x, y, 1, cov=True)
    assert (line.sensitivity, line.offset) == pytest.approx((slope, offset), rel=1e-12)
    assert (line.sensitivity_u**2, line.offset_u**2) == pytest.approx(np.diag(covariance), rel=1e-9)
    assert line.covariance == pytest.approx(covariance[0, 1], rel=1e-9)
    x, y = points(2, 0.0, 2e-3)
    y_u = np.linspace(5e-3, 8e-3, 24)  # larger than the scatter: nothing is enlarged
    line = fit_line(x, y, 0.0, y_u)
    (slope, offset), covariance = np.polyfit(x, y, 1, w=1 / y_u, cov="unscaled")
    assert (line.sensitivity, line.offset) == pytest.approx((slope, offset), rel=1e-10)
    assert (line.sensitivity_u**2, line.offset_u**2) == pytest.approx(np.diag(covariance), rel=1e-9)
    assert line.enlarged == 1.0


def test_with_uncertainties_of_both_it_is_the_least_distance() -> None:
    """All true references and the line at once, by `scipy.optimize.least_squares`; covariance from
    its Jacobian."""
    from scipy.optimize import least_squares

    x, y = points(3, 4e-3, 2e-3)
    x_u, y_u = np.linspace(3e-3, 6e-3, 24), np.linspace(3e-3, 1e-3, 24)

    def distances(unknown: np.ndarray) -> np.ndarray:
        offset, slope, true_x = unknown[0], unknown[1], unknown[2:]
        return np.concatenate([(x - true_x) / x_u, (y - offset - slope * true_x) / y_u])

    run = least_squares(distances, [0.3, 0.5, *x], xtol=1e-15, ftol=1e-15, gtol=1e-15)
    jacobian = np.asarray(run.jac)
    covariance = np.linalg.inv(jacobian.T @ jacobian)[:2, :2]
    line = fit_line(x, y, x_u, y_u)
    assert (line.offset, line.sensitivity) == pytest.approx(run.x[:2], rel=1e-6)
    assert line.chi_square == pytest.approx(2 * run.cost, rel=1e-7)
    assert (line.offset_u, line.sensitivity_u) == pytest.approx(
        line.enlarged * np.sqrt(np.diag(covariance)), rel=1e-3
    )


def test_the_truth_lies_within_the_stated_uncertainty_as_often_as_it_says() -> None:
    """Of 400 calibrations, 95 % (92 to 98 %) have the true pressure of a reading at 2.5 bar within
    1.96 u."""
    inside = 0
    for seed in range(400):
        x, y = points(seed, 4e-3, 2e-3)
        calibration = Calibration(fit_line(x, y, 4e-3, 2e-3), dt.date(2026, 3, 2), 24)
        shown = (0.3624 + 0.5621 * 2.5 - calibration.line.offset) / calibration.line.sensitivity
        inside += abs(shown - 2.5) <= 1.96 * calibration.uncertainty(2.5)
    assert 0.92 <= inside / 400 <= 0.985


def test_uncertainty_grows_with_the_scatter_and_with_that_of_the_references() -> None:
    x, y = points(4, 0.0, 2e-3)
    honest, boasting = fit_line(x, y), fit_line(x, y, 0.0, 1e-5)
    assert boasting.enlarged > 100
    assert boasting.sensitivity_u == pytest.approx(honest.sensitivity_u, rel=1e-9)
    line = fit_line(*points(5, 0.0, 2e-3))
    alone, common = (Calibration(line, dt.date(2026, 3, 2), 24, u) for u in (0.0, 0.01))
    assert common.uncertainty(3.0) == pytest.approx(np.hypot(alone.uncertainty(3.0), 0.01))
    calibration = Calibration(
        fit_line(*points(6, 0.0, 2e-3), 1e-3, 1e-3), dt.date(2026, 3, 2), 24, 0.01
    )
    assert Calibration.from_json(calibration.as_json()) == calibration
    assert isinstance(calibration.line, Line)


@pytest.mark.parametrize(
    ("x", "y", "x_u", "words"),
    [
        ([0, 1], [0, 1], 0.0, "2 references and 2 readings; expected as many of both, 3 or more"),
        ([0, 1, 2], [0, 1], 0.0, "3 references and 2 readings"),
        ([1, 1, 1], [0, 1, 2], 0.0, "all references are 1; expected different ones"),
        ([0, 1, 2], [0, 1, np.nan], 0.0, "not finite"),
        ([0, 1, 2], [0, 1, 2], -1.0, "an uncertainty is -1; expected 0 or more"),
        ([0, 1, 2], [0, 1, 2], [0.1, 0.0, 0.1], "point 2 has no uncertainty and others have one"),
    ],
)
def test_points_that_give_no_line_are_refused(
    x: list[float], y: list[float], x_u: float, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        fit_line(x, y, x_u)
