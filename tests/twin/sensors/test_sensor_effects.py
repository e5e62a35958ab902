"""Each effect of the sensors against its closed form; off, a record is what happened."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.twin.effects import catalogue, effect
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.effect import SensorEffect
from pyroshock.twin.sensors.effects.force_gain import ForceGain
from scipy.signal import freqs

STEP_S = 1e-5
SENSOR_EFFECTS = [identity for identity in catalogue() if identity.startswith("sensor.")]


def chain(identity: str, **parameters: float | np.ndarray) -> SensorChain:
    return SensorChain.of([effect(identity, **parameters)])


def off(identity: str) -> dict[str, float]:
    return {each.name: each.off for each in catalogue()[identity].parameters()}


@pytest.mark.parametrize("identity", SENSOR_EFFECTS)
def test_off_is_identity_to_the_bit(identity):
    series = np.random.default_rng(0).standard_normal((2, 3, 50))
    still = chain(identity, **off(identity))
    np.testing.assert_array_equal(still.true_pressure_pa(np.array([0.0, 5e5])), [0.0, 5e5])
    np.testing.assert_array_equal(still.measured_velocity_m_s(np.array([0.0, 7.3])), [0.0, 7.3])
    np.testing.assert_array_equal(still.measured_force_n(series[:, 0], STEP_S), series[:, 0])
    np.testing.assert_array_equal(still.measured_acceleration_m_s2(series, STEP_S), series)
    np.testing.assert_array_equal(still.true_force_n(series[0, 0], STEP_S), series[0, 0])
    np.testing.assert_array_equal(still.transmissibility(np.array([-3 + 900j])), [[1.0]])


@pytest.mark.parametrize(
    ("identity", "hook"),
    [
        ("sensor.pressure_offset", "true_pressure_pa"),
        ("sensor.pressure_gain", "true_pressure_pa"),
        ("sensor.velocity_gain", "measured_velocity_m_s"),
    ],
)
def test_default_acts_on_its_own_channel_alone(identity, hook):
    values = np.array([3e5, 6e5])
    for name in ("true_pressure_pa", "measured_velocity_m_s"):
        changed = not np.array_equal(getattr(chain(identity), name)(values), values)
        assert changed == (name == hook)


def test_gains_and_offsets_of_each_shot_meet_its_own_series():
    both = SensorChain.of(
        [effect("sensor.pressure_gain", gain=1.1), effect("sensor.pressure_offset", offset_pa=2e4)]
    )
    true = np.array([1e5, 7e5])
    np.testing.assert_allclose(both.true_pressure_pa(1.1 * true + 2e4), true, rtol=1e-14)
    assert chain("sensor.pressure_offset", offset_pa=5e4).true_pressure_pa(np.array([3e4])) == [0.0]
    gains = np.array([0.5, 2.0])
    series = np.random.default_rng(1).standard_normal((2, 3, 8))
    seen = chain("sensor.acceleration_gain", gain=gains).measured_acceleration_m_s2(series, STEP_S)
    np.testing.assert_array_equal(seen, series * gains[:, None, None])
    with pytest.raises(ValueError, match="2 values of a parameter for series of shape"):
        chain("sensor.acceleration_gain", gain=gains).measured_acceleration_m_s2(series[:1], STEP_S)


@pytest.mark.parametrize("fall", [0.025, 0.2, -0.1])
def test_sensitivity_of_an_accelerometer_falls_by_its_share_in_each_decade(fall: float) -> None:
    """Against the amplitude of steady tones, and of one that decays, whose pole is complex."""
    sensor = chain("sensor.acceleration_gain", gain=1.1, fall=fall)
    time_s = np.arange(40_000) * STEP_S
    middle = slice(10_000, 30_000)  # 200 ms: whole periods of all tones, and far from both ends
    for frequency_hz, decades in ((100.0, -1), (1e3, 0), (1e4, 1)):
        tone = np.exp(2j * np.pi * frequency_hz * time_s)
        seen = sensor.measured_acceleration_m_s2(tone.real, STEP_S)
        amplitude = 2 * np.mean((seen * tone.conj())[middle])
        assert abs(amplitude) == pytest.approx(1.1 * (1 - fall) ** decades, rel=2e-3)
        expected = sensor.transmissibility(np.array([2j * np.pi * frequency_hz]))[0, 0]
        assert amplitude == pytest.approx(expected, rel=2e-3)
    pole = -200 + 2j * np.pi * 2e3
    ringing = np.where(time_s < 0.1, 0.0, np.exp(pole * np.maximum(time_s - 0.1, 0.0)))
    seen = sensor.measured_acceleration_m_s2(ringing.imag, STEP_S)
    ringing_samples = slice(10_200, 10_700)  # one period of the tone is 50 samples
    expected = (sensor.transmissibility(np.array([pole]))[0, 0] * ringing).imag
    np.testing.assert_allclose(
        seen[ringing_samples], expected[ringing_samples], atol=0.01 * np.abs(expected).max()
    )


def test_accelerometers_have_their_own_fall() -> None:
    series = np.random.default_rng(2).standard_normal((2, 64))
    together = chain(
        "sensor.acceleration_gain", gain=np.array([1.0, 1.2]), fall=np.array([0.0, 0.1])
    )
    seen = together.measured_acceleration_m_s2(series, STEP_S)
    np.testing.assert_allclose(seen[0], series[0], atol=1e-12)
    single_sensor = chain(
        "sensor.acceleration_gain", gain=1.2, fall=0.1
    ).measured_acceleration_m_s2(series[1], STEP_S)
    np.testing.assert_allclose(seen[1], single_sensor, atol=1e-12)
    poles = np.array([-5 + 2j * np.pi * 1e4])
    np.testing.assert_allclose(
        np.abs(together.transmissibility(poles))[:, 0], [1.0, 1.2 * 0.9], rtol=1e-6
    )


@given(gain=st.floats(0.5, 2.0), velocity=st.floats(0.1, 80))
def test_gains_multiply(gain, velocity):
    seen = chain("sensor.velocity_gain", gain=gain).measured_velocity_m_s(np.array([velocity]))
    assert seen[0] == pytest.approx(gain * velocity, rel=1e-15)


@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_values_of_shots_need_a_series_for_each_and_a_number_serves_all(shape):
    """Three values do not meet the three samples of one series: its axis is time."""
    for identity, hook in (
        ("acceleration_gain", "measured_acceleration_m_s2"),
        ("force_gain", "measured_force_n"),
    ):
        several = chain(f"sensor.{identity}", gain=np.array([0.5, 1.0, 2.0]))
        with pytest.raises(
            ValueError,
            match=rf"3 values of a parameter for series of shape {re.escape(str(shape))}$",
        ):
            getattr(several, hook)(np.ones(shape), STEP_S)
        series = np.full(shape, 3.0)
        for gain in (2, 2.0, np.float32(2.0), np.array(2.0)):
            seen = getattr(chain(f"sensor.{identity}", gain=gain), hook)(series, STEP_S)
            np.testing.assert_array_equal(seen, 2 * series)


def test_low_pass_changes_next_to_nothing_far_above_the_rate_and_keeps_its_digits_far_below():
    """Its closed form and that of mountings stand in `test_sensor_filters`."""
    force = np.sin(np.linspace(0, np.pi, 200))
    seen = chain("sensor.force_bandwidth", time_constant_s=1e-9).measured_force_n(force, STEP_S)
    np.testing.assert_allclose(seen, force, atol=1e-4 * 0.02)
    step = chain("sensor.force_bandwidth", time_constant_s=1e-2).measured_force_n(np.ones(20), 1e-8)
    late = np.arange(1, 20) * 1e-8 / 1e-2
    np.testing.assert_allclose(np.diff(step), np.exp(-late[:19]) * -np.expm1(-1e-6), rtol=1e-6)


def test_zero_shift_of_each_shot_is_a_share_of_the_peak_that_decays_from_it():
    """After a long wait as after none: a second before the shock is ten thousand decay times, whose
    exponential is no number."""
    series = np.zeros((3, 2, 50))
    series[:, 0, 20], series[:, 1, 30] = -10.0, 40.0
    shares, times = np.array([0.1, 0.0, -0.2]), np.array([1e-3, 1e-3, 2e-4])
    for share, decay_s in ((shares, times), (0.05, 1e-3)):
        shift = chain("sensor.zero_shift", share=share, decay_time_s=decay_s)
        offset = shift.measured_acceleration_m_s2(series, STEP_S) - series
        for row, (own, own_s) in enumerate(
            zip(np.broadcast_to(share, 3), np.broadcast_to(decay_s, 3), strict=True)
        ):
            for sensor, (peak, at) in enumerate(((10.0, 20), (40.0, 30))):
                late = (np.arange(50) - at) * STEP_S
                expected = np.where(
                    late >= 0, own * peak * np.exp(-np.maximum(late, 0) / own_s), 0.0
                )
                np.testing.assert_allclose(offset[row, sensor], expected, rtol=1e-12, atol=1e-12)
    short, before = np.array([0.0, 50.0, -20.0, 0.0, 0.0]), np.zeros(1000)
    shift = chain("sensor.zero_shift", share=0.1, decay_time_s=1e-4)
    alone = shift.measured_acceleration_m_s2(short, 1e-3)
    waited = shift.measured_acceleration_m_s2(np.concatenate([before, short]), 1e-3)
    np.testing.assert_array_equal(waited, np.concatenate([before, alone]))


def test_transmissibility_and_inverse_force_are_those_of_the_transfer_functions():
    omega, zeta, gains = 2 * np.pi / 1e-4, 0.05, np.array([0.9, 1.2])
    mount = effect("sensor.mount_resonance", period_s=1e-4, damping_ratio=zeta)
    driven = 2 * np.pi * np.array([100.0, 5e3, 2e4])
    _, mounting = freqs([2 * zeta * omega, omega**2], [1, 2 * zeta * omega, omega**2], driven)
    both = SensorChain.of([mount, effect("sensor.acceleration_gain", gain=gains)])
    seen = both.transmissibility(1j * driven)
    np.testing.assert_allclose(seen, gains[:, None] * mounting, rtol=1e-12)
    force, cell = np.hanning(40), ForceGain(gain=0.8)
    back = SensorEffect.true_force_n(cell, cell.measured_force_n(force, STEP_S), STEP_S)
    np.testing.assert_allclose(back, force, atol=1e-12)
