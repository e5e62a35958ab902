"""The impactor's velocity from contacts that are polynomials, which splines and fits must give back
exactly."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyroshock.ingest.extraction.velocity import impact_velocity

RATE_HZ = 51_200.0
HEIGHT = 30.0
#: Sample in whose neighbourhood the contacts have their peak, and samples of a record.
PEAK, SAMPLES = 300, 400


def parabola(
    top: float, half_width: float, *, height: float = HEIGHT, samples: int = SAMPLES
) -> np.ndarray:
    """A contact that begins `half_width` before its peak, and goes on below zero after it."""
    x = (np.arange(samples) - top) / half_width
    return np.where(x > -1, height * (1 - x**2), 0.0)


def skewed(
    onset: float, length: float, *, height: float = HEIGHT, samples: int = SAMPLES
) -> np.ndarray:
    """A cubic contact: its peak is after a third of its length, its integral until then 11/48 of
    height and length."""
    x = (np.arange(samples) - onset) / length
    return np.where((x > 0) & (x < 1), height * 27 / 4 * x * (1 - x) ** 2, 0.0)


def high_samples(values: np.ndarray, peak: int) -> np.ndarray:
    """Samples about the peak that are not below seven tenths of it; the peak's neighbours at
    least."""
    low = np.flatnonzero(values < 0.7 * values[peak])
    begin = max(low[low < peak], default=-1) + 1
    end = min(low[low > peak], default=values.size) - 1
    return np.arange(min(begin, peak - 1), max(end, peak + 1) + 1)


def uncertainty(
    values: np.ndarray,
    peak: int,
    noise: float,
    onset: float,
    top: float,
    *,
    velocity_share: float = 0.0,
) -> float:
    """By hand: about the top, the slope of a fit is one of its coefficients, and moves the top by
    slope/curvature."""
    at = high_samples(values, peak)
    degree = 3 if at.size >= 5 else 2
    fit, covariance = np.polyfit(at - top, values[at], degree, cov="unscaled")
    jitter = noise * math.sqrt(covariance[-2, -2]) / abs(2 * fit[-3])
    tenth = 0.1 / math.sqrt(12)
    parts = [noise * math.sqrt(top - onset), values[peak] * jitter, values[peak] * tenth]
    return math.hypot(math.hypot(*parts) / RATE_HZ, velocity_share)


# --- exact contacts ---


@pytest.mark.parametrize("noise", [0.0, 0.03])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("onset", "length"), [(290.3, 30.0), (285.8, 42.0), (296.2, 13.0), (280.55, 60.0)]
)
def test_cubic_contact_is_integrated_exactly(
    onset: float, length: float, sign: int, noise: float
) -> None:
    values = skewed(onset, length)
    peak = int(values.argmax())
    result = impact_velocity(sign * values, RATE_HZ, int(onset) - 1, peak, noise_m_s2=noise)
    top = onset + length / 3
    assert result.onset_sample == pytest.approx(onset, abs=1e-7)
    assert result.end_of_compression_sample == pytest.approx(top, abs=1e-7)
    assert result.velocity_m_s == pytest.approx(HEIGHT * length * 11 / 48 / RATE_HZ, rel=1e-9)
    assert result.velocity_u_m_s == pytest.approx(
        uncertainty(values, peak, noise, onset, top), rel=1e-6
    )


@pytest.mark.parametrize(
    ("beside", "half_width", "high"),
    [
        (0.1, 1.3, 1),
        (0.4, 1.7, 2),
        (0.2, 2.6, 3),
        (0.4, 3.4, 4),
        (0.1, 4.2, 5),
        (0.46, 5.0, 6),
        (-0.3, 20.2, 22),
    ],
)
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize("height", [HEIGHT, 0.5])
def test_few_samples_of_a_parabola_are_enough(
    beside: float, half_width: float, high: int, noise: float, height: float
) -> None:
    """However few are above seven tenths of the peak; its neighbours are taken in any case."""
    values = parabola(PEAK + beside, half_width, height=height)
    assert np.count_nonzero(values >= 0.7 * values[PEAK]) == high
    noise *= height / HEIGHT
    onset, top = PEAK + beside - half_width, PEAK + beside
    result = impact_velocity(values, RATE_HZ, math.floor(onset) - 2, PEAK, noise_m_s2=noise)
    assert result.onset_sample == pytest.approx(onset, abs=1e-7)
    assert result.end_of_compression_sample == pytest.approx(top, abs=1e-7)
    assert result.velocity_m_s == pytest.approx(height * half_width * 2 / 3 / RATE_HZ, rel=1e-9)
    assert result.velocity_u_m_s == pytest.approx(
        uncertainty(values, PEAK, noise, onset, top), rel=1e-6
    )


def test_gain_uncertainty_adds_in_squares() -> None:
    values = skewed(290.3, 30.0)
    velocity = HEIGHT * 30 * 11 / 48 / RATE_HZ
    result = impact_velocity(
        values, RATE_HZ, 289, int(values.argmax()), noise_m_s2=0.1, gain_u=0.04
    )
    expected = uncertainty(
        values, int(values.argmax()), 0.1, 290.3, 300.3, velocity_share=0.04 * velocity
    )
    assert result.velocity_u_m_s == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("onset", "length"), [(290.3, 30.0), (296.2, 13.0)])
def test_end_of_compression_is_found_above_seven_tenths_alone(onset: float, length: float) -> None:
    values = skewed(onset, length)
    bent = np.where(values < 0.7 * values.max(), values / 2, values)
    result = impact_velocity(bent, RATE_HZ, int(onset) - 1, int(values.argmax()), noise_m_s2=0.0)
    assert result.end_of_compression_sample == pytest.approx(onset + length / 3, abs=1e-7)


@pytest.mark.parametrize(("onset", "length"), [(290.3, 30.0), (285.8, 42.0)])
def test_what_follows_the_peak_is_not_used(onset: float, length: float) -> None:
    """But for three samples beyond the high ones, by which the spline is smooth at the peak."""
    values = skewed(onset, length)
    peak = int(values.argmax())
    cut = values.copy()
    cut[high_samples(values, peak)[-1] + 4 :] = np.nan
    plain, with_gap = (
        impact_velocity(v, RATE_HZ, int(onset) - 1, peak, noise_m_s2=0.1) for v in (values, cut)
    )
    assert with_gap == plain


def test_what_precedes_the_onset_is_not_used() -> None:
    values = skewed(290.3, 30.0)
    peak = int(values.argmax())
    noisy = values.copy()
    noisy[:288] = 1e3 * np.cos(np.arange(288))
    noisy[289:291] = 0.004 * HEIGHT, -0.3 * HEIGHT  # within the contact, below its threshold
    plain, after = (impact_velocity(v, RATE_HZ, 289, peak, noise_m_s2=0.0) for v in (values, noisy))
    assert after == plain


# --- onset ---


@pytest.mark.parametrize(
    ("noise", "foot", "begun"),
    [
        (n, share, begun)
        for n, low, high in ((0.0, 0.0049, 0.0051), (0.01, 0.039, 0.041), (0.001, 0.0049, 0.0051))
        for share, begun in ((low, False), (high, True))
    ],
)
def test_contact_begins_above_a_share_of_its_peak_or_four_deviations(
    noise: float, foot: float, begun: bool
) -> None:
    """All as shares of the peak; the contact is a parabola of 40 samples but for the sample before
    it."""
    values = parabola(PEAK, 19.4)
    values[PEAK - 20] = foot * HEIGHT
    onset = impact_velocity(
        values, RATE_HZ, PEAK - 25, PEAK, noise_m_s2=noise * HEIGHT
    ).onset_sample
    if begun:
        assert PEAK - 21 <= onset < PEAK - 20
    else:
        assert onset == pytest.approx(PEAK - 19.4, abs=1e-7)


@pytest.mark.parametrize(("noise", "threshold"), [(0.0, 0.005 * HEIGHT), (0.1, 0.4)])
def test_sample_at_the_threshold_is_not_above_it(noise: float, threshold: float) -> None:
    values = parabola(PEAK, 19.4)
    values[PEAK - 20] = threshold
    onset = impact_velocity(values, RATE_HZ, PEAK - 25, PEAK, noise_m_s2=noise).onset_sample
    assert onset == pytest.approx(PEAK - 19.4, abs=1e-7)


def test_contact_that_rises_within_one_sample_begins_in_it() -> None:
    values = np.zeros(SAMPLES)
    values[PEAK - 1 : PEAK + 6] = np.array([0.003, 1.0, 0.9, 0.75, 0.6, 0.3, 0.1]) * HEIGHT
    result = impact_velocity(values, RATE_HZ, PEAK - 1, PEAK, noise_m_s2=0.0)
    assert PEAK - 1 <= result.onset_sample < PEAK


@pytest.mark.parametrize("missing", [1.2, 1.7, 2.6])
def test_onset_is_at_most_a_sample_before_the_first_one_above(missing: float) -> None:
    """A parabola whose first samples read nothing: from one sample before the others on, it is
    integrated."""
    half_width = 20.0
    top = PEAK + 0.3
    first_above = math.ceil(top - half_width + missing)
    values = np.where(np.arange(SAMPLES) < first_above, 0.0, parabola(top, half_width))
    result = impact_velocity(values, RATE_HZ, first_above - 5, PEAK, noise_m_s2=0.0)
    compression = top - (first_above - 1)
    area = HEIGHT * (compression - compression**3 / (3 * half_width**2))
    assert result.onset_sample == first_above - 1
    assert result.velocity_m_s == pytest.approx(area / RATE_HZ, rel=1e-9)


# --- the peak, where it is not as it should be ---


@pytest.mark.parametrize("beside", [-0.6, 0.6])
def test_top_beyond_the_given_peak_is_found(beside: float) -> None:
    """The sample that is called the peak is the second highest of three."""
    values = parabola(PEAK + beside, 2.0)
    assert values[PEAK] < values.max()
    result = impact_velocity(values, RATE_HZ, PEAK - 5, PEAK, noise_m_s2=0.0)
    assert result.end_of_compression_sample == pytest.approx(PEAK + beside, abs=1e-7)


@pytest.mark.parametrize("beside", [-1.4, 1.4])
def test_top_outside_the_samples_is_not_believed(beside: float) -> None:
    """A record that begins, or ends, at the sample beside the one that is called the peak."""
    values = parabola(PEAK + beside, 20.0)
    record = values[PEAK - 1 :] if beside < 0 else values[: PEAK + 2]
    peak = 1 if beside < 0 else PEAK
    result = impact_velocity(record, RATE_HZ, 0 if beside < 0 else PEAK - 30, peak, noise_m_s2=0.1)
    assert result.end_of_compression_sample == peak
    at_the_peak = uncertainty(record, peak, 0.1, result.onset_sample, peak)
    assert result.velocity_u_m_s == pytest.approx(at_the_peak, rel=1e-6)


@pytest.mark.parametrize("height", [1.0, HEIGHT])
@pytest.mark.parametrize(
    "about",
    [
        [1.0, 0.9, 1.0],  # curves up
        [0.99, 0.98, 1.0, 1.04, 1.15],  # a cubic that curves up at the peak, its maximum elsewhere
        [1 + 0.01 * (x - x**2 / 2 + x**3 / 3) for x in range(-2, 3)],  # curves down, and only rises
    ],
)
def test_samples_without_a_top_leave_it_at_the_peak(about: list[float], height: float) -> None:
    values = np.zeros(SAMPLES)
    values[PEAK - len(about) // 2 :][: len(about)] = np.array(about) * height
    result = impact_velocity(values, RATE_HZ, PEAK - 10, PEAK, noise_m_s2=0.0)
    assert result.end_of_compression_sample == PEAK


def test_clipped_contact_ends_somewhere_on_its_plateau() -> None:
    """Nine samples alike: the end of compression may be any of them, and its uncertainty is all
    nine."""
    values = np.zeros(SAMPLES)
    values[PEAK - 4 : PEAK + 5] = HEIGHT
    result = impact_velocity(values, RATE_HZ, PEAK - 5, PEAK, noise_m_s2=0.1)
    assert PEAK - 4 <= result.end_of_compression_sample <= PEAK + 4
    along = 0.1 * math.sqrt(result.end_of_compression_sample - result.onset_sample)
    expected = math.hypot(along, HEIGHT * 9, HEIGHT * 0.1 / math.sqrt(12)) / RATE_HZ
    assert result.velocity_u_m_s == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("samples_before", [3, 5])
def test_record_may_begin_above_seven_tenths(samples_before: int) -> None:
    values = parabola(PEAK + 0.2, 20.0)[PEAK - samples_before :]
    result = impact_velocity(values, RATE_HZ, 0, samples_before, noise_m_s2=0.1)
    top = samples_before + 0.2
    assert result.end_of_compression_sample == pytest.approx(top, abs=1e-7)
    assert result.onset_sample == -1
    assert result.velocity_u_m_s == pytest.approx(
        uncertainty(values, samples_before, 0.1, -1, top), rel=1e-6
    )


@pytest.mark.parametrize("samples_after", [1, 2, 4])
def test_record_may_end_above_seven_tenths(samples_after: int) -> None:
    values = parabola(PEAK + 0.2, 20.0)[: PEAK + 1 + samples_after]
    onset, top = PEAK - 19.8, PEAK + 0.2
    result = impact_velocity(values, RATE_HZ, PEAK - 25, PEAK, noise_m_s2=0.1)
    assert result.end_of_compression_sample == pytest.approx(top, abs=1e-7)
    assert result.velocity_m_s == pytest.approx(HEIGHT * 20 * 2 / 3 / RATE_HZ, rel=1e-9)
    assert result.velocity_u_m_s == pytest.approx(
        uncertainty(values, PEAK, 0.1, onset, top), rel=1e-6
    )


@pytest.mark.parametrize(("first", "peak"), [(-1, 5), (5, 5), (6, 5), (10, 99), (10, 120)])
def test_impossible_contact_is_refused_with_its_limits(first: int, peak: int) -> None:
    message = f"contact from {first} to peak {peak}: expected 0 <= first < peak < 99"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        impact_velocity(np.ones(100), RATE_HZ, first, peak, noise_m_s2=0.0)


# --- noise before the contact ---


def with_quiet(quiet: np.ndarray, first: int) -> np.ndarray:
    """A contact that begins after `first`, and before it four samples at zero after the quiet
    ones."""
    values = skewed(first + 0.5, 30.0)
    values[first - 4 - quiet.size : first - 4] = quiet
    return values


def test_noise_is_that_of_the_quiet_samples_that_end_four_before_the_contact() -> None:
    """A hundred by one and a hundred by four either way: the median deviation is between, unless
    one is missed."""
    quiet = np.resize([1.0, -1.0, 4.0, -4.0], 200)
    values = with_quiet(quiet, 290)
    values[: 290 - 204] = 50.0
    peak = 290 + int(values[290:].argmax())
    estimated = impact_velocity(values, RATE_HZ, 290, peak)
    assert estimated == impact_velocity(values, RATE_HZ, 290, peak, noise_m_s2=1.4826 * 2.5)
    values = with_quiet(np.resize([1.0, -1.0, 4.0, -4.0], 16), 20)
    peak = int(values.argmax())
    given = impact_velocity(values, RATE_HZ, 20, peak, noise_m_s2=1.4826 * 2.5)
    assert impact_velocity(values, RATE_HZ, 20, peak) == given


@pytest.mark.parametrize(("first", "quiet"), [(0, 0), (2, 0), (4, 0), (5, 1), (19, 15)])
def test_fewer_than_sixteen_quiet_samples_are_refused(first: int, quiet: int) -> None:
    values = skewed(first + 0.5, 30.0)
    message = (
        f"{quiet} samples before the contact at {first}: give `noise_m_s2`, or at least 16 samples"
    )
    with pytest.raises(ValueError, match=f"^{message}$"):
        impact_velocity(values, RATE_HZ, first, int(values.argmax()))
    assert (
        impact_velocity(values, RATE_HZ, first, int(values.argmax()), noise_m_s2=0.1).velocity_m_s
        > 0
    )


# --- half sines and Hertz's contact ---


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


#: Shape, and its integral up to the peak for unit height and unit contact time.
HALF_SINE, HERTZ = 1.0, 1.5


AREA = {
    # integral of sin(pi t)^p from 0 to 1/2, by the beta function
    power: math.gamma((power + 1) / 2) / (2 * math.sqrt(math.pi) * math.gamma(power / 2 + 1))
    for power in (HALF_SINE, HERTZ)
}


def contact(
    power: float, samples: float, phase: float, *, quiet: int = 220
) -> tuple[np.ndarray, int, int]:
    """Deceleration of unit height that lasts `samples`, with `first` and `peak` as segmentation
    gives them."""
    x = np.arange(quiet + math.ceil(samples) + 20) - quiet - phase
    inside = (x > 0) & (x < samples)
    pulse = np.where(inside, np.sin(np.pi * np.clip(x / samples, 0, 1)) ** power, 0.0)
    peak = int(pulse.argmax())
    return pulse, int(np.flatnonzero(pulse[:peak] <= 0.005)[-1]), peak


@settings(max_examples=60)
@given(st.sampled_from([HALF_SINE, HERTZ]), st.floats(10, 60), st.floats(0, 0.999))
@example(HALF_SINE, 32.0, 0.0)  # symmetric about a sample
@example(HALF_SINE, 13.0, 0.5)
@example(HERTZ, 35.0, 0.5)  # two samples share the peak
def test_integral_is_the_known_velocity(power: float, samples: float, phase: float) -> None:
    pulse, first, peak = contact(power, samples, phase)
    rate, height = 51_200.0, 3e4
    result = impact_velocity(height * pulse, rate, first, peak)
    assert result.velocity_m_s == pytest.approx(height * AREA[power] * samples / rate, rel=0.01)


@pytest.mark.parametrize("power", [HALF_SINE, HERTZ])
@pytest.mark.parametrize("samples", [10, 20, 40])
@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_uncertainty_covers_the_scatter(
    rng: np.random.Generator, power: float, samples: float, noise: float
) -> None:
    scores = []
    for _ in range(150):
        pulse, first, peak = contact(power, samples, rng.random())
        noisy = pulse + noise * rng.standard_normal(pulse.size)
        peak = peak - 2 + int(noisy[peak - 2 : peak + 3].argmax())
        result = impact_velocity(noisy, 1.0, first, peak, noise_m_s2=noise)
        scores.append((result.velocity_m_s - AREA[power] * samples) / result.velocity_u_m_s)
    # A tenth of a sample for the interpolation is generous at low noise.
    assert 0.3 < float(np.std(scores)) < 1.4
