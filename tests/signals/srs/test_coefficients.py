"""Coefficients in double against many digits, the loop where theta is small, and extremes of a
decay."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pyroshock.signals.srs.coefficients import extremes, steps
from pyroshock.signals.srs.kernel import run
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from support.checks.printed_filters import absolute_acceleration, relative_displacement

THETAS = [1e-9, 1e-6, 1e-3, 0.1, 0.99999, 1.0, 1.5, 3.14]


def exact(theta: float, zeta: float) -> dict[str, Decimal]:
    """S, G, H from their series with 60 digits: S'' + 2 zeta S' + S = 0, S(0) = 0, S'(0) = 1."""
    with localcontext() as context:
        context.prec = 60
        t, z = Decimal(theta), Decimal(zeta)
        before, derivative, power = Decimal(0), Decimal(1), t
        s = g = h = Decimal(0)
        for k in range(1, 80):
            s += derivative * power
            g += derivative * power * t / (k + 1)
            h += derivative * power * t / ((k + 1) * (k + 2))
            before, derivative, power = (
                derivative,
                -2 * z * derivative - before,
                power * t / (k + 1),
            )
        return {"s": s, "g": g, "h": h}


@pytest.mark.parametrize("zeta", [0.0, 0.001, 0.05, 0.5, 0.95])
@pytest.mark.parametrize("theta", THETAS)
def test_coefficients_keep_their_digits(theta, zeta):
    ours = steps(np.array([theta]), zeta)
    lost = 1e-15 if theta > 1 else 0.0  # a sine near pi
    for name, value in exact(theta, zeta).items():
        assert getattr(ours, name)[0] == pytest.approx(float(value), rel=3e-15, abs=lost)


@pytest.mark.parametrize("theta", THETAS)
def test_filters_pass_a_constant(theta):
    """The sum of b is that of a, or -1 / omega^2 of it; the printed form tells the sum of a from 0
    by 1e-16 at best."""
    omega = np.array([theta])
    acceleration, displacement = (
        f(omega, 1.0, 0.05) for f in (absolute_acceleration, relative_displacement)
    )
    assert acceleration.b.sum() == pytest.approx(acceleration.a.sum(), rel=1e-13, abs=1e-15)
    assert -(theta**2) * displacement.b.sum() == pytest.approx(
        displacement.a.sum(), rel=1e-13, abs=1e-15
    )


def reference(record: list[float], theta: float, zeta: float) -> tuple[float, float]:
    """Largest |p + 2 zeta v| and |p| by the same steps with 40 digits."""
    with localcontext() as context:
        context.prec = 40
        one, z = exact(theta, zeta), Decimal(zeta)
        s, g, h, k = one["s"], one["g"], one["h"], one["g"] / Decimal(theta)
        p = v = before = highest = furthest = Decimal(0)
        for now in map(Decimal, record):
            error, rise = before - p, now - before
            p, v = p + g * error + s * v + h * rise, v + s * error - (g + 2 * z * s) * v + k * rise
            highest, furthest, before = max(highest, abs(p + 2 * z * v)), max(furthest, abs(p)), now
        return float(highest), float(furthest)


@pytest.mark.parametrize("theta", [1e-6, 1e-4, 1e-2, 1.0])
def test_the_loop_keeps_its_digits(theta):
    record = np.random.default_rng(7).normal(size=5000)
    highest, lowest, furthest, *_ = run(record[np.newaxis], steps(np.array([theta]), 0.05))[:, 0, 0]
    expected = reference(record.tolist(), theta, 0.05)
    assert (max(highest, -lowest), furthest) == pytest.approx(expected, rel=1e-12, abs=0)


def test_a_slow_oscillator_takes_the_velocity():
    """omega dt = 1e-6, where the printed filter has six digits left: a short pulse, and then a
    decay of the free mass.

    Two samples of 1 are three steps, of area 2 dt: p = exp(-zeta tau) sin(delta tau) / delta *
    omega * 2 dt, largest at tan(delta tau) = delta / zeta."""
    rate, zeta = 1e6, 0.05
    line = 1e-6 * rate / (2 * np.pi)
    spectrum = shock_response_spectrum(
        np.array([0.0, 1.0, 1.0, 0.0]), rate, [line], damping_ratio=zeta, resample_within=None
    )
    largest = np.exp(-zeta / np.sqrt(1 - zeta**2) * np.arccos(zeta))
    assert spectrum.pseudo_velocity_m_s == pytest.approx([largest * 2 / rate], rel=1e-9, abs=0)


values = st.floats(-10, 10)


@given(values, values, st.floats(1e-6, 0.95))
@example(0.0, 0.0, 0.05)
def test_extremes_are_those_of_a_fine_series(start, slope, zeta):
    """1,200 points a turn: a peak falls between two by a share of 4e-6 at most. Rest stays at
    rest."""
    delta = np.sqrt(1 - zeta**2)
    tau = np.linspace(0, 4 * np.pi / delta, 2401)
    series = np.exp(-zeta * tau) * (
        start * np.cos(delta * tau) + (slope + zeta * start) / delta * np.sin(delta * tau)
    )
    largest, least = extremes(np.array([start]), np.array([slope]), zeta)
    size = np.hypot(start, (slope + zeta * start) / delta)
    for exact, sampled in ((largest[0], series.max()), (-least[0], -series.min())):
        assert -1e-12 * (1 + size) * (size > 0) <= exact - sampled <= 2e-5 * size
