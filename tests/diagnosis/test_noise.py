"""Scatter of a run: what lines of a channel share counts once, and what they do not share is not
made up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.diagnosis.gap import Noise
from pyroshock.diagnosis.observables.base import Observable

LINES = 24


def observables() -> list[Observable]:
    lines = [
        Observable(f"{channel} {f:.0f} Hz", "plate", channel, "dB", 0.5, 0.15, float(f))
        for channel in ("acceleration_1", "acceleration_2")
        for f in 100 * 2 ** (np.arange(LINES) / 3)
    ]
    return [Observable("ln velocity", "gun", "velocity", "1", 0.01, 0.01), *lines]


def deviations(
    rng: np.random.Generator, shared: float, configurations: int = 8
) -> tuple[np.ndarray, np.ndarray]:
    """Three runs each; every channel is louder as a whole by `shared` dB, its lines by 0.3 dB of
    their own."""
    of = np.repeat(np.arange(configurations), 3)
    loud = shared * rng.standard_normal((len(of), 2))
    lines = np.repeat(loud, LINES, axis=1) + 0.3 * rng.standard_normal((len(of), 2 * LINES))
    values = np.concatenate([0.01 * rng.standard_normal((len(of), 1)), lines], axis=1)
    return values - np.array([values[of == c].mean(axis=0) for c in of]), of


def correlation(noise: Noise) -> np.ndarray:
    sigma = np.sqrt(np.diag(noise.covariance))
    return np.asarray(noise.covariance / np.outer(sigma, sigma))


def within(matrix: np.ndarray, first: slice, second: slice) -> float:
    block = matrix[first, second]
    return float(np.median(block[~np.eye(len(block), dtype=bool)]))


ONE, TWO = slice(1, 1 + LINES), slice(1 + LINES, 1 + 2 * LINES)


def test_a_louder_shot_counts_once() -> None:
    # 16 degrees of freedom for 49 observables: drawn towards none the correlation of 0.92 would be
    # 0.23.
    matrix = correlation(Noise.of(*deviations(np.random.default_rng(1), 1.0), observables()))
    assert within(matrix, ONE, ONE) == pytest.approx(0.92, abs=0.15)
    assert within(matrix, TWO, TWO) == pytest.approx(0.92, abs=0.15)
    assert abs(within(matrix, ONE, TWO)) < 0.35
    matrix = correlation(Noise.of(*deviations(np.random.default_rng(2), 0.0), observables()))
    assert abs(within(matrix, ONE, ONE)) < 0.1
    # What a gain is read from: the variance of a channel's mean line, over campaigns.
    ratio = []
    weight = np.zeros(1 + 2 * LINES)
    weight[ONE] = 1 / LINES
    for seed in range(40):
        noise = Noise.of(*deviations(np.random.default_rng(seed), 0.8), observables())
        ratio.append(weight @ noise.covariance @ weight / (0.8**2 + 0.3**2 / LINES))
    assert np.mean(ratio) == pytest.approx(
        0.87, abs=0.15
    )  # the data sheet and the weight of "none" take a part


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.floats(0, 3), st.integers(1, 6), st.floats(0, 0.4))
def test_covariance_is_one(seed: int, shared: float, configurations: int, lost: float) -> None:
    """Symmetric, and positive but for what pairs with different gaps do to it."""
    rng = np.random.default_rng(seed)
    values, of = deviations(rng, shared, configurations)
    values[rng.random(values.shape) < lost] = np.nan
    noise = Noise.of(values, of, observables())
    assert np.allclose(noise.covariance, noise.covariance.T)
    matrix = correlation(noise)
    assert np.all(np.abs(matrix) <= 1 + 1e-9)
    if lost == 0:
        assert np.linalg.eigvalsh(matrix).min() > -1e-9


def plain(*floors: float, frequency_hz: float | None = None) -> list[Observable]:
    return [
        Observable(f"{i}", "plate", "force", "dB", 1.0, floor, frequency_hz)
        for i, floor in enumerate(floors)
    ]


def test_variance_is_drawn_to_the_data_sheet() -> None:
    # (nu s^2 + 3 f^2) / (nu + 3), of runs that are there.
    deviations = np.array(
        [[1.0, 2.0], [-1.0, np.nan], [0.5, -2.0], [-0.5, np.nan], [np.nan, np.nan]]
    )
    noise = Noise.of(deviations, np.array([0, 0, 1, 1, 2]), plain(0.5, 0.1))
    assert noise.freedom.tolist() == [2.0, 0.0]
    assert np.diag(noise.covariance) == pytest.approx([(2.5 + 3 * 0.25) / 5, (8 + 3 * 0.01) / 3])
    assert not noise.assumed
    noise = Noise.of(np.zeros((3, 2)), np.arange(3), plain(0.5, 0.1))
    assert noise.assumed
    assert noise.covariance == pytest.approx(np.diag([0.25, 0.01]))


PAIRS = np.array([0, 0, 1, 1, 2, 2, 3, 3])


def mirrored(*rows: list[float]) -> np.ndarray:
    """Deviations of two runs to a configuration: each row, and its negative."""
    return np.array([each for row in rows for each in (row, [-x for x in row])])


def test_correlations_of_single_observables_are_drawn_to_none() -> None:
    # nu / (nu + D) of it, and as much of the rest again: here two thirds of r = 0.6 and two thirds
    # of a third.
    noise = Noise.of(mirrored([2, 2], [1, -1], [0, 0], [0, 0]), PAIRS, plain(0.1, 0.1))
    assert noise.freedom.tolist() == [4.0, 4.0]
    assert correlation(noise)[0, 1] == pytest.approx(0.6 * 2 / 3 * 4 / 3)
    # nu = 1: a third of r = 1, and a third of the other two thirds.
    noise = Noise.of(
        np.array([[1.0, 2.0], [-1.0, -2.0]]), np.zeros(2, dtype=np.intp), plain(0.1, 0.1)
    )
    assert not noise.assumed
    assert correlation(noise)[0, 1] == pytest.approx(5 / 9)


def test_correlations_of_lines_are_drawn_to_their_mean() -> None:
    # nu = 4, three lines, one channel: 4/7 of their own, 3/7 of the mean, of which 1/5 is drawn to
    # none.
    noise = Noise.of(
        mirrored([2, 2, 2], [1, -1, 1], [0, 0, 0], [0, 0, 0]),
        PAIRS,
        plain(*[0.1] * 3, frequency_hz=400.0),
    )
    mean = (0.6 + 1.0 + 0.6) / 3
    expected = [4 / 7 * own + 3 / 7 * 0.8 * mean for own in (0.6, 1.0, 0.6)]
    matrix = correlation(noise)
    assert [matrix[0, 1], matrix[0, 2], matrix[1, 2]] == pytest.approx(expected)
    noise = Noise.of(
        mirrored([2, -2], [1, 1], [0, 0], [0, 0]), PAIRS, plain(0.1, 0.1, frequency_hz=400.0)
    )
    assert correlation(noise)[0, 1] == pytest.approx(-0.6 * 2 / 3)


def test_means_that_no_covariance_has_are_drawn_to_one_that_is() -> None:
    """Two lines that oppose each other and go both with a third: of [[1, c], [c, 0]] the positive
    part is left."""
    single = Observable("u", "gun", "velocity", "1", 1.0, 0.1)
    noise = Noise.of(
        mirrored([1, 1, -0.2], [1, -0.2, 1], [1, 1, -0.2], [1, -0.2, 1]),
        PAIRS,
        [single, *plain(0.1, 0.1, frequency_hz=400.0)],
    )
    with_third, apart = 0.8 / np.sqrt(2 * 1.04), -0.4 / 1.04
    c = with_third * 4 / 6
    root = (1 + np.sqrt(1 + 4 * c**2)) / 2
    part = root / (root**2 + c**2) * np.array([[root**2, root * c], [root * c, c**2]])
    cross, within_lines = part[0, 1] / np.sqrt(part[0, 0]), part[1, 1]
    matrix = correlation(noise)
    assert matrix[0, 1:] == pytest.approx(4 / 7 * with_third + 3 / 7 * cross)
    assert matrix[1, 2] == pytest.approx(4 / 7 * apart + 3 / 7 * within_lines)


def test_channels_share_what_their_lines_do_on_the_mean() -> None:
    """nu = 4, four lines of two channels: half of their own, half of the mean of which 1/3 is drawn
    to none."""
    lines = [
        Observable(f"{c} {f}", "plate", c, "dB", 1.0, 0.1, f)
        for c in ("a", "b")
        for f in (100.0, 200.0)
    ]
    noise = Noise.of(
        mirrored([2, 2, 2, 2], [1, 1, -1, -1], [0, 1, 0, 0], [0, 0, 0, 0]), PAIRS, lines
    )
    a, between = 5 / np.sqrt(30), (3 / 5 + 3 / np.sqrt(30)) / 2  # of the norms: 5, 6 and twice 5
    matrix = correlation(noise)
    assert matrix[0, 1] == pytest.approx(a / 2 + a * 2 / 3 / 2)
    assert matrix[0, 2:] == pytest.approx(0.6 / 2 + between * 2 / 3 / 2)
    assert matrix[1, 2:] == pytest.approx(3 / np.sqrt(30) / 2 + between * 2 / 3 / 2)
    assert matrix[2, 3] == pytest.approx(1 / 2 + 2 / 3 / 2)


def campaign_of(
    rng: np.random.Generator, scatter: np.ndarray, runs: int = 3
) -> tuple[np.ndarray, np.ndarray]:
    """Deviations (R, 1) from the means of configurations with these standard deviations, and their
    configurations."""
    drawn = scatter[:, None] * rng.standard_normal((len(scatter), runs))
    return (drawn - drawn.mean(axis=1, keepdims=True)).reshape(-1, 1), np.repeat(
        np.arange(len(scatter)), runs
    )


def test_configurations_are_pooled_where_they_scatter_alike() -> None:
    # And leaves that of the others as it is: 0.02 in the mean of the variances, not 0.19.
    rng, scatter = np.random.default_rng(4), np.full(12, 0.02)
    scatter[5] = 0.65
    noises = [Noise.of(*campaign_of(rng, scatter), plain(0.02)) for _ in range(40)]
    assert np.sqrt(np.mean([noise.covariance[0, 0] for noise in noises])) == pytest.approx(
        0.02, rel=0.15
    )
    own = np.array([noise.relative[5, 0] for noise in noises])
    assert np.median(own) == pytest.approx(
        0.65 / 0.02, rel=0.5
    )  # two degrees of freedom, drawn to the others
    assert all(noise.relative[np.arange(12) != 5].max() == 1.0 for noise in noises)
    # A false alarm in one campaign of a thousand.
    rng = np.random.default_rng(5)
    noises = [Noise.of(*campaign_of(rng, np.full(12, 0.02)), plain(0.02)) for _ in range(300)]
    assert sum(noise.relative.max() > 1.0 for noise in noises) <= 3
