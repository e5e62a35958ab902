"""Gains that grow and an offset that fades over the reading: their closed forms, their inverses,
and the plain laws."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.twin.effects import effect, effect_from_json
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.effects.force_gain import REFERENCE_N
from pyroshock.twin.sensors.effects.pressure_gain import REFERENCE_PA
from pyroshock.twin.sensors.effects.velocity_gain import REFERENCE_M_S

GAINS, GROWTHS = st.floats(0.8, 1.25), st.floats(0.0, 1.5)
READINGS_PA = np.linspace(0.0, 7e5, 29)
STEP_S = 1e-5


def chain(identity: str, **parameters: float | np.ndarray) -> SensorChain:
    return SensorChain.of([effect(identity, **parameters)])


def gains(gain: float, growth: float) -> tuple[SensorChain, SensorChain]:
    """Of the pressure and of the velocity."""
    pressure, velocity = (
        chain(f"sensor.{name}_gain", gain=gain, growth=growth) for name in ("pressure", "velocity")
    )
    return pressure, velocity


@given(gain=st.floats(0.5, 2.0), offset_pa=st.floats(-1e5, 1e5))
def test_laws_of_old_files_are_a_plain_gain_and_a_plain_offset_to_the_bit(gain, offset_pa):
    pressure, velocity, offset = (
        SensorChain.of([effect_from_json({"id": f"sensor.{name}", parameter: value})])
        for name, parameter, value in (
            ("pressure_gain", "gain", gain),
            ("velocity_gain", "gain", gain),
            ("pressure_offset", "offset_pa", offset_pa),
        )
    )
    np.testing.assert_array_equal(pressure.true_pressure_pa(READINGS_PA), READINGS_PA / gain)
    np.testing.assert_array_equal(pressure.measured_pressure_pa(READINGS_PA), READINGS_PA * gain)
    np.testing.assert_array_equal(
        offset.true_pressure_pa(READINGS_PA), np.maximum(READINGS_PA - offset_pa, 0.0)
    )
    np.testing.assert_array_equal(offset.measured_pressure_pa(READINGS_PA), READINGS_PA + offset_pa)
    velocities_m_s = np.linspace(0.0, 60.0, 13)
    np.testing.assert_array_equal(
        velocity.measured_velocity_m_s(velocities_m_s), velocities_m_s * gain
    )
    np.testing.assert_array_equal(velocity.true_velocity_m_s(velocities_m_s), velocities_m_s / gain)
    force = SensorChain.of([effect_from_json({"id": "sensor.force_gain", "gain": gain})])
    forces_n = np.linspace(-500.0, 3e4, 13)
    np.testing.assert_array_equal(force.measured_force_n(forces_n, STEP_S), forces_n * gain)
    np.testing.assert_array_equal(force.true_force_n(forces_n, STEP_S), forces_n / gain)


def test_growing_gains_are_the_stated_ones_at_their_reference_and_square_at_twice_that():
    assert (REFERENCE_PA, REFERENCE_M_S) == (2.5e5, 25.0)
    for growth in (0.0, 0.7, 1.5):
        pressure, velocity = gains(1.1, growth)
        assert pressure.true_pressure_pa(np.array([2.5e5]))[0] == pytest.approx(2.5e5 / 1.1)
        assert velocity.measured_velocity_m_s(np.array([25.0]))[0] == pytest.approx(27.5)
    pressure, velocity = gains(1.1, 1.0)
    np.testing.assert_allclose(
        pressure.true_pressure_pa(np.array([0.01, 5e5])), [0.01, 5e5 / 1.1**2], rtol=1e-6
    )
    np.testing.assert_allclose(velocity.measured_velocity_m_s(np.array([50.0])), [50.0 * 1.1**2])
    # near the reference it is the straight line of a sensor that is not linear
    small = gains(1.001, 0.5)[1].measured_velocity_m_s(np.array([75.0]))[0]
    assert small / 75.0 - 1 == pytest.approx(0.001 * (1 + 0.5 * 2), rel=2e-3)


@given(gain=GAINS, growth=GROWTHS, share=st.floats(0.01, 1.0))
def test_readings_and_true_values_go_back_and_forth(gain, growth, share):
    """As far as the characteristic rises: up to 1 / (growth ln gain) references."""
    turn = 1 / max(abs(growth * np.log(gain)), 1e-9)
    references = np.array([share * 0.95 * min(4.0, turn)])
    pressure, velocity = gains(gain, growth)
    true_pa = pressure.true_pressure_pa(references * REFERENCE_PA)
    back_pa = pressure.measured_pressure_pa(true_pa)
    np.testing.assert_allclose(back_pa, references * REFERENCE_PA, rtol=1e-6)
    read_m_s = velocity.measured_velocity_m_s(references * REFERENCE_M_S)
    back_m_s = velocity.true_velocity_m_s(read_m_s)
    np.testing.assert_allclose(back_m_s, references * REFERENCE_M_S, rtol=1e-6)


@given(gain=st.floats(0.5, 2.0), growth=GROWTHS)
def test_a_characteristic_never_falls_and_always_has_a_value(gain, growth):
    sizes = np.linspace(0.0, 30.0, 61)
    pressure, velocity = gains(gain, growth)
    for image in (
        pressure.true_pressure_pa(sizes * 1e5),
        pressure.measured_pressure_pa(sizes * 1e5),
        velocity.measured_velocity_m_s(sizes * 3),
        velocity.true_velocity_m_s(sizes * 3),
    ):
        assert np.all(np.isfinite(image))
        assert np.all(np.diff(image) >= -1e-9 * image.max())


def test_a_fading_offset_is_whole_at_an_open_tank_and_nothing_at_the_end_of_the_range():
    fading = chain("sensor.pressure_offset", offset_pa=2e4, fading_1_pa=1 / 4e5)
    true_pa = np.array([0.0, 2e5, 4e5])
    read_pa = fading.measured_pressure_pa(true_pa)
    np.testing.assert_allclose(read_pa, [2e4, 2.1e5, 4e5], rtol=1e-12)
    np.testing.assert_allclose(fading.true_pressure_pa(read_pa), true_pa, atol=1e-6)
    assert fading.true_pressure_pa(np.array([1e4])) == [0.0]


@given(gain=GAINS, growth=GROWTHS, share=st.floats(-0.05, 1.0))
def test_forces_go_back_and_forth_and_bend_as_a_straight_line_of_the_gain(gain, growth, share):
    """ISO 376 states the error of interpolation over the range of a cell, which such a gain makes
    quadratic."""
    turn_n = REFERENCE_N / max(abs(growth * np.log(gain)), 1e-9)
    force_n = np.array([share * 0.95 * min(4 * REFERENCE_N, turn_n)])
    cell = chain("sensor.force_gain", gain=gain, growth=growth)
    read_n = cell.measured_force_n(force_n, STEP_S)
    np.testing.assert_allclose(cell.true_force_n(read_n, STEP_S), force_n, rtol=1e-6, atol=1e-9)
    small = chain("sensor.force_gain", gain=1.001, growth=growth).measured_force_n(
        np.array([2e4, 3e4]), STEP_S
    )
    straight = np.array([2e4, 3e4]) * (1 + 0.001 * (1 + growth * np.array([1.0, 2.0])))
    np.testing.assert_allclose(small, straight, rtol=1e-5)


def test_impacts_have_their_own_growth_of_the_force_gain_over_a_whole_history():
    histories = np.outer([1.0, 2.0], [0.0, 5e3, 1e4])
    cell = chain("sensor.force_gain", gain=np.array([1.1, 1.1]), growth=np.array([0.0, 1.0]))
    read_n = cell.measured_force_n(histories, STEP_S)
    np.testing.assert_allclose(read_n[0], 1.1 * histories[0])
    np.testing.assert_allclose(read_n[1], histories[1] * 1.1 ** (histories[1] / 1e4))


def test_shots_have_their_own_growth():
    readings, growths = np.array([5e5, 5e5, 5e5]), np.array([0.0, 0.5, 1.0])
    together = chain("sensor.pressure_gain", gain=np.array([1.1, 1.1, 0.9]), growth=growths)
    np.testing.assert_allclose(
        together.true_pressure_pa(readings), 5e5 / np.array([1.1, 1.1**1.5, 0.9**2])
    )
    back = together.measured_pressure_pa(together.true_pressure_pa(readings))
    np.testing.assert_allclose(back, readings, rtol=1e-12)
