"""Muzzle velocity from made laser signals, impact velocity from pulses whose integral is known, tank pressure."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyroshock.ingest.velocity import (
    NoDropError,
    NoPassageError,
    impact_velocity,
    muzzle_velocity,
    muzzle_velocity_uncertainty,
    tank_pressure_before,
)
from pyroshock.signals.channel import Channel, Sensor

RATE_HZ = 25_000.0
LENGTH_M = 0.085


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20)


def laser(
    velocity_m_s: float,
    rng: np.random.Generator,
    *,
    noise: float = 0.0,
    rest: float = 0.13,
    depth: float = -0.048,
    rebound: bool = True,
    edge_samples: float = 4.0,
    enter: float = 5000.3,
    samples: int = 25_000,
) -> np.ndarray:
    """A bullet across the beam, ramps of `edge_samples` at its ends, and a slower one on its way back."""
    sample = np.arange(samples)

    def blocked(enter: float, transit: float) -> np.ndarray:
        leave = enter + transit
        return np.interp(
            sample,
            enter + edge_samples * np.array([-0.5, 0.5]),
            [0, 1],
        ) - np.interp(sample, leave + edge_samples * np.array([-0.5, 0.5]), [0, 1])

    transit = LENGTH_M / velocity_m_s * RATE_HZ
    shape = blocked(enter, transit) + (blocked(enter + 3 * transit, 4 * transit) if rebound else 0)
    return rest + depth * shape + noise * abs(depth) * rng.standard_normal(samples)


@settings(max_examples=40)
@given(
    st.floats(5, 80),
    st.floats(5000, 5001),
    st.sampled_from([(0.13, -0.048), (0.0, 5.0), (4.2, -3.3), (-2.0, 1e-3)]),
    st.floats(0.5, 8.0),
)
def test_clean_passage_gives_the_velocity(
    velocity: float, enter: float, levels: tuple[float, float], edge: float
) -> None:
    rng = np.random.default_rng(0)
    signal = laser(velocity, rng, rest=levels[0], depth=levels[1], enter=enter, edge_samples=edge)
    # Between two samples of a sharp edge nothing tells where it lies: half a sample at either end at most.
    transit = LENGTH_M / velocity * RATE_HZ
    assert muzzle_velocity(signal, RATE_HZ, LENGTH_M).velocity_m_s == pytest.approx(velocity, rel=0.6 / transit)


def test_crossing_lies_between_samples(rng: np.random.Generator) -> None:
    result = muzzle_velocity(laser(60.0, rng, edge_samples=6.0, enter=5000.3), RATE_HZ, LENGTH_M)
    assert result.enter_sample == pytest.approx(5000.3, abs=1e-6)
    assert result.transit_time_s == pytest.approx(LENGTH_M / 60.0, rel=1e-6)


@pytest.mark.parametrize("depth", [-0.048, 0.048])
def test_noise_moves_the_velocity_less_than_its_uncertainty(rng: np.random.Generator, depth: float) -> None:
    errors = []
    for _ in range(20):
        result = muzzle_velocity(laser(17.0, rng, noise=0.05, depth=depth), RATE_HZ, LENGTH_M)
        errors.append((result.velocity_m_s - 17.0) / result.velocity_u_m_s)
    assert np.abs(errors).max() < 1


def test_spikes_are_not_passages(rng: np.random.Generator) -> None:
    signal = laser(17.0, rng, noise=0.01)
    signal[2000:2002] -= 0.05
    assert muzzle_velocity(signal, RATE_HZ, LENGTH_M).enter_sample == pytest.approx(5000.3, abs=0.5)


def test_first_passage_is_taken_even_when_the_rebound_stays(rng: np.random.Generator) -> None:
    signal = laser(17.0, rng, noise=0.01)
    signal[12_000:] = 0.13 - 0.06
    assert muzzle_velocity(signal, RATE_HZ, LENGTH_M).velocity_m_s == pytest.approx(17.0, rel=5e-3)


def test_flat_signal_has_no_passage(rng: np.random.Generator) -> None:
    with pytest.raises(NoPassageError, match="departs from rest by"):
        muzzle_velocity(0.13 + 1e-4 * rng.standard_normal(20_000), RATE_HZ, LENGTH_M)


def test_constant_signal_has_no_passage() -> None:
    with pytest.raises(NoPassageError):
        muzzle_velocity(np.full(20_000, 0.13), RATE_HZ, LENGTH_M)


def test_bullet_that_stays_in_the_beam_is_named(rng: np.random.Generator) -> None:
    signal = laser(17.0, rng, rebound=False)
    with pytest.raises(NoPassageError, match="blocked at sample 500"):
        muzzle_velocity(signal[:5050], RATE_HZ, LENGTH_M)


def test_nan_in_the_signal_is_named(rng: np.random.Generator) -> None:
    signal = laser(17.0, rng)
    signal[77] = np.nan
    with pytest.raises(ValueError, match="sample 77"):
        muzzle_velocity(signal, RATE_HZ, LENGTH_M)


def test_uncertainty_is_that_of_table_5_1(thesis_tables: Path) -> None:
    with (thesis_tables / "table_3_1_5_1_gun_shots.csv").open(newline="") as handle:
        rows = list(csv.DictReader(handle))
    measured = np.array([float(row["measured_velocity_m_s"]) for row in rows])
    spread = muzzle_velocity_uncertainty(LENGTH_M, LENGTH_M / measured, time_u_s=1 / RATE_HZ)
    # Eq. 5.2 gives 0.1854 m/s for test 4, where 0.18 is printed; the other four round to the printed figures.
    assert spread == pytest.approx([float(row["velocity_uncertainty_m_s"]) for row in rows], abs=0.0055)


def test_uncertainty_of_the_five_shots() -> None:
    measured = np.array([10.366, 11.872, 18.973, 13.799, 16.346])
    spread = muzzle_velocity_uncertainty(0.085, 0.085 / measured, time_u_s=4e-5)
    assert np.round(spread, 2).tolist() == [0.13, 0.15, 0.28, 0.19, 0.23]  # printed: 0.18 for the fourth (0.1854)


# --- impact velocity -------------------------------------------------------------------------------------------------

#: Shape, and its integral up to the peak for unit height and unit contact time.
HALF_SINE, HERTZ = 1.0, 1.5
AREA = {
    # integral of sin(pi t)^p from 0 to 1/2, by the beta function
    power: math.gamma((power + 1) / 2) / (2 * math.sqrt(math.pi) * math.gamma(power / 2 + 1))
    for power in (HALF_SINE, HERTZ)
}


def contact(power: float, samples: float, phase: float, *, quiet: int = 220) -> tuple[np.ndarray, int, int]:
    """Deceleration of unit height that lasts `samples`, with `first` and `peak` as segmentation gives them."""
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
def test_whole_samples_would_miss_one_percent(power: float) -> None:
    """The reason for refinement: the trapezoid rule from first to peak sample, at ten samples per contact."""
    worst = 0.0
    for phase in np.linspace(0, 0.95, 20):
        pulse, first, peak = contact(power, 10.0, phase)
        worst = max(worst, abs(np.trapezoid(pulse[first : peak + 1]) / (AREA[power] * 10) - 1))
    assert 0.1 < worst < 0.2


def test_velocity_is_positive_whichever_way_the_sensor_points() -> None:
    pulse, first, peak = contact(HALF_SINE, 20.0, 0.3)
    up, down = impact_velocity(pulse, 1.0, first, peak), impact_velocity(-pulse, 1.0, first, peak)
    assert up == down
    assert up.velocity_m_s > 0


@pytest.mark.parametrize("power", [HALF_SINE, HERTZ])
@pytest.mark.parametrize("samples", [10, 20, 40])
@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_uncertainty_covers_the_scatter(rng: np.random.Generator, power: float, samples: float, noise: float) -> None:
    scores = []
    for _ in range(150):
        pulse, first, peak = contact(power, samples, rng.random())
        noisy = pulse + noise * rng.standard_normal(pulse.size)
        peak = peak - 2 + int(noisy[peak - 2 : peak + 3].argmax())
        result = impact_velocity(noisy, 1.0, first, peak, noise_m_s2=noise)
        scores.append((result.velocity_m_s - AREA[power] * samples) / result.velocity_u_m_s)
    # A tenth of a sample for the interpolation is generous at low noise.
    assert 0.3 < float(np.std(scores)) < 1.4


def test_noise_is_estimated_before_the_contact(rng: np.random.Generator) -> None:
    pulse, first, peak = contact(HALF_SINE, 20.0, 0.3)
    noisy = pulse + 0.01 * rng.standard_normal(pulse.size)
    given_noise = impact_velocity(noisy, 1.0, first, peak, noise_m_s2=0.01)
    assert impact_velocity(noisy, 1.0, first, peak).velocity_u_m_s == pytest.approx(
        given_noise.velocity_u_m_s, rel=0.25
    )


def test_gain_uncertainty_adds_in_squares() -> None:
    pulse, first, peak = contact(HALF_SINE, 20.0, 0.3)
    plain = impact_velocity(pulse, 1.0, first, peak)
    gained = impact_velocity(pulse, 1.0, first, peak, gain_u=0.05)
    assert gained.velocity_u_m_s == pytest.approx(math.hypot(plain.velocity_u_m_s, 0.05 * plain.velocity_m_s))


def test_contact_at_the_records_start_asks_for_the_noise() -> None:
    pulse, first, peak = contact(HALF_SINE, 20.0, 0.3, quiet=6)
    with pytest.raises(ValueError, match="noise_m_s2"):
        impact_velocity(pulse, 1.0, first, peak)
    assert impact_velocity(pulse, 1.0, first, peak, noise_m_s2=0.0).velocity_m_s > 0


@pytest.mark.parametrize(("first", "peak"), [(-1, 5), (5, 5), (10, 99)])
def test_impossible_contact_is_refused(first: int, peak: int) -> None:
    with pytest.raises(ValueError, match=f"contact from {first} to peak {peak}"):
        impact_velocity(np.ones(100), 1.0, first, peak)


# --- tank pressure ---------------------------------------------------------------------------------------------------


def tank(rng: np.random.Generator, *, noise: float = 200.0, drop: int = 6000, samples: int = 15_000) -> np.ndarray:
    x = np.arange(samples) - drop
    return 40_420 * np.exp(-np.clip(x, 0, None) / 400) + noise * rng.standard_normal(samples)


def test_pressure_is_the_mean_before_the_drop(rng: np.random.Generator) -> None:
    result = tank_pressure_before(tank(rng))
    assert result.pressure_pa == pytest.approx(40_420, abs=5 * result.pressure_u_pa)
    assert 5850 < result.stop <= 6000


def test_uncertainty_of_the_mean_covers_its_scatter(rng: np.random.Generator) -> None:
    results = [tank_pressure_before(tank(rng)) for _ in range(60)]
    scatter = np.std([r.pressure_pa for r in results])
    assert np.mean([r.pressure_u_pa for r in results]) == pytest.approx(scatter, rel=0.35)


def test_spikes_do_not_move_the_pressure(rng: np.random.Generator) -> None:
    record = tank(rng)
    record[1000:1003] = 0.0
    record[4000] = 1e6
    result = tank_pressure_before(record)
    assert result.pressure_pa == pytest.approx(40_420, abs=5 * result.pressure_u_pa)


def test_only_the_stretch_next_to_the_drop_counts(rng: np.random.Generator) -> None:
    leaking = tank(rng) + np.clip(6000 - np.arange(15_000), 0, None) * 0.5
    result = tank_pressure_before(leaking, longest_stretch=400)
    middle = (result.first + result.stop) / 2
    assert result.pressure_pa == pytest.approx(40_420 + 0.5 * (6000 - middle), abs=60)
    assert middle > 5600


@pytest.mark.parametrize(("drop", "slowness"), [(600, 3000), (1000, 6000), (5000, 10_000)])
def test_slow_valve_takes_pieces_of_the_rest(rng: np.random.Generator, drop: int, slowness: int) -> None:
    """The drop is found late, and whole pieces before it have left their level: NaN once came out of them."""
    since = np.clip(np.arange(30_000) - drop, 0, None) / slowness
    result = tank_pressure_before(4e5 * np.exp(-(since**3)) + 50 * rng.standard_normal(30_000))
    assert result.pressure_pa == pytest.approx(4e5, rel=2e-3)
    assert 0 < result.pressure_u_pa < 800


def test_noiseless_pressure_is_exact() -> None:
    result = tank_pressure_before(tank(np.random.default_rng(0), noise=0.0))
    assert result.pressure_pa == pytest.approx(40_420, rel=1e-12)


def test_no_shot_no_pressure(rng: np.random.Generator) -> None:
    with pytest.raises(NoDropError, match="no drop"):
        tank_pressure_before(tank(rng, drop=20_000))


def test_leak_is_no_shot(rng: np.random.Generator) -> None:
    with pytest.raises(NoDropError, match="no drop"):
        tank_pressure_before(tank(rng, drop=20_000) - 0.5 * np.arange(15_000))


def test_drop_at_the_records_start_is_refused(rng: np.random.Generator) -> None:
    with pytest.raises(NoDropError, match="16"):
        tank_pressure_before(tank(rng, drop=10, samples=4000))


@settings(max_examples=30)
@given(st.floats(0, 16))
def test_transducer_volts_become_pressure(bar: float) -> None:
    """The thesis' calibration: 0.5621 V/bar and 0.3624 V at zero."""
    sensor = Sensor("tank", "pressure", "bar", sensitivity=0.5621, offset_v=0.3624)
    channel = Channel(sensor, np.array([0.5621 * bar + 0.3624]), RATE_HZ)
    assert channel.si[0] == pytest.approx(bar * 1e5, rel=1e-12, abs=1e-6)
