"""The bullet's passage through the laser from signals whose edges, noise and levels are known
exactly."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from pyroshock.ingest.extraction.velocity import (
    NoPassageError,
    muzzle_velocity,
    muzzle_velocity_uncertainty,
)

RATE_HZ = 25_000.0
LENGTH_M = 0.085
#: The free beam and the change by a bullet, V.
LEVELS = [(0.13, -0.048), (0.0, 5.0), (4.2, -3.3), (-2.0, 1e-3)]


def blocked(*spans: tuple[int, int], samples: int = 200, depth: float = 1.0) -> np.ndarray:
    """A beam that is free but from sample to sample of each span, at once."""
    signal = np.zeros(samples)
    for start, stop in spans:
        signal[start:stop] = depth
    return signal


def on_an_edge(edge: ArrayLike) -> np.ndarray:
    """A passage that begins with these samples after 100 free ones, and ends at once between
    samples 199 and 200."""
    edge = np.asarray(edge, dtype=np.float64)
    signal = np.zeros(300)
    signal[100 : 100 + edge.size] = edge
    signal[100 + edge.size : 200] = 1.0
    return signal


def flicker(samples: int) -> np.ndarray:
    """One up, one down: median 0, median deviation 1."""
    return np.where(np.arange(samples) % 2, -1.0, 1.0)


# --- edges, levels and velocity ---


@pytest.mark.parametrize("fraction", [0.0, 0.125, 0.5, 0.75])
def test_both_edges_are_found_at_a_fraction_of_a_sample(fraction: float) -> None:
    """Ramps of eight samples about 150 and 400, each moved by its own fraction."""
    sample = np.arange(600.0)
    shape = np.clip((sample - 150 - fraction) / 8 + 0.5, 0, 1) - np.clip(
        (sample - 400 - fraction / 3) / 8 + 0.5, 0, 1
    )
    result = muzzle_velocity(4.2 - 3.0 * shape, RATE_HZ, LENGTH_M)
    assert result.enter_sample == pytest.approx(150 + fraction, abs=1e-9)
    assert result.leave_sample == pytest.approx(400 + fraction / 3, abs=1e-9)
    transit = (250 - 2 * fraction / 3) / RATE_HZ
    assert result.transit_time_s == pytest.approx(transit, rel=1e-9)
    assert result.velocity_m_s == pytest.approx(LENGTH_M / transit, rel=1e-9)
    assert result.rest_level == pytest.approx(4.2)
    assert result.blocked_level == pytest.approx(1.2)


@pytest.mark.parametrize("seed", range(3))
def test_passage_against_time_has_its_edges_exchanged(seed: int) -> None:
    """Noise on slow edges makes many crossings; the same ones count whichever way the bullet
    flies."""
    shape = np.interp(np.arange(601), [160, 220, 380, 440], [0, 1, 1, 0])
    signal = shape + 0.06 * np.random.default_rng(seed).standard_normal(601)
    signal[:50] = signal[-50:] = 0  # the same rest either way
    there, back = (
        muzzle_velocity(signal, RATE_HZ, LENGTH_M),
        muzzle_velocity(signal[::-1], RATE_HZ, LENGTH_M),
    )
    assert back.enter_sample == pytest.approx(600 - there.leave_sample, abs=1e-9)
    assert back.leave_sample == pytest.approx(600 - there.enter_sample, abs=1e-9)


@pytest.mark.parametrize(("offset", "scale"), [(0.0, -1.0), (2.0, 4.0), (-0.5, -0.25)])
def test_offset_and_scale_of_the_signal_do_not_move_the_edges(offset: float, scale: float) -> None:
    signal = on_an_edge([0.25, 0.375, 0.75, 0.625])
    plain, moved = (
        muzzle_velocity(s, RATE_HZ, LENGTH_M) for s in (signal, offset + scale * signal)
    )
    assert (moved.enter_sample, moved.leave_sample) == (plain.enter_sample, plain.leave_sample)
    assert (moved.rest_level, moved.blocked_level) == (offset, offset + scale)


def test_passage_of_the_outermost_samples_is_whole_and_its_depth_a_median() -> None:
    signal = blocked((100, 160))
    signal[110:120] = 2.0
    assert muzzle_velocity(signal, RATE_HZ, LENGTH_M).blocked_level == 1.0
    # Two free samples at either end are all there is of rest; the bullet is in the beam for the
    # less of 32.
    result = muzzle_velocity(blocked((2, 12), (30, 38), samples=40), RATE_HZ, LENGTH_M)
    assert (result.enter_sample, result.leave_sample) == (1.5, 11.5)
    last = muzzle_velocity(blocked((30, 38), samples=40), RATE_HZ, LENGTH_M)
    assert (last.enter_sample, last.leave_sample) == (29.5, 37.5)


@pytest.mark.parametrize(
    ("edge", "crossings"),
    [
        ([0.1, 0.4, 0.6], [1.5]),
        # Exactly one half on the way up is crossed once.
        ([0.2, 0.3, 0.5, 0.7], [2]),
        # Up, down and up again between the quarters.
        ([0.2, 0.3, 0.55, 0.45, 0.55, 0.65, 0.8], [1.8, 2.5, 3.5]),
        # A spike between the quarters, long before the edge goes on, and a half that is met by a
        # sample.
        ([0.2, 0.3, 0.3, 0.3, 0.8, 0.3, 0.3, 0.3, 0.5, 0.7, 0.8], [3.4, 4.6, 8]),
        # A spike at the last sample below a quarter, a dip at the first above three quarters.
        (
            [0.1, 0.15, 0.9, 0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.1, 0.9, 0.9],
            [22 / 15, 18 / 7, 5.5, 59 / 7, 9.5],
        ),
    ],
)
def test_edge_is_the_mean_of_its_crossings_between_the_quarters(
    edge: list[float], crossings: list[float]
) -> None:
    result = muzzle_velocity(on_an_edge(edge), RATE_HZ, LENGTH_M)
    assert result.enter_sample == pytest.approx(100 + np.mean(crossings), abs=1e-9)
    assert result.leave_sample == pytest.approx(199.5, abs=1e-9)
    back = muzzle_velocity(on_an_edge(edge)[::-1], RATE_HZ, LENGTH_M)
    assert back.enter_sample == pytest.approx(299 - 199.5, abs=1e-9)
    assert back.leave_sample == pytest.approx(299 - 100 - np.mean(crossings), abs=1e-9)


def test_many_crossings_of_a_slow_noisy_edge_are_centred_on_it() -> None:
    rng = np.random.default_rng(6)
    ramp = np.clip((np.arange(1500.0) - 500) / 120 + 0.5, 0, 1) - (np.arange(1500) >= 1000)
    found = [
        muzzle_velocity(ramp + 0.05 * rng.standard_normal(1500), RATE_HZ, LENGTH_M).enter_sample
        for _ in range(60)
    ]
    # The ramp rises by a deviation of the noise in six samples; the first of its crossings is early
    # by as much.
    assert np.std(found) < 2 * 6
    assert np.mean(found) == pytest.approx(500, abs=4 * np.std(found) / math.sqrt(60))


# --- what is a passage ---

#: A robust deviation is 1.4826 times the median one, which is 1 for `flicker`.
NOISE = 1.4826


@pytest.mark.parametrize("margin", [8.1, 30.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_beyond_eight_deviations_at_rest_is_a_passage(margin: float, sign: int) -> None:
    signal = flicker(200)
    signal[100:160] = sign * margin * NOISE
    result = muzzle_velocity(signal, RATE_HZ, LENGTH_M)
    assert result.enter_sample == pytest.approx(99.5, abs=0.1)
    assert result.leave_sample == pytest.approx(159.5, abs=0.1)


@pytest.mark.parametrize("margin", [2.0, 7.9])
@pytest.mark.parametrize("sign", [1, -1])
def test_within_eight_deviations_is_refused_with_its_numbers(margin: float, sign: int) -> None:
    signal = flicker(200)
    signal[100:160] = sign * margin * NOISE
    message = (
        f"no passage: the laser departs from rest by {margin * NOISE:.3g} at most, and its noise "
        "is 1.48; a bullet is expected to exceed 8 times the noise"
    )
    with pytest.raises(NoPassageError, match=f"^{re.escape(message)}$"):
        muzzle_velocity(signal, RATE_HZ, LENGTH_M)


@pytest.mark.parametrize(
    ("signal", "message"),
    [
        *(
            (np.zeros(n), r"departs from rest by 0 at most, and its noise is 0;")
            for n in (0, 1, 500)
        ),
        (blocked((60, 64), (90, 93), (120, 124)), "^no passage: only short spikes$"),
        (
            blocked((60, 64), (90, 93), (120, 124), (150, 200)),
            "^no whole passage: the beam is blocked at sample 150 and not "
            "freed by the record's end, sample 199$",
        ),
        (blocked((0, 12)), "never free on one side"),
    ],
    ids=["nothing", "one sample", "rest", "spikes", "not freed", "begun before"],
)
def test_record_without_a_whole_passage_is_refused(signal: np.ndarray, message: str) -> None:
    with pytest.raises(NoPassageError, match=message):
        muzzle_velocity(signal, RATE_HZ, LENGTH_M)


@pytest.mark.parametrize(
    ("share", "first"), [(0.2, 120), (0.3, 120), (1 / 3, 120), (0.36, 50), (0.6, 50)]
)
def test_passage_is_deeper_than_a_third_of_the_deepest(share: float, first: int) -> None:
    signal = blocked((120, 160), depth=3.0)
    signal[50:90] = 3.0 * share
    result = muzzle_velocity(signal, RATE_HZ, LENGTH_M)
    assert result.enter_sample == pytest.approx(first - 0.5)
    assert result.leave_sample == pytest.approx(first + 39.5)


@pytest.mark.parametrize("samples", range(1, 8))
def test_fewer_than_five_samples_are_a_spike_and_five_a_passage(samples: int) -> None:
    result = muzzle_velocity(blocked((60, 60 + samples), (120, 160)), RATE_HZ, LENGTH_M)
    edges = (59.5, 59.5 + samples) if samples >= 5 else (119.5, 159.5)
    assert (result.enter_sample, result.leave_sample) == edges


@pytest.mark.parametrize(("samples", "rest"), [(200, 32), (1599, 32), (1650, 33), (5000, 100)])
def test_rest_is_the_first_fiftieth_and_32_samples_at_least(samples: int, rest: int) -> None:
    """As many at 0 as at 1: their median is between, and one sample more or less of it is not."""
    signal = np.where(np.arange(samples) < rest // 2, 0.0, 1.0)
    signal[rest // 2 : rest - rest // 2] = 0.5  # the middle one, of an odd number
    signal[120:180] = 100.0
    result = muzzle_velocity(signal, RATE_HZ, LENGTH_M)
    assert result.rest_level == 0.5
    assert result.blocked_level == 100.0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_first_sample_that_is_not_finite_is_named(bad: float) -> None:
    signal = blocked((100, 160))
    signal[[123, 150]] = bad
    with pytest.raises(ValueError, match=r"^laser signal: sample 123 is not finite$"):
        muzzle_velocity(signal, RATE_HZ, LENGTH_M)


# --- uncertainty ---


@pytest.mark.parametrize("length_u_m", [None, 0.0, 2e-3])
def test_uncertainty_adds_length_and_a_sample_in_squares(length_u_m: float | None) -> None:
    """Equation 5.2, by relative uncertainties: a millimetre by default, and one period of the
    sampling."""
    given = {} if length_u_m is None else {"length_u_m": length_u_m}
    result = muzzle_velocity(blocked((100, 150)), RATE_HZ, LENGTH_M, **given)
    relative = math.hypot((1e-3 if length_u_m is None else length_u_m) / LENGTH_M, 1 / 50)
    assert result.velocity_m_s == pytest.approx(LENGTH_M * RATE_HZ / 50)
    assert result.velocity_u_m_s == pytest.approx(result.velocity_m_s * relative, rel=1e-9)


def test_uncertainty_is_the_scatter_of_length_over_time_and_broadcasts() -> None:
    rng = np.random.default_rng(7)
    length, time = np.array([0.085, 0.02]), np.array([5e-3, 1e-3])
    drawn = (length + 5e-4 * rng.standard_normal((100_000, 2))) / (
        time + 2e-5 * rng.standard_normal((100_000, 2))
    )
    spread = muzzle_velocity_uncertainty(length, time, 5e-4, time_u_s=2e-5)
    assert spread == pytest.approx(drawn.std(axis=0), rel=0.02)
    spread = muzzle_velocity_uncertainty(
        [[0.085], [0.02]], [5e-3, 2e-3, 1e-3], [[0.0], [1e-3]], time_u_s=4e-5
    )
    assert spread.shape == (2, 3)
    assert spread[0, 1] == pytest.approx(0.085 * 4e-5 / 2e-3**2)
    assert spread[1, 2] == pytest.approx(math.hypot(1e-3 / 1e-3, 0.02 * 4e-5 / 1e-3**2))


# --- a bullet with its rebound, in noise ---


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


def laser(
    velocity, rng, *, noise=0.0, rest=0.13, depth=-0.048, edge_samples=4.0, enter=5000.3
) -> np.ndarray:
    """One second of a bullet across the beam, ramps of `edge_samples` at its ends, and a slower one
    on its way back."""
    half, transit = edge_samples * np.array([-0.5, 0.5]), LENGTH_M / velocity * RATE_HZ
    edges = (enter, enter + transit, enter + 3 * transit, enter + 7 * transit)
    first, end, again, last = (np.interp(np.arange(25_000), edge + half, [0, 1]) for edge in edges)
    return (
        rest
        + depth * (first - end + again - last)
        + noise * abs(depth) * rng.standard_normal(25_000)
    )


@settings(max_examples=40)
@given(st.floats(5, 80), st.floats(5000, 5001), st.sampled_from(LEVELS), st.floats(0.5, 8.0))
def test_clean_passage_gives_the_velocity(velocity, enter, levels, edge) -> None:
    rng = np.random.default_rng(0)
    signal = laser(velocity, rng, rest=levels[0], depth=levels[1], enter=enter, edge_samples=edge)
    # Between two samples of a sharp edge nothing tells where it lies: half a sample at either end
    # at most.
    transit = LENGTH_M / velocity * RATE_HZ
    assert muzzle_velocity(signal, RATE_HZ, LENGTH_M).velocity_m_s == pytest.approx(
        velocity, rel=0.6 / transit
    )


@pytest.mark.parametrize("depth", [-0.048, 0.048])
def test_noise_moves_the_velocity_less_than_its_uncertainty(
    rng: np.random.Generator, depth: float
) -> None:
    errors = []
    for _ in range(20):
        result = muzzle_velocity(laser(17.0, rng, noise=0.05, depth=depth), RATE_HZ, LENGTH_M)
        errors.append((result.velocity_m_s - 17.0) / result.velocity_u_m_s)
    assert np.abs(errors).max() < 1


def test_first_passage_is_taken_even_when_the_rebound_stays(rng: np.random.Generator) -> None:
    signal = laser(17.0, rng, noise=0.01)
    signal[12_000:] = 0.13 - 0.06
    assert muzzle_velocity(signal, RATE_HZ, LENGTH_M).velocity_m_s == pytest.approx(17.0, rel=5e-3)


def test_uncertainty_is_that_of_table_5_1(thesis_tables: Path) -> None:
    with (thesis_tables / "table_3_1_5_1_gun_shots.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    measured = np.array([float(row["measured_velocity_m_s"]) for row in rows])
    spread = muzzle_velocity_uncertainty(LENGTH_M, LENGTH_M / measured, time_u_s=1 / RATE_HZ)
    # Eq. 5.2 gives 0.1854 m/s for test 4, where 0.18 is printed; the other four round to the
    # printed figures.
    assert spread == pytest.approx(
        [float(row["velocity_uncertainty_m_s"]) for row in rows], abs=0.0055
    )
    assert np.round(spread, 2).tolist() == [0.13, 0.15, 0.28, 0.19, 0.23]
