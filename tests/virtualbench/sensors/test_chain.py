"""The chain as a whole: each effect acts as it says, and at strength 0 not at all."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.sensors import SensorBuild, analog, digitised, record

FS_HZ = 51_200.0
ACCELERATION = SensorBuild(
    "a",
    "acceleration",
    "m/s2",
    1e5,
    noise=3.0,
    mount_resonance_hz=45e3,
    gain_fault=0.01,
    zero_shift_fault=0.002,
    gain_drift=0.003,
    offset_drift=5.0,
)
FORCE = SensorBuild("f", "force", "N", 1e4, noise=0.5, bandwidth_hz=20e3, gain_fault=0.01)
TANK = SensorBuild(
    "p", "pressure", "bar", 16.0, 1e5, 16, 0.5621, 0.3624, gain_fault=0.004, offset_fault=0.005
)


def pulse(width_s=400e-6, peak=1000.0, ratio=20, seconds=0.02) -> tuple[NDArray[Any], NDArray[Any]]:
    """A squared sine from 5 ms on."""
    time = np.arange(round(seconds * FS_HZ * ratio)) / (FS_HZ * ratio)
    phase = (time - 0.005) / width_s
    return time, np.where(
        (phase > 0) & (phase < 1), peak * np.sin(np.pi * np.clip(phase, 0, 1)) ** 2, 0.0
    )


def recorded(sensor, effects, signal=None, day_fraction=0.0, seed=0):
    time, values = signal or pulse()
    return record(
        time, values, sensor, FS_HZ, effects, np.random.default_rng(seed), day_fraction=day_fraction
    )


def test_ideal_chain_writes_the_signal_itself_up_to_its_range():
    """But for what the pulse's kinks hold above the band: less than a thousandth of its peak."""
    _, values = pulse()
    assert recorded(FORCE, Effects.none()) == pytest.approx(values[::20], abs=1.0)
    values = recorded(FORCE, Effects.none(), pulse(peak=5e4))
    assert values.max() == np.float32(1e4 - FORCE.step)
    assert np.count_nonzero(values == values.max()) > 5
    ideal = recorded(ACCELERATION, Effects.none())
    for name in Effects.default():
        assert np.array_equal(
            recorded(ACCELERATION, Effects.only(name, 0.0), day_fraction=0.5), ideal
        ), name


@pytest.mark.parametrize("ratio", [19.53125, 97.65625, 3.3])
def test_grid_that_is_no_multiple_of_the_recorders_gives_the_same(ratio):
    time, values = pulse(ratio=ratio)
    n = round(0.015 * FS_HZ)
    tolerance = 0.2 if ratio > 10 else 20.0  # 3.3 points a sample are linear in between
    assert recorded(FORCE, Effects.none(), (time, values))[:n] == pytest.approx(
        recorded(FORCE, Effects.none())[:n], abs=tolerance
    )


def test_noise_drift_and_pressure_errors_are_as_stated() -> None:
    noise = digitised(
        np.zeros(200_000), FORCE, FS_HZ, Effects.only("bench.noise", 2.0), np.random.default_rng(1)
    )
    assert noise.std() == pytest.approx(1.0, rel=0.01)
    assert abs(noise.mean()) < 0.01
    first, again, other = (recorded(FORCE, Effects.default(), seed=seed) for seed in (4, 4, 5))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    gains = []
    for day in (0.0, 0.5, 1.0):
        values = recorded(ACCELERATION, Effects.only("bench.drift"), day_fraction=day)
        assert values[:100].mean() == pytest.approx(5.0 * day, abs=0.02)
        gains.append((values.max() - values[0]) / 1000)
    assert np.diff(gains) == pytest.approx([0.0015, 0.0015], rel=0.02)
    level = (np.arange(4096) / (8 * FS_HZ), np.full(4096, 3e5))
    volts = recorded(TANK, Effects.only("sensor.pressure_offset", 2.0), level)
    assert volts.mean() == pytest.approx(0.3624 + 0.5621 * 3.01, abs=TANK.step)
    volts = recorded(TANK, Effects.only("sensor.pressure_gain", -1.0), level)
    assert volts.mean() == pytest.approx(0.3624 + 0.5621 * 3 * 0.996, abs=TANK.step)


@pytest.mark.parametrize(
    ("sensor", "name"), [(FORCE, "sensor.force_gain"), (ACCELERATION, "sensor.acceleration_gain")]
)
@pytest.mark.parametrize("strength", [-2.0, 3.0])
def test_gain_error_is_its_strength_in_per_cent(sensor, name, strength):
    ideal, faulty = recorded(sensor, Effects.none()), recorded(sensor, Effects.only(name, strength))
    assert faulty.max() / ideal.max() == pytest.approx(1 + 0.01 * strength, rel=1e-4)


def test_force_bandwidth_rounds_the_pulse_off_and_windows_add_up_to_the_whole():
    ideal = analog(*pulse(), FORCE, FS_HZ, Effects.none())
    slow = analog(*pulse(), FORCE, FS_HZ, Effects.only("sensor.force_bandwidth", 10.0))
    assert slow.max() < 0.9 * ideal.max()
    assert slow.sum() == pytest.approx(ideal.sum(), rel=1e-3)  # gain 1 at 0 Hz: the impulse stays
    centre = [float(np.arange(x.size) @ x / x.sum()) for x in (ideal, slow)]
    # a Butterworth of order 4 delays by 2 (sin 22.5 deg + sin 67.5 deg) / w0 at 0 Hz
    assert (centre[1] - centre[0]) / FS_HZ == pytest.approx(2.6131 / (2 * np.pi * 2e3), rel=0.01)
    time, values = pulse()
    whole = analog(time, values, FORCE, FS_HZ, Effects.default())
    parts = values * (time < 0.0052), values * (time >= 0.0052)
    assert sum(analog(time, p, FORCE, FS_HZ, Effects.default()) for p in parts) == pytest.approx(
        whole, abs=1e-6
    )


def test_mounting_brought_into_the_band_rings():
    quiet, ringing = (
        analog(*pulse(100e-6), ACCELERATION, FS_HZ, Effects.only("sensor.mount_resonance", s))
        for s in (0.0, 3.0)
    )
    after = slice(round(0.0055 * FS_HZ), None)
    spectrum = np.abs(np.fft.rfft((ringing - quiet)[after]))
    found = np.argmax(spectrum) * FS_HZ / quiet[after].size
    assert found == pytest.approx(15e3, rel=0.02)
    assert np.abs(quiet[after]).max() < 0.01 * np.abs(ringing[after]).max()


def test_zero_shift_is_a_share_of_the_largest_peak_and_fades():
    sensor = ACCELERATION
    effects = Effects.only("sensor.zero_shift", -5.0)
    band_limited = np.zeros(30_000)
    band_limited[1000:1010] = [100, 300, 500, 800, 1000, 800, 500, 300, 100, 0]
    offset = (
        digitised(band_limited, sensor, FS_HZ, effects, np.random.default_rng(0)) - band_limited
    )
    k = np.arange(1010, 30_000)
    expected = -5.0 * 0.002 * 1000 * np.exp(-(k - 1004) / FS_HZ / sensor.zero_shift_decay_s)
    assert np.abs(offset[:1000]).max() <= sensor.step
    assert offset[1010:] == pytest.approx(expected, abs=sensor.step)
    shocks = np.zeros(20_000)
    shocks[[1000, 6000, 12_000]] = 1000.0, -300.0, -2000.0
    shifts = digitised(
        shocks, ACCELERATION, FS_HZ, Effects.only("sensor.zero_shift"), np.random.default_rng(0)
    )
    fade = np.exp(-5001 / FS_HZ / ACCELERATION.zero_shift_decay_s)
    assert shifts[6001] == pytest.approx(2.0 * fade, abs=0.02)
    assert shifts[12_001] == pytest.approx(4.0, abs=0.02)


@pytest.mark.parametrize(
    ("time", "values", "message"),
    [
        (np.arange(5) / 1e6, np.zeros(4), "two of one length"),
        (np.array([0.0, 1e-6, 5e-6]), np.zeros(3), "even, rising grid"),
        (np.arange(5) / 1e4, np.zeros(5), "expected at least the recorder's 51200 Hz"),
        (np.arange(50) / 1e6, np.full(50, np.nan), "NaN"),
    ],
)
def test_signal_that_cannot_be_recorded_is_refused(time, values, message):
    with pytest.raises(ValueError, match=message):
        record(time, values, FORCE, FS_HZ, Effects.none(), np.random.default_rng(0))
