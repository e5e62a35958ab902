"""Spectra against solutions on paper."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from scipy.optimize import minimize_scalar

ZETA = 0.05
#: Amplitude (g) and duration (s) of a half sine, frequencies (Hz), and the maximax (g) there for Q
#: = 10.
PULSES = {
    "50 g, 11 ms": (
        50.0,
        11e-3,
        (10, 20, 50, 80, 100, 200, 500, 1000),
        (20.2588, 39.1556, 76.3143, 82.4137, 79.5698, 56.9803, 52.3510, 50.3782),
    ),
    "1000 g, 0.5 ms": (
        1000.0,
        0.5e-3,
        (100, 300, 1000, 1600, 2000, 5000, 10000),
        (185.8340, 547.1439, 1462.6449, 1650.9939, 1623.7914, 1042.5839, 1043.0243),
    ),
}


def half_sine(amplitude: float, duration_s: float, sampling_rate_hz: float) -> Floats:
    """Both ends are 0; the duration is a whole number of steps."""
    n = round(duration_s * sampling_rate_hz)
    return np.append(amplitude * np.sin(np.pi * np.arange(n) / n), 0.0)


def response(tau: Floats, ratio: float, zeta: float) -> Floats:
    """p and v of `coefficients`, (2, ...), tau = omega t after a half sine of amplitude 1 begins;
    the pulse is sin(ratio tau) up to tau = pi / ratio. The steady solution and a free decay that
    starts the mass at rest."""
    end = np.pi / ratio
    during = _driven(np.minimum(tau, end), ratio, zeta)
    return _free(during, np.maximum(tau - end, 0.0), zeta)


def _driven(tau: Floats, ratio: float, zeta: float) -> Floats:
    """-p = z'' + 2 zeta z' with z'' in radians: p = a sin + b cos of ratio tau solves p'' + 2 zeta
    p' + p = sin."""
    size = (1 - ratio**2) ** 2 + (2 * zeta * ratio) ** 2
    a, b = (1 - ratio**2) / size, -2 * zeta * ratio / size
    sine, cosine = np.sin(ratio * tau), np.cos(ratio * tau)
    steady = np.stack([a * sine + b * cosine, ratio * (a * cosine - b * sine)])
    return steady + _free(
        np.stack([np.full_like(tau, -b), np.full_like(tau, -ratio * a)]), tau, zeta
    )


def _free(start: Floats, tau: Floats, zeta: float) -> Floats:
    p, v = start
    delta = np.sqrt(1 - zeta**2)
    decay, cosine, sine = np.exp(-zeta * tau), np.cos(delta * tau), np.sin(delta * tau) / delta
    return np.stack(
        [decay * (p * cosine + (v + zeta * p) * sine), decay * (v * cosine - (p + zeta * v) * sine)]
    )


def maximax(amplitude: float, duration_s: float, frequency_hz: float) -> float:
    """The largest absolute acceleration, by a search on a fine grid and a refinement of what it
    finds."""

    def size(tau: Floats) -> Floats:
        p, v = response(np.asarray(tau), 1 / (2 * duration_s * frequency_hz), ZETA)
        return np.abs(p + 2 * ZETA * v)

    tau, step = np.linspace(0, 2 * np.pi * (duration_s * frequency_hz + 1.5), 20_001, retstep=True)
    near = tau[np.argmax(size(tau))]
    found = minimize_scalar(
        lambda t: -float(size(t)), bounds=(near - step, near + step), method="bounded"
    )
    return -amplitude * found.fun


@pytest.mark.parametrize("pulse", PULSES)
def test_spectrum_of_a_published_half_sine_is_the_closed_form(pulse):
    amplitude, duration, lines, published = PULSES[pulse]
    assert [maximax(amplitude, duration, line) for line in lines] == pytest.approx(
        published, rel=0, abs=5.1e-5
    )
    for rate in (2000 / duration, 20_000 / duration):
        spectrum = shock_response_spectrum(half_sine(amplitude, duration, rate), rate, lines)
        assert spectrum.maximax == pytest.approx(published, rel=1e-4, abs=0)


def test_coarse_half_sines_are_repaired_slow_bases_followed_and_short_pulses_kept():
    """200 samples: 2 a cycle at the highest line would lose a fifth of it without the repair."""
    amplitude, duration, *_ = PULSES["50 g, 11 ms"]
    rate, lines = 200 / duration, np.array([2000.0, 4000.0, 6000.0, 8000.0])
    exact = np.array([maximax(amplitude, duration, line) for line in lines])
    record = half_sine(amplitude, duration, rate)
    repaired = shock_response_spectrum(record, rate, lines, resample_within=1e-4)
    assert repaired.maximax == pytest.approx(exact, rel=1e-4, abs=0)
    # An oscillator far above the record's frequency feels the record. Long before another can
    # answer, its base has moved on at the pulse's velocity: omega z is that velocity, and less by
    # half a decay.
    record = half_sine(7.0, 0.1, 1e5)
    assert shock_response_spectrum(record, 1e5, [4000.0]).maximax == pytest.approx(
        [7.0], rel=1e-3, abs=0
    )
    rate, impulse = 1e6, 2.5
    short = np.zeros(11)
    short[1:10] = impulse * rate / 9
    spectrum = shock_response_spectrum(
        short, rate, [10.0], damping_ratio=1e-6, resample_within=None
    )
    assert spectrum.pseudo_velocity_m_s == pytest.approx([impulse], rel=1e-5, abs=0)
    assert spectrum.residual == pytest.approx(
        2 * np.pi * 10.0 * np.array([impulse]), rel=1e-5, abs=0
    )


@pytest.mark.parametrize("zeta", [0.01, 0.05, 0.3])
def test_step_overshoots_by_the_book(zeta):
    """Displacement of a step: 1 + exp(-pi zeta / delta), in units of a / omega^2."""
    rate, line = 1e6, 1000.0
    step = np.append(np.zeros(10), np.full(4000, 3.0))
    spectrum = shock_response_spectrum(step, rate, [line], damping_ratio=zeta)
    overshoot = 3.0 * (1 + np.exp(-np.pi * zeta / np.sqrt(1 - zeta**2)))
    assert spectrum.pseudo_velocity_m_s * 2 * np.pi * line == pytest.approx(
        [overshoot], rel=2e-5, abs=0
    )


def test_undamped_residual_is_the_fourier_transform():
    """omega |integral of a exp(-i omega t)| of the record, whose straight lines make (sin(x) / x)^2
    of each sample."""
    rng = np.random.default_rng(5)
    rate, record, lines = 1e4, rng.normal(size=300), np.array([20.0, 333.0, 1500.0, 4000.0])
    theta = 2 * np.pi * lines / rate
    sums = np.abs(np.exp(-1j * np.outer(theta, np.arange(300))) @ record)
    spectrum = shock_response_spectrum(
        record, rate, lines, damping_ratio=1e-12, resample_within=None
    )
    assert spectrum.residual == pytest.approx(
        theta * sums * np.sinc(lines / rate) ** 2, rel=1e-8, abs=0
    )
