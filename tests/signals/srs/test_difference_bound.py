"""The bound from differences of a record: its numbers against transforms, and itself against the
true spectrum."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.array_types import Floats
from pyroshock.signals.srs import difference_bound
from pyroshock.signals.srs.difference_bound import MOST_DAMPING, MOST_LINE, hidden_by_differences
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from support.records.random_shocks import FINER, RATE_HZ, random_lines, random_shock

#: Frequencies of a transform, rad a sample.
OMEGA = 2 * np.pi * np.fft.fftfreq(1 << 16)
STEP = np.fft.fftfreq(OMEGA.size, 1 / OMEGA.size)
#: Of second differences, with the sign of the second derivative turned.
GAIN_OF_D2 = 2 - 2 * np.cos(OMEGA)


def oscillator(omega: Floats, line: float, zeta: float) -> NDArray[np.complex128]:
    ratio = omega / line
    return (1 + 2j * zeta * ratio) / (1 - ratio**2 + 2j * zeta * ratio)


def over(function: NDArray[Any], divisor: Floats) -> NDArray[Any]:
    """About 0, where both vanish, the quotient has its value beside it."""
    beside = np.abs(OMEGA) >= 1e-3
    quotient = np.divide(function, divisor, out=np.zeros_like(function), where=beside)
    quotient[~beside] = quotient[1:][beside[1:]][0].real
    return quotient


def rest(
    function: NDArray[np.complex128], scale: float, decaying: float, line: float, zeta: float
) -> float:
    """What the series of a function of frequency has beyond a decaying part of so much, all
    together, over `scale`."""
    function = function.copy()
    function[OMEGA.size // 2] = function[
        OMEGA.size // 2
    ].real  # of both signs of half the sampling rate
    series = np.abs(np.fft.ifft(function)) / scale
    decay = np.exp(-zeta * line * np.maximum(STEP, 0)) / np.sqrt(1 - zeta**2)
    return float(np.where(STEP >= 0, np.maximum(series - decaying * decay, 0), series).sum())


@pytest.mark.parametrize("zeta", [0.005, 0.05, MOST_DAMPING])
@pytest.mark.parametrize("line", [0.1, 0.4, MOST_LINE])
def test_numbers_bound_the_functions_of_frequency(line, zeta):
    lost = over(1 - np.sinc(OMEGA / (2 * np.pi)) ** 2, GAIN_OF_D2)
    derivative = over(OMEGA**2, GAIN_OF_D2)
    others = [OMEGA + 2 * np.pi * m for m in range(-40, 41) if m]
    images = np.sum([oscillator(image, line, zeta) / image**2 for image in others], axis=0)
    response = oscillator(OMEGA, line, zeta)
    assert (
        rest(lost * response - images, line, difference_bound.STRAIGHT, line, zeta)
        < difference_bound.STRAIGHT_REST
    )
    assert rest(images, line, 0.0, line, zeta) < difference_bound.IMAGES
    of_d4 = over(lost * response - 1 / 12, GAIN_OF_D2)
    assert (
        rest(of_d4, 1 / line, difference_bound.STRAIGHT, line, zeta)
        < difference_bound.STRAIGHT_REST_OF_D4
    )
    for shift in (0.0, 0.25, 0.5, 0.75):
        moved = derivative * response * np.exp(1j * OMEGA * shift)
        assert rest(moved, line, difference_bound.BESIDE, line, zeta) < difference_bound.BESIDE_REST
        of_d4 = over(moved - (1 - shift) - shift * np.exp(1j * OMEGA), GAIN_OF_D2)
        assert (
            rest(of_d4, 1 / line, difference_bound.BESIDE, line, zeta)
            < difference_bound.BESIDE_REST_OF_D4
        )
    assert np.abs(np.fft.ifft(derivative)).sum() < difference_bound.DERIVATIVE
    assert np.abs(np.fft.ifft(over(lost, derivative))).sum() < difference_bound.STRAIGHT_OF_A2


def errors_and_bounds(records: int, seed: int) -> Floats:
    """Of lines of random records at 2 to 16 times the rate of the content: the error, the bound,
    and what content above half the sampling rate may add to it, as shares of the maximax, (3,
    lines)."""
    rng, rows = np.random.default_rng(seed), []
    for _ in range(records):
        shock, q, times = (
            random_shock(rng),
            float(rng.choice([5.0, 10.0, 50.0])),
            int(rng.choice([2, 4, 8, 16])),
        )
        lines = random_lines(rng, shock.duration_s) * float(
            rng.choice([0.25, 1.0, 1.0 * times / 2])
        )
        lines = lines[lines < FINER * RATE_HZ / 20]
        record, rate = shock.record(times), times * RATE_HZ
        spectrum = shock_response_spectrum(record, rate, lines, q=q, resample_within=None)
        maximax = spectrum.maximax
        error = np.abs(maximax - shock.maximax(lines, q))
        bound = hidden_by_differences(record[None], rate, lines, 1 / (2 * q), maximax[None])[0]
        shares = zip(error / maximax, bound / maximax, spectrum.unseen_error, strict=True)
        rows += [row for row in shares if np.isfinite(row[1])]
    return np.array(rows).T


def test_bound_holds_for_random_records():
    error, bound, _ = errors_and_bounds(60, 11)
    assert error.size > 200
    assert np.all(error <= bound)
    assert np.mean(bound < 0.01) > 0.3


@pytest.mark.slow
def test_bound_holds_for_each_of_two_thousand_records():
    """Pulses that begin with a jump of the slope have content above any half sampling rate."""
    error, bound, unseen = errors_and_bounds(2000, 90_217)
    print(
        f"\n{np.sum(error > bound)} of {error.size} lines are off by more than the bound alone; "
        f"bound over error {np.median(bound / np.maximum(error, 1e-12)):.1f} in the median"
    )
    assert np.all(error <= bound + unseen)
    assert np.mean(error > bound) < 0.001


def test_bound_says_nothing_of_fast_lines_high_damping_and_short_records():
    record = np.hanning(2000)[None]
    maximax = np.ones((1, 2))
    lines = np.array([100.0, 0.15 * RATE_HZ])
    assert np.isfinite(
        hidden_by_differences(record, RATE_HZ, lines, 0.05, maximax)[0]
    ).tolist() == [True, False]
    assert np.all(np.isinf(hidden_by_differences(record, RATE_HZ, lines, 0.2, maximax)))
    assert np.all(
        np.isinf(hidden_by_differences(record[:, :10].copy(), RATE_HZ, lines, 0.05, maximax))
    )


@pytest.mark.parametrize("samples", [16, 17, 31, 300, 1003])
def test_sums_are_at_least_those_of_every_sample(samples):
    """At one line, whose sums decay at its own rate, against the definition."""
    zeta, line = 0.05, 0.5
    rng = np.random.default_rng(samples)
    record = rng.normal(size=samples) * np.hanning(samples)
    bound = hidden_by_differences(
        record[None], 2 * np.pi / line, np.ones(1), zeta, np.full((1, 1), 1e6)
    )[0, 0]
    d2 = np.abs(np.diff(np.concatenate((np.zeros(2), record, np.zeros(2))), 2))
    total = most = 0.0
    for value in d2:
        total = value + np.exp(-zeta * line) * total
        most = max(most, total)
    growth = 1 / np.sqrt(1 - zeta**2)
    parts = difference_bound.STRAIGHT + difference_bound.BESIDE / 8
    rests = difference_bound.STRAIGHT_REST + difference_bound.BESIDE_REST / 8
    least = line * (parts * growth * most + rests * d2[2:-2].max())
    assert least <= bound <= 3 * least
