"""Restitution measured from recorded pulses and velocities, eq. 1.9 to 1.12.

Glossary: F force, v the impactor's velocity towards the target, m its mass, P impulse, W work, c
until the turn and r after it. The turn is where the impactor comes to rest, v = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .pulse import ContactPulse


@dataclass(frozen=True, eq=False)
class RecordedPulse:
    """n recorded pulses at p equidistant instants, from the begin of the contact to its end, offset
    removed.

    `force_n` (n, p), `interval_s`, `mass_kg` and `impact_velocity_m_s` (n,). Raises `ValueError`
    naming what does not fit. Velocities come from the force, v = u - P / m, so that errors of the
    load cell are in all that follows: one of the gain by g makes 1 + e a (1 + g)-fold; an offset b
    adds b T / (m u), white noise of deviation s a scatter of s sqrt(T interval) / (m u) (`noise`).
    A damped pulse sampled at 20 points gives e within 0.001 by impulses and 0.007 by works, at 65
    points within 1e-4 and 8e-4.
    """

    force_n: Floats
    interval_s: Floats
    mass_kg: Floats
    impact_velocity_m_s: Floats

    def __post_init__(self) -> None:
        if self.force_n.ndim != 2 or self.force_n.shape[1] < 3:
            raise ValueError(
                f"force_n has shape {self.force_n.shape}: expected (n, p) with 3 points or more"
            )
        if not np.all(np.isfinite(self.force_n)):
            raise ValueError("force_n: expected finite")
        for name in ("interval_s", "mass_kg", "impact_velocity_m_s"):
            values = getattr(self, name)
            if values.shape != self.force_n.shape[:1] or not np.all(
                (values > 0) & np.isfinite(values)
            ):
                raise ValueError(f"{name}: expected {self.force_n.shape[:1]}, positive and finite")

    @classmethod
    def of(
        cls, pulse: ContactPulse, mass_kg: Floats, impact_velocity_m_s: Floats, points: int = 1001
    ) -> Self:
        """The record of a law's pulses, without errors of the load cell.

        Parameters:
            pulse: n pulses of a law.
            mass_kg: Masses of the impactors (n,).
            impact_velocity_m_s: Impact velocities (n,).
            points: Number of instants of the record; 1001 by default.
        """
        return cls(
            pulse.force_n(points), pulse.contact_time_s / (points - 1), mass_kg, impact_velocity_m_s
        )

    @property
    def velocity_m_s(self) -> Floats:
        """v (n, p), by the trapezoid rule."""
        return np.asarray(
            self.impact_velocity_m_s[:, None] - self._running(self.force_n) / self.mass_kg[:, None]
        )

    def noise(self, force_noise_n: float) -> Floats:
        """Standard deviation (n,) of Newton's e from white noise of the force, sample by sample.

        Parameters:
            force_noise_n: Standard deviation of the noise of one sample.
        """
        samples = self.force_n.shape[1] - 1.5  # the trapezoid rule gives the two ends half a weight
        momentum = self.mass_kg * self.impact_velocity_m_s
        return np.asarray(force_noise_n * self.interval_s * np.sqrt(samples) / momentum)

    def split(self, rate: Floats, turn: Floats) -> tuple[Floats, Floats]:
        """Integrals (n,) over the time before and after the turn.

        Parameters:
            rate: The quantity that is integrated, (n, p).
            turn: Instant of the turn (n,), in intervals.
        """
        running = self._running(rate)
        until = _at(running, turn)
        return until, running[:, -1] - until

    def _running(self, rate: Floats) -> Floats:
        steps = (rate[:, 1:] + rate[:, :-1]) / 2 * self.interval_s[:, None]
        return np.concatenate([np.zeros((len(rate), 1)), np.cumsum(steps, axis=1)], axis=1)


def newton(approach_m_s: Floats, separation_m_s: Floats) -> Floats:
    """e = -u_r / u_i, eq. 1.9, of measured velocities. No force needed.

    Parameters:
        approach_m_s: Velocities of approach, positive, (n,).
        separation_m_s: Velocities of separation, positive, (n,).

    Raises:
        ValueError: For an approach that is not positive.
    """
    if np.any(~(approach_m_s > 0)):
        raise ValueError("approach_m_s: expected positive")
    return np.asarray(separation_m_s / approach_m_s)


def poisson(pulse: RecordedPulse, turn: Floats | None = None) -> Floats:
    """e = P_r / P_c, eq. 1.10.

    With the turn at v = 0 of the integrated force P_c is m u, and e Newton's of the same record.
    NaN where the impactor does not come to rest within the record: nothing comes back, or the
    record is too short.

    Parameters:
        pulse: n recorded pulses.
        turn: Instant of the turn (n,) in intervals, from a recorded indentation; by default None,
            that of v = 0.
    """
    compression, restitution = pulse.split(pulse.force_n, turn_of(pulse) if turn is None else turn)
    return np.asarray(restitution / compression)


def stronge(
    pulse: RecordedPulse,
    indentation_rate_m_s: Floats | None = None,
    wave_work_j: Floats | float = 0.0,
) -> Floats:
    """e = sqrt((W_r - W_w) / W_c), eq. 1.11 and 1.12; W_r counts what the contact gives back.

    0 where more is carried away than comes back, NaN without a turn.

    Parameters:
        pulse: n recorded pulses.
        indentation_rate_m_s: A recorded rate of indentation (n, p), with which the work is that of
            the contact alone. By default None, the impactor's own velocity: the work is that on the
            impactor, waves included, and W_w is 0.
        wave_work_j: W_w, a number or (n,): what the plate carries away, which is missing in the
            work of the contact alone; of a plate of point impedance Z it is `wave_work`. Then e
            follows Newton's to first order in the loss only. 0 by default.
    """
    rate = pulse.velocity_m_s if indentation_rate_m_s is None else indentation_rate_m_s
    compression, restitution = pulse.split(pulse.force_n * rate, first_fall(rate))
    return np.asarray(np.sqrt(np.maximum((-restitution - wave_work_j) / compression, 0.0)))


def wave_work(pulse: RecordedPulse, plate_impedance_n_s_m: Floats) -> Floats:
    """W_w (J, (n,)) of flexural waves in a plate without edges, the integral of F^2 / Z.

    Parameters:
        pulse: n recorded pulses.
        plate_impedance_n_s_m: Point impedance Z of the plate (n,), N s/m.
    """
    return np.asarray(
        np.trapezoid(pulse.force_n**2, axis=1) * pulse.interval_s / plate_impedance_n_s_m
    )


def turn_of(pulse: RecordedPulse) -> Floats:
    """Instant (n,) of v = 0, in intervals; NaN where there is none.

    Parameters:
        pulse: n recorded pulses.
    """
    return first_fall(pulse.velocity_m_s)


def first_fall(values: Floats) -> Floats:
    """Where each row first falls from positive through zero, (n,) in intervals, between points
    linearly; NaN: nowhere.

    Parameters:
        values: Series (n, p) at equidistant instants.
    """
    falls: NDArray[np.bool_] = (values[:, :-1] > 0) & (values[:, 1:] <= 0)
    rows, first = np.arange(len(values)), np.argmax(falls, axis=1)
    before, after = values[rows, first], values[rows, first + 1]
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(falls.any(axis=1), first + before / (before - after), np.nan)


def _at(running: Floats, place: Floats) -> Floats:
    """Rows (n, p) at places between their points (n,), linearly; NaN stays."""
    finite = np.isfinite(place)
    lower_index = np.clip(np.where(finite, place, 0.0).astype(np.intp), 0, running.shape[1] - 2)
    rows, share = np.arange(len(running)), place - lower_index
    return np.asarray(
        running[rows, lower_index] * (1 - share) + running[rows, lower_index + 1] * share
    )
