"""The acceleration of a plate under a force at one of its impact points, by superposition of modes.

The force is straight between its samples, and every mode's answer to that is exact: the
ramp-invariant rule of Smallwood (Shock and Vibration Bulletin 51, 1981) and ISO 18431-4, with the
state carried from sample to sample of the force and read wherever the output asks. After the force
a mode only decays, and needs no steps at all.

Damped oscillators of unit mass under a force that is straight between its samples, exactly.

Glossary: z the complex state of a mode, z' = lambda z + F with lambda = -zeta omega + i omega_d, so
that the modal coordinate is q = Im(z) / omega_d and its acceleration q'' = F + Im(lambda^2 z) /
omega_d.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from ...array_types import Complexes, Floats
from .modes import PlateModes

#: Steps of a force whose states are held at a time.
_BLOCK = 1024


@njit(cache=True)
def _step(
    decay: Complexes, level: Complexes, slope: Complexes, samples: Floats, states: Complexes
) -> None:
    """Each state (m, n) from the one before, by what a step keeps of it, and what the level and the
    growth of the force (n,) add."""
    for mode in range(decay.size):
        state = states[mode, 0]
        for i in range(1, samples.size):
            growth = samples[i] - samples[i - 1]
            state = decay[mode] * state + level[mode] * samples[i - 1] + slope[mode] * growth
            states[mode, i] = state


@dataclass(frozen=True)
class Oscillators:
    """Poles (m,), and what takes the states (m,) to accelerations at the sensors (sensors, m)."""

    poles: Complexes
    readings: Complexes

    @classmethod
    def of(cls, frequencies_hz: Floats, damping: Floats, weights: Floats) -> Oscillators:
        """The elastic ones among modes.

        Parameters:
            frequencies_hz: The modes' frequencies, of shape `(m,)`; 0 for rigid ones, which are
                left out.
            damping: The modes' damping ratios, of shape `(m,)`.
            weights: Shape at the sensor times shape at the hit, in 1/kg, of shape `(sensors, m)`.
        """
        elastic = frequencies_hz > 0  # a rigid mode's acceleration is the force itself
        omega, zeta = 2 * np.pi * frequencies_hz[elastic], damping[elastic]
        damped = omega * np.sqrt(1 - zeta**2)
        poles = -zeta * omega + 1j * damped
        return cls(poles, weights[:, elastic] * poles**2 / damped)

    def stepped(self, step_s: float, state: Complexes, samples: Floats) -> Complexes:
        """States `(m, samples)` at the samples of a force.

        Parameters:
            step_s: The time between two samples of the force.
            state: The states at the first sample, of shape `(m,)`.
            samples: The force in N, of shape `(samples,)`.
        """
        unit, none = np.ones(1), np.zeros((self.poles.size, 1), dtype=np.complex128)
        from_level = self.after(step_s * unit, none, unit, 0 * unit)[:, 0]
        from_slope = self.after(step_s * unit, none, 0 * unit, unit / step_s)[:, 0]
        states = np.empty((self.poles.size, samples.size), dtype=np.complex128)
        states[:, 0] = state
        _step(np.exp(self.poles * step_s), from_level, from_slope, samples, states)
        return states

    def after(self, since_s: Floats, states: Complexes, level: Floats, slope: Floats) -> Complexes:
        """States `(m, n)` some times after other states, under a force that grows evenly.

        Parameters:
            since_s: The times after `states`, of shape `(n,)`.
            states: The states before, of shape `(m, n)`.
            level: The force at `states` in N, of shape `(n,)`.
            slope: The growth of the force in N/s, of shape `(n,)`.
        """
        x = self.poles[:, None] * since_s
        first = _divided(np.expm1(x), x, 1 + x / 2 + x**2 / 6 + x**3 / 24 + x**4 / 120)
        second = _divided(first - 1, x, 1 / 2 + x / 6 + x**2 / 24 + x**3 / 120 + x**4 / 720)
        return np.asarray(
            np.exp(x) * states + level * since_s * first + slope * since_s**2 * second
        )

    def decaying(self, state: Complexes, delay_s: float, step_s: float, count: int) -> Floats:
        """Accelerations `(sensors, count)` in m/s2 without a force.

        exp(lambda (j B + k) step) is a product: two short tables instead of one number for every
        mode and instant.

        Parameters:
            state: The states, of shape `(m,)`.
            delay_s: The time of the first acceleration after `state`.
            step_s: The time between two accelerations.
            count: The number of accelerations.
        """
        length = math.isqrt(count - 1) + 1
        starts = np.exp(
            np.outer(self.poles, delay_s + step_s * length * np.arange(-(-count // length)))
        )
        within = np.exp(np.outer(self.poles, step_s * np.arange(length)))
        rows = [((reading * state)[:, None] * starts).T @ within for reading in self.readings]
        return np.array([row.imag.ravel()[:count] for row in rows]).reshape(-1, count)


def _divided(over: Complexes, x: Complexes, series: Complexes) -> Complexes:
    """over / x, by its series where that is the more exact."""
    small = np.abs(x) < 5e-3
    return np.where(small, series, over / np.where(small, 1, x))


#: Modes above the frequency beyond which f |F(f)|, what a ringing mode's acceleration goes with,
#: stays below this share of its peak are left out.
NEGLIGIBLE = 1e-4
_PADDING = 4
_UNIFORM = 1e-6


def respond(
    modes: PlateModes,
    force_time_s: Floats,
    force_n: Floats,
    time_s: Floats,
    *,
    point: int = 0,
    bandwidth_hz: float | None = None,
) -> Floats:
    """Acceleration `(sensors, n)` in m/s^2 at the times `time_s`, of a plate at rest before.

    Parameters:
        modes: The modes of the plate.
        force_time_s: An even grid of times, of shape `(k,)`.
        force_n: The force on this grid, of shape `(k,)`; it is zero outside the grid.
        time_s: The times of the accelerations, of shape `(n,)`; an even grid, too, which may begin
            before the force and end at any time.
        point: Index of the impact point at which the force acts; 0 by default.
        bandwidth_hz: Modes beyond this frequency are left out; by default that of the pulse, as
            `pulse_bandwidth_hz` gives it.

    Raises:
        ValueError: For uneven grids, shapes that do not fit, numbers that are not finite, and an
            impact point the modes do not have.
    """
    points = modes.shape_impact.shape[0]
    if point not in range(points):
        raise ValueError(
            f"point = {point!r}: expected 0 to {points - 1}, the impact points of these modes"
        )
    force = _Force.checked(force_time_s, force_n)
    step = _even_step("time_s", time_s)
    kept = modes.frequencies_hz <= (
        pulse_bandwidth_hz(force_time_s, force_n) if bandwidth_hz is None else bandwidth_hz
    )
    weights = modes.shapes[:, kept] * modes.shape_impact[point, kept]
    oscillators = Oscillators.of(modes.frequencies_hz[kept], modes.damping[kept], weights)
    acceleration = np.zeros((weights.shape[0], time_s.size))
    first, after = np.searchsorted(time_s, [force.start_s, force.stop_s], side="left")
    state = _during(oscillators, force, time_s[first:after], acceleration[:, first:after])
    acceleration[:, first:after] += weights.sum(axis=1)[:, None] * np.interp(
        time_s[first:after], force.time_s, force.n
    )
    if after < time_s.size:
        delay = float(time_s[after]) - force.stop_s
        acceleration[:, after:] = oscillators.decaying(state, delay, step, time_s.size - int(after))
    return acceleration


def pulse_bandwidth_hz(time_s: Floats, force_n: Floats) -> float:
    """The frequency (Hz) beyond which `f |F(f)|` stays below 1e-4 of its peak.

    Parameters:
        time_s: An even grid of times, of shape `(n,)`.
        force_n: The force on this grid, of shape `(n,)`.

    Returns:
        That frequency; 0 for no force at all, and infinity where the samples are too coarse to show
        such a frequency.

    Raises:
        ValueError: For an uneven grid.
    """
    step = _even_step("force_time_s", time_s)
    length = _PADDING * force_n.size
    frequency = np.fft.rfftfreq(length, step)
    ringing = frequency * np.abs(np.fft.rfft(force_n, length))
    if not ringing.any():
        return 0.0
    last = np.flatnonzero(ringing >= NEGLIGIBLE * ringing.max())[-1]
    return float(frequency[last]) if last < frequency.size - _PADDING else math.inf


@dataclass(frozen=True)
class _Force:
    """A force that is straight between samples `step_s` apart."""

    time_s: Floats
    n: Floats
    step_s: float

    @classmethod
    def checked(cls, time_s: Floats, force_n: Floats) -> _Force:
        if force_n.shape != time_s.shape:
            raise ValueError(
                f"force_n has shape {force_n.shape}: expected that of force_time_s, {time_s.shape}"
            )
        if not np.isfinite(force_n).all():
            raise ValueError("force_n: expected finite numbers")
        return cls(time_s, force_n, _even_step("force_time_s", time_s))

    @property
    def start_s(self) -> float:
        return float(self.time_s[0])

    @property
    def stop_s(self) -> float:
        return float(self.time_s[-1])


def _during(oscillators: Oscillators, force: _Force, time_s: Floats, out: Floats) -> Complexes:
    """Write what the states give at `time_s`, within the force, into `out` (sensors, n); the states
    at its end."""
    step = force.step_s
    state = np.zeros(oscillators.poles.size, dtype=np.complex128)
    steps = (time_s - force.start_s) / step
    index = np.minimum(steps.astype(np.intp), force.n.size - 2)
    nearest = np.rint(steps).astype(np.intp)
    on_samples = bool(np.all(np.abs(steps - nearest) < _UNIFORM))
    for begin in range(0, force.n.size - 1, _BLOCK):
        samples = force.n[begin : begin + _BLOCK + 1]
        states = oscillators.stepped(step, state, samples)
        inside = slice(*np.searchsorted(index, [begin, begin + samples.size - 1]))
        if on_samples:
            between = states[:, nearest[inside] - begin]
        else:
            local = index[inside] - begin
            since = time_s[inside] - force.start_s - index[inside] * step
            slopes = np.diff(samples)[local] / step
            between = oscillators.after(since, states[:, local], samples[local], slopes)
        out[:, inside] = (oscillators.readings @ between).imag
        state = states[:, -1]
    return state


def _even_step(name: str, time_s: Floats) -> float:
    if time_s.ndim != 1 or time_s.size < 2 or not np.isfinite(time_s).all():
        raise ValueError(
            f"{name} has shape {time_s.shape}: expected two or more finite times in a row"
        )
    step = float(time_s[-1] - time_s[0]) / (time_s.size - 1)
    if step <= 0 or np.abs(np.diff(time_s) - step).max() > _UNIFORM * step + 8 * np.spacing(
        np.abs(time_s).max()
    ):
        raise ValueError(f"{name}: expected rising times at one even step")
    return step
