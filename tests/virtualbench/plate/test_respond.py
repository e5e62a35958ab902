"""The response of modes to a force: closed forms, momentum, convergence."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.polynomial import legendre
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.build import PlateSensor, resonant_plate
from pyroshock.virtualbench.plate.mesh import bilinear
from pyroshock.virtualbench.plate.modes import PlateModes, modes
from pyroshock.virtualbench.plate.respond import pulse_bandwidth_hz, respond


def _oscillators(frequencies_hz: list[float], damping: list[float]) -> PlateModes:
    """One unit-mass oscillator a sensor, all struck alike."""
    count = len(frequencies_hz)
    return PlateModes(
        np.array(frequencies_hz),
        np.array(damping),
        np.ones((1, count)),
        np.eye(count),
        tuple("abcdefgh"[:count]),
    )


def _half_sine_closed(f: float, zeta: float, duration: float, time: np.ndarray) -> np.ndarray:
    """Acceleration of a unit-mass oscillator under a half sine of 1 N: forced phasor, and decay
    from what it meets."""
    omega, drive = 2 * np.pi * f, np.pi / duration
    pole = -zeta * omega + 1j * omega * np.sqrt(1 - zeta**2)
    phasor = 1 / (omega**2 - drive**2 + 2j * zeta * omega * drive)

    def free(position: float, velocity: float, since: np.ndarray) -> np.ndarray:
        amplitude = position - 1j * (velocity - pole.real * position) / pole.imag
        return (amplitude * pole**2 * np.exp(pole * since)).real

    forced = (-phasor * drive**2 * np.exp(1j * drive * time)).imag
    during = forced + free(-phasor.imag, -(phasor * 1j * drive).imag, time)
    end = np.array([duration])
    swing = phasor * np.exp(1j * drive * duration)
    amplitude = (
        -phasor.imag - 1j * (-(phasor * 1j * drive).imag + pole.real * phasor.imag) / pole.imag
    )
    ring = amplitude * np.exp(pole * end[0])
    after = free(
        swing.imag + ring.real, (swing * 1j * drive).imag + (ring * pole).real, time - duration
    )
    return np.where(time < 0, 0.0, np.where(time < duration, during, after))


FREQUENCIES = [3.0, 120.0, 900.0, 4000.0]
DAMPING = [0.005, 0.02, 0.3, 0.0]
DURATION = 1e-3


def _half_sine(samples: int) -> tuple[np.ndarray, np.ndarray]:
    time = np.linspace(0, DURATION, samples)
    return time, np.sin(np.pi * time / DURATION)


def test_half_sine_into_one_oscillator_converges_with_the_second_order() -> None:
    time = -2e-4 + np.arange(3000) / 51200
    found = respond(_oscillators(FREQUENCIES, DAMPING), *_half_sine(20_001), time)
    for row, f, zeta in zip(found, FREQUENCIES, DAMPING, strict=True):
        expected = _half_sine_closed(f, zeta, DURATION, time)
        assert row == pytest.approx(expected, abs=1e-7 * np.abs(expected).max())
    time = (
        DURATION + np.arange(100) / 51200
    )  # before that, it matters where between two samples one looks
    expected = _half_sine_closed(900.0, 0.3, DURATION, time)
    errors = [
        np.abs(respond(_oscillators([900.0], [0.3]), *_half_sine(n), time)[0] - expected).max()
        for n in (51, 101, 201)
    ]
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.1)


def test_a_straight_force_is_exact_on_any_grid() -> None:
    # A triangle is given in full by three samples; ten thousand of them say nothing new.
    system = _oscillators(FREQUENCIES, DAMPING)
    fine_time = np.linspace(0, DURATION, 10_001)
    fine = np.interp(fine_time, [0, DURATION / 2, DURATION], [0, 5.0, 0])
    time = np.arange(2000) / 51200
    coarse = respond(system, np.linspace(0, DURATION, 3), np.array([0, 5.0, 0]), time)
    assert respond(system, fine_time, fine, time) == pytest.approx(coarse, abs=1e-9)
    # exp(-zeta omega dt) is zero as a number for three samples in half a second, and 1e-2 for five
    # thousand.
    system = _oscillators([2000.0, 8000.0], [0.9, 0.9])
    fine_time, time = np.linspace(0, 0.5, 5001), np.linspace(0, 0.6, 7201)
    fine = np.interp(fine_time, [0, 0.25, 0.5], [0, 5.0, 0])
    coarse = respond(system, np.linspace(0, 0.5, 3), np.array([0, 5.0, 0]), time)
    assert respond(system, fine_time, fine, time, bandwidth_hz=np.inf) == pytest.approx(
        coarse, abs=1e-9
    )
    assert np.abs(coarse).max() > 1e-5


def test_linear_in_the_force_and_in_time() -> None:
    """No answer before the force and none to no force; a recording may end within it; the impact
    point is chosen."""
    system = _oscillators(FREQUENCIES, DAMPING)
    force_time, force = _half_sine(1001)
    time = np.arange(4000) / 51200
    whole = respond(system, force_time, force, time)
    assert respond(system, force_time + 0.01, 3 * force, time + 0.01) == pytest.approx(
        3 * whole, abs=1e-6
    )
    assert not respond(system, force_time, force, np.linspace(-1, -1e-6, 50)).any()
    assert not respond(system, force_time, 0 * force, np.linspace(0, 1, 50)).any()
    assert respond(system, force_time, force, time[:30]) == pytest.approx(whole[:, :30])
    two_points = replace(_oscillators([100.0], [0.01]), shape_impact=np.array([[1.0], [-2.5]]))
    first, second = (respond(two_points, *_half_sine(101), time[:100], point=k) for k in (0, 1))
    assert second == pytest.approx(-2.5 * first)


@pytest.fixture(scope="module")
def watched() -> tuple[PlateModes, np.ndarray]:
    """Modes of a free plate up to 2 kHz, seen at Gauss's points, and the masses (points,) that
    these stand for."""
    plate = resonant_plate("aluminum", "free", np.random.default_rng(7))
    points, weights = legendre.leggauss(20)
    u, v = np.repeat((points + 1) / 2, 20), np.tile((points + 1) / 2, 20)
    position, slopes = bilinear(np.array(plate.outline_m), u, v)
    sensors = tuple(PlateSensor(f"{k}", tuple(p), 0.0) for k, p in enumerate(position.tolist()))
    solved = modes(replace(plate, sensors=sensors), Effects.none(), max_frequency_hz=2000.0)
    density = plate.material.density_kg_m3 * plate.thickness_m
    return solved, density * np.outer(weights, weights).ravel() / 4 * np.linalg.det(slopes)


@pytest.mark.parametrize("point", [0, 1, 2])
def test_the_plate_s_momentum_grows_by_the_force(
    watched: tuple[PlateModes, np.ndarray], point: int
) -> None:
    solved, mass = watched
    force_time, force = _half_sine(1001)
    time = np.arange(20_000) / 51200
    acceleration = respond(solved, force_time, 800 * force, time, point=point)
    expected = np.interp(time[:400], force_time, 800 * force, right=0.0)
    assert mass @ acceleration[:, :400] == pytest.approx(expected, abs=0.2)
    velocity = mass @ (acceleration.sum(axis=1) / 51200) / mass.sum()
    assert velocity == pytest.approx(800 * 2 * DURATION / np.pi / mass.sum(), rel=1e-3)


@pytest.fixture(scope="module")
def many() -> PlateModes:
    plate = resonant_plate("aluminum", "free", np.random.default_rng(7))
    return modes(plate, Effects.none(), max_frequency_hz=9000.0)


def _truncated(solved: PlateModes, limit_hz: float) -> PlateModes:
    kept = solved.frequencies_hz <= limit_hz
    return PlateModes(
        solved.frequencies_hz[kept],
        solved.damping[kept],
        solved.shape_impact[:, kept],
        solved.shapes[:, kept],
        solved.sensor_names,
    )


def test_modes_converge_and_those_beyond_the_bandwidth_are_left_out_unnoticed(
    many: PlateModes,
) -> None:
    force_time = np.linspace(0, 1e-3, 1001)
    force = np.sin(np.pi * force_time / 1e-3) ** 2
    time = np.arange(5000) / 51200
    whole = respond(many, force_time, force, time)
    misses = [
        np.sqrt(
            ((respond(_truncated(many, f), force_time, force, time) - whole) ** 2).mean()
            / (whole**2).mean()
        )
        for f in (1000.0, 2000.0, 4000.0, 8000.0)
    ]
    assert all(later < earlier for earlier, later in pairwise(misses))
    assert misses[0] > 0.1
    assert misses[-1] < 5e-3
    force_time = np.linspace(0, 0.02, 2001)
    force = np.sin(np.pi * force_time / 0.02) ** 2
    bandwidth = pulse_bandwidth_hz(force_time, force)
    assert bandwidth < 6000
    kept = respond(_truncated(many, bandwidth), force_time, force, time)
    assert np.array_equal(kept, respond(many, force_time, force, time))
    whole = respond(many, force_time, force, time, bandwidth_hz=np.inf)
    assert not np.array_equal(kept, whole)
    assert kept == pytest.approx(whole, abs=1e-3 * np.abs(whole).max())


def test_bandwidth_scales_with_the_pulse_and_coarse_samples_have_none() -> None:
    short, long = (
        pulse_bandwidth_hz(np.linspace(0, t, 4001), np.sin(np.linspace(0, np.pi, 4001)) ** 2)
        for t in (1e-4, 1e-2)
    )
    assert short == pytest.approx(100 * long)
    # f |F| of sin^2 falls as (T f)^-2: 1e-4 of its peak lies near 100 / T.
    assert 50 < 1e-4 * short < 200
    assert pulse_bandwidth_hz(np.arange(3.0), np.array([0.0, 1.0, 0.0])) == np.inf


def test_bad_input_and_unknown_impact_points_are_refused() -> None:
    three = np.arange(3.0)
    for force_time, force, time, words in (
        (np.array([0, 1.0, 3.0]), np.ones(3), three, "force_time_s.*even"),
        (three, np.ones(3), np.array([0.0, 1.0, 3.0]), "time_s.*even"),
        (three[::-1], np.ones(3), three, "rising"),
        (three, np.ones(4), three, "shape"),
        (three, np.array([0, np.nan, 0]), three, "finite"),
        (three, np.ones(3), np.ones((2, 2)), "time_s has shape"),
        (np.zeros(1), np.zeros(1), three, "two or more"),
    ):
        with pytest.raises(ValueError, match=words):
            respond(_oscillators([100.0], [0.01]), force_time, force, time)
    for point in (-1, 1):
        with pytest.raises(ValueError, match=f"point = {point}"):
            respond(_oscillators([100.0], [0.01]), *_half_sine(11), three, point=point)
