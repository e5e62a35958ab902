"""Pulses as the force channel shows them, against what a low pass makes of a half-sine on paper."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.twin.contact_interface import ForcePulses
from pyroshock.twin.effects import Value, effect
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.measured_pulses import measured_pulses

#: Of a pulse's contact are its steps.
STEPS = 256
#: A power of two begins an octave.
OCTAVE_S = 2.0**-13


def half_sines(contact_time_s: Floats, peak_n: Floats, points: int = 1025) -> ForcePulses:
    shape = np.sin(np.pi * np.linspace(0, 1, points))
    shape[-1] = 0.0
    return ForcePulses(contact_time_s, peak_n[:, None] * shape, contact_time_s / 2)


def low_pass(time_constant_s: Value) -> SensorChain:
    return SensorChain.of([effect("sensor.force_bandwidth", time_constant_s=time_constant_s)])


class Shown:
    """A half-sine of peak 1 through one pole: tau y' + y = sin(pi t / T) until T, free from
    there."""

    def __init__(self, contact_time_s: float, tau_s: float) -> None:
        self.contact_time_s, self.tau_s = contact_time_s, tau_s
        time = np.linspace(0, 2 * contact_time_s, 400_001)
        force = self.force(time)
        self.peak, self.peak_time_s = force.max(), time[force.argmax()]
        at_end = self.force(np.array([contact_time_s]))[0]
        self.end_s = contact_time_s + tau_s * np.log(at_end / (0.005 * self.peak))

    def force(self, time_s: Floats) -> Floats:
        x = np.pi * self.tau_s / self.contact_time_s
        during = np.minimum(time_s, self.contact_time_s)
        phase = np.pi * during / self.contact_time_s
        driven = (np.sin(phase) - x * np.cos(phase) + x * np.exp(-during / self.tau_s)) / (1 + x**2)
        return np.asarray(
            driven * np.exp(-np.maximum(time_s - self.contact_time_s, 0.0) / self.tau_s)
        )


def agrees(seen: ForcePulses, given: ForcePulses, row: int, tau_s: float, step_s: float) -> None:
    """Its course, its end to the step before it falls below 0.5 % of the peak, and how much later
    its peak is."""
    truth, size = Shown(given.contact_time_s[row], tau_s), given.peak_force_n[row]
    assert truth.end_s - 1.02 * step_s < seen.contact_time_s[row] <= truth.end_s + 0.02 * step_s
    time = np.linspace(0, 1, seen.force_n.shape[1]) * seen.contact_time_s[row]
    # Straight between steps: the course bends most at its beginning, by pi / (T tau).
    bend = np.pi / (given.contact_time_s[row] * tau_s) * step_s**2 / 8
    np.testing.assert_allclose(
        seen.force_n[row], size * truth.force(time), atol=(1e-4 + 1.2 * bend) * size
    )
    later = seen.compression_time_s[row] - given.compression_time_s[row]
    assert later == pytest.approx(
        truth.peak_time_s - given.contact_time_s[row] / 2, abs=0.6 * step_s
    )


@pytest.mark.parametrize("share", [0.03, 0.11, 0.37, 0.8, 1.6, 5.0])
def test_a_half_sine_is_seen_as_on_paper(share: float) -> None:
    """0.8: a tail of four contacts is seen to its end; 5: one of 26."""
    time = 3e-4
    given = half_sines(np.array([time]), np.array([7e3]))
    agrees(measured_pulses(low_pass(share * time), given), given, 0, share * time, time / STEPS)


def test_pulses_of_several_octaves_and_sizes_are_each_seen_as_alone() -> None:
    """Of one octave, too: the longest of it is twice the shortest."""
    time = OCTAVE_S * np.array([1.0, 1.999, 1.3, 9.0, 300.0])
    given = half_sines(time, np.array([5e3, 2.0, 8e4, 1e3, 30.0]))
    tau = OCTAVE_S * 0.2
    seen = measured_pulses(low_pass(tau), given)
    for row in range(3):
        agrees(seen, given, row, tau, time[0] / STEPS)
    agrees(seen, given, 3, tau, time[3] / STEPS)
    np.testing.assert_allclose(seen.impulse_n_s, given.impulse_n_s, rtol=3e-3)


def test_a_long_tail_keeps_its_impulse_whatever_is_beside_it() -> None:
    tau, time = 1.6e-4, np.array([1.2e-4, 6.2e-5, 1e-4, 1.24e-4])
    given = half_sines(time, np.array([1e3, 1e3, 2e3, 5e3]))
    together = measured_pulses(low_pass(tau), given)
    # What lies behind 0.5 % of the peak: tau times that, of some T / 2 and tau.
    np.testing.assert_allclose(together.impulse_n_s, given.impulse_n_s, rtol=0.012)
    for row in range(4):
        alone = measured_pulses(
            low_pass(tau), ForcePulses(time[[row]], given.force_n[[row]], time[[row]] / 2)
        )
        assert together.contact_time_s[row] == pytest.approx(alone.contact_time_s[0], rel=2e-3)


def test_each_pulse_has_its_own_low_pass_and_the_longest_of_an_octave_its_end() -> None:
    time = OCTAVE_S * np.array([1.0, 1.999])
    given, shortest = half_sines(time, np.array([1e3, 1e3])), OCTAVE_S * 0.01
    agrees(measured_pulses(low_pass(shortest), given), given, 1, shortest, time[0] / STEPS)
    time = np.array([3e-4, 2e-3, 3.1e-4])
    tau = np.array([1e-4, 2e-4, 3e-5])
    given = half_sines(time, np.array([1e3, 2e3, 3e3]))
    seen = measured_pulses(low_pass(tau), given)
    for row, step in enumerate((3e-4, 2e-3, 3e-4)):
        agrees(seen, given, row, tau[row], step / STEPS)


def test_a_pulse_that_no_effect_changes_stays_as_it_is() -> None:
    given = half_sines(np.array([1e-4, 3e-3]), np.array([1e3, 2e3]))
    other_channel = SensorChain.of(
        [effect("sensor.velocity_gain"), effect("sensor.mount_resonance")]
    )
    assert measured_pulses(other_channel, given) is given
    assert measured_pulses(low_pass(np.zeros(2)), given) is given
    second = measured_pulses(low_pass(np.array([0.0, 3e-4])), given)
    np.testing.assert_array_equal(second.force_n[0], given.force_n[0])
    assert second.contact_time_s[0] == given.contact_time_s[0]
    assert second.contact_time_s[1] > given.contact_time_s[1]
    assert given.contact_time_s[1] == 3e-3 and given.force_n[1].max() == 2e3, "what was given stays"


@pytest.mark.parametrize("at", [37, 38])
def test_a_gain_moves_no_peak_to_before_where_it_was(at: int) -> None:
    """In steps the peak is found a little before (38) or after (37) where it is."""
    phases = np.arange(100) / 99
    shape = np.interp(phases, [0, at / 99, 1], [0.0, 1e3, 0.0])
    given = ForcePulses(np.array([1e-3]), shape[None], np.array([4e-4]))
    seen = measured_pulses(SensorChain.of([effect("sensor.force_gain", gain=2.0)]), given)
    assert 4e-4 <= seen.compression_time_s[0] <= 4e-4 + 0.5 * 1e-3 / STEPS


def test_peak_of_a_coarse_pulse_is_late_and_no_force_stays_none() -> None:
    """A triangle of three points: y = F (t - tau (1 - exp(-t / tau))) / (T / 2), less twice that
    from T / 2 on."""
    time, tau = 1e-3, 1e-4
    given = ForcePulses(np.array([time]), np.array([[0.0, 500.0, 0.0]]), np.array([time / 2]))
    seen = measured_pulses(low_pass(tau), given)
    # y' = 0 behind the middle: exp(-s / tau) (2 - exp(-T / 2 tau)) = 1
    later = tau * np.log(2 - np.exp(-time / 2 / tau))
    assert seen.compression_time_s[0] - time / 2 == pytest.approx(later, abs=0.6 * time / STEPS)
    given = half_sines(np.array([3e-4, 3e-4]), np.array([1e3, 0.0]))
    seen = measured_pulses(low_pass(5e-5), given)
    assert seen.contact_time_s[1] == 3e-4 and seen.compression_time_s[1] == 1.5e-4
    np.testing.assert_array_equal(seen.force_n[1], 0.0)
    agrees(seen, given, 0, 5e-5, 3e-4 / STEPS)
