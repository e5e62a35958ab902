"""The chain's order, and what it refuses."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from pyroshock.twin.contact_interface import ForcePulses, ImpactBatch
from pyroshock.twin.effects import catalogue, effect
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.measured_pulses import measured_pulses
from support.records.twin_parts import HalfSine, setting


def test_order_given_does_not_matter_and_other_stages_and_doubles_are_refused():
    several = [
        effect("sensor.acceleration_gain"),
        effect("sensor.zero_shift"),
        effect("sensor.mount_resonance"),
    ]
    series = np.random.default_rng(0).standard_normal((1, 1, 64))
    forth, back = (
        SensorChain.of(each).measured_acceleration_m_s2(series, 1e-5)
        for each in (several, several[::-1])
    )
    np.testing.assert_array_equal(forth, back)
    with pytest.raises(TypeError, match=r"plate\.damping does not act here"):
        SensorChain.of([effect("plate.damping")])
    with pytest.raises(ValueError, match="given twice"):
        SensorChain.of([effect("sensor.force_gain"), effect("sensor.force_gain")])


def test_effects_stand_where_their_part_of_the_chain_is():
    """The mount, the sensing element, its gain, and what comes after it: filter and zero of the
    amplifier."""
    parts = (
        ("sensor.mount_resonance",),
        ("sensor.zero_shift",),
        (
            "sensor.acceleration_gain",
            "sensor.force_gain",
            "sensor.pressure_gain",
            "sensor.velocity_gain",
        ),
        ("sensor.force_bandwidth", "sensor.pressure_offset"),
    )
    own = [each for each in catalogue() if each.startswith("sensor.")]
    both = SensorChain.of([effect(each) for each in own[::-1]])
    assert [(each.id, each.place) for each in both.effects] == [
        (one, at) for at, of in enumerate(parts) for one in of
    ]


def test_element_shifts_by_a_share_of_what_the_mount_lets_it_feel_and_the_gain_scales_both():
    series = np.zeros((1, 200))
    series[0, 5:] = np.sin(np.arange(195) / 3)
    shift, mount = effect("sensor.zero_shift", share=0.1), effect("sensor.mount_resonance")
    felt = SensorChain.of([mount]).measured_acceleration_m_s2(series, 1e-5)
    expected = SensorChain.of([shift]).measured_acceleration_m_s2(felt, 1e-5)
    np.testing.assert_array_equal(
        SensorChain.of([shift, mount]).measured_acceleration_m_s2(series, 1e-5), expected
    )
    knock = np.zeros((1, 1, 10))
    knock[..., 3] = 100.0
    lasting = effect("sensor.zero_shift", share=0.1, decay_time_s=1e3)
    both = SensorChain.of([effect("sensor.acceleration_gain", gain=2.0), lasting])
    assert both.measured_acceleration_m_s2(knock, 1e-5)[0, 0, -1] == pytest.approx(20.0, rel=1e-6)


def test_force_is_scaled_and_filtered_alike_whatever_is_beside_it():
    force = np.random.default_rng(3).standard_normal((2, 30))
    gain, low_pass = (
        effect("sensor.force_gain", gain=np.array([0.5, 3.0])),
        effect("sensor.force_bandwidth"),
    )
    expected = low_pass.measured_force_n(force * [[0.5], [3.0]], 1e-5)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(
        SensorChain.of([low_pass, gain]).measured_force_n(force, 1e-5), expected
    )
    alone, beside = (
        measured_pulses(LOW_PASS, of_lengths(*times)) for times in ((3e-4,), (5e-5, 3e-4, 2e-3))
    )
    np.testing.assert_array_equal(beside.force_n[1], alone.force_n[0])
    assert beside.contact_time_s[1] == alone.contact_time_s[0]


def pulses():
    return HalfSine().pulses(ImpactBatch([setting()] * 2, np.array([4.0, 8.0])))


def test_gain_scales_forces_and_a_low_pass_lengthens_the_contact_and_keeps_the_impulse():
    """A gain for each shot meets its own pulse; without effects pulses are the same object."""
    given = pulses()
    assert measured_pulses(SensorChain(), given) is given
    for gain in (1.5, np.array([1.0, 2.0])):
        louder = measured_pulses(SensorChain.of([effect("sensor.force_gain", gain=gain)]), given)
        np.testing.assert_allclose(louder.contact_time_s, given.contact_time_s)
        np.testing.assert_allclose(louder.compression_time_s, given.compression_time_s, rtol=0.01)
        expected = np.reshape(gain, (-1, 1)) * given.force_n
        np.testing.assert_allclose(louder.force_n, expected, atol=1e-3 * given.force_n.max())
    gains, unlike = (
        SensorChain.of([effect("sensor.force_gain", gain=np.array([1.0, 2.0]))]),
        of_lengths(1e-4, 1e-2),
    )
    np.testing.assert_allclose(
        measured_pulses(gains, unlike).peak_force_n, [1, 2] * unlike.peak_force_n, rtol=1e-3
    )
    seen = measured_pulses(LOW_PASS, given)
    assert np.all(seen.contact_time_s > 1.1 * given.contact_time_s)
    assert np.all(seen.peak_force_n < 0.995 * given.peak_force_n)
    np.testing.assert_allclose(seen.impulse_n_s, given.impulse_n_s, rtol=2e-3)


LOW_PASS = SensorChain.of([effect("sensor.force_bandwidth", time_constant_s=2e-5)])


def of_lengths(*contact_time_s):
    one, times = pulses(), np.array(contact_time_s)
    return ForcePulses(times, np.repeat(one.force_n[:1], len(times), axis=0), times / 2)


def test_contact_of_seconds_takes_no_room_of_microseconds():
    """The series had steps of the shortest and the length of the longest: gigabytes for a hundred
    draws."""
    tracemalloc.start()
    seen = measured_pulses(LOW_PASS, of_lengths(5e-5, *[5.0] * 100))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 50e6
    np.testing.assert_allclose(seen.contact_time_s[1:], 5.0, rtol=1e-2)
    assert seen.contact_time_s[0] > 1.5 * 5e-5
