"""The plate's answer to short pulses, computed once and convolved.

The acceleration of a plate under a force at one of its impact points, by superposition of modes.

The compiled loop over samples and blocks of modes.

The exact step of a mode under a force that is straight between its samples: the ramp-invariant
rule.

Glossary: q modal coordinate, q'' + 2 zeta omega q' + omega^2 q = F for a unit shape; lambda = -zeta
omega + i omega_d its pole; z' = lambda z + F, so that q = Im(z) / omega_d; w = lambda^2 z /
omega_d, so that q'' = F + Im(w).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import NDArray

from ...array_types import Complexes, Floats
from .modal import ModalPlate

#: Below this |lambda dt| a series of five terms is the more exact one.
_SMALL = 2e-2


@dataclass(frozen=True, eq=False)
class Recursion:
    """w[n+1] = turn w[n] + before F[n] + after F[n+1] for every mode; each (m,), complex.

    Smallwood's rule (Shock and Vibration Bulletin 51, 1981; ISO 18431-4) in the form of a turning
    pointer. His two-step form has the same numbers on paper, but the roots of its polynomial crowd
    at 1 where omega dt is small, and it loses (omega dt)^-2 of the precision; the pointer loses
    nothing.
    """

    turn: Complexes
    before: Complexes
    after: Complexes

    @classmethod
    def of(cls, frequency_hz: Floats, damping_ratio: Floats, step_s: float) -> Recursion:
        """The rule for each of m modes.

        Parameters:
            frequency_hz: Frequencies of the modes (m,), above 0 Hz.
            damping_ratio: Damping ratios of the modes (m,), below 1.
            step_s: Time between two samples.
        """
        omega = 2 * np.pi * frequency_hz
        damped = omega * np.sqrt(1 - damping_ratio**2)
        pole = -damping_ratio * omega + 1j * damped
        x = np.asarray(pole * step_s, dtype=np.complex128)
        level = _over(np.expm1(x), x, (1, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720))
        slope = _over(level - 1, x, (1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720, 1 / 5040))
        gain = pole**2 / damped * step_s
        return cls(np.exp(x), gain * (level - slope), gain * slope)


def _over(numerator: Complexes, x: Complexes, series: tuple[float, ...]) -> Complexes:
    """numerator / x, by its series (rising powers) where x is small."""
    small = np.abs(x) < _SMALL
    powers = np.polynomial.polynomial.polyval(x, np.asarray(series))
    return np.where(small, powers, numerator / np.where(small, 1, x))


def respond(
    plate: ModalPlate,
    force_n: Floats,
    step_s: float,
    point: str = "#1",
    sensors: Sequence[str] | None = None,
) -> Floats:
    """Acceleration at sensors, m/s2.

    The plate is at rest at the first sample; between samples the force is straight, and the answer
    to that is exact.

    Parameters:
        plate: The plate.
        force_n: The force at the impact point (n,), or k of them (k, n).
        step_s: Time between two samples.
        point: Name of the impact point; "#1" by default.
        sensors: Names of the sensors; by default None, all sensors of the plate.

    Returns:
        Accelerations (sensors, n) for one force, (k, sensors, n) for k forces.

    Raises:
        LookupError: For a point or a sensor that the plate has not.
        ValueError: For a force that is not finite and for modes beyond half of the sampling rate
            (`kept_below`).
    """
    force = np.asarray(force_n, dtype=np.float64)
    if force.ndim not in (1, 2) or not np.all(np.isfinite(force)):
        raise ValueError(f"force_n has shape {force.shape}: expected (n,) or (k, n), all finite")
    check_step(plate, step_s)
    gathered = weights(plate, point, sensors)
    rows = np.atleast_2d(force)
    # What a mode adds at once: its acceleration is the force itself, less what its spring and
    # damper have built up.
    out = gathered.sum(axis=1)[:, None] * rows[:, None, :]
    _add_ringing(plate, rows, step_s, gathered, out)
    return np.asarray(out[0] if force.ndim == 1 else out)


def kept_below(plate: ModalPlate, frequency_hz: float) -> ModalPlate:
    """The plate with its modes below a frequency only.

    Parameters:
        plate: The plate with all its modes.
        frequency_hz: The frequency; a mode at this very frequency is left out.
    """
    kept = plate.frequency_hz < frequency_hz
    return replace(
        plate,
        frequency_hz=plate.frequency_hz[kept],
        damping_ratio=plate.damping_ratio[kept],
        shape_impact=plate.shape_impact[:, kept],
        shapes=plate.shapes[:, kept],
    )


def check_step(plate: ModalPlate, step_s: float) -> None:
    """Refuses a step that does not suit a plate.

    Parameters:
        plate: The plate.
        step_s: Time between two samples.

    Raises:
        ValueError: For a step that is no positive number, or too long for the plate's highest mode.
    """
    if not (math.isfinite(step_s) and step_s > 0):
        raise ValueError(f"step_s = {step_s!r}: expected a positive number")
    highest = float(plate.frequency_hz.max(initial=0.0))
    if highest * step_s >= 0.5:
        raise ValueError(
            f"step_s = {step_s:g}: the mode at {highest:g} Hz is beyond half the sampling rate, "
            f"{0.5 / step_s:g} Hz; take a shorter step, or leave it out (kept_below)"
        )


def weights(plate: ModalPlate, point: str, sensors: Sequence[str] | None) -> Floats:
    """Shape at the sensor times shape at the hit, (sensors, m), 1/kg.

    Parameters:
        plate: The plate, with m modes.
        point: Name of the impact point.
        sensors: Names of the sensors; None for all sensors of the plate.

    Raises:
        LookupError: For a point or a sensor that the plate has not.
    """
    rows = [plate.sensor(name) for name in (plate.sensors if sensors is None else sensors)]
    return np.asarray(plate.shapes[rows] * plate.shape_impact[plate.point(point)])


def _add_ringing(
    plate: ModalPlate, force: Floats, step_s: float, gathered: Floats, out: Floats
) -> None:

    elastic = plate.frequency_hz > 0  # a rigid mode's acceleration is the force, and no more
    step = Recursion.of(plate.frequency_hz[elastic], plate.damping_ratio[elastic], step_s)
    ring(step.turn, step.before, step.after, gathered[:, elastic], force, out)


#: Threads of one transform; more do not pay for some ten thousand samples.
_WORKERS = 2
#: Pulses are given room in steps of so many samples, so that few transforms of the plate's own
#: answer serve all.
_ROOM = 512


@dataclass(frozen=True, eq=False)
class PlateResponse:
    """Acceleration (sensors, n) after a unit force that is 0 at the samples around one and straight
    between.

    `hat` begins a step before its peak, `jump` with the peak; both have their peak at the first
    sample. Any force that is straight between its samples is a sum of these, so that the answers
    are those of `respond`, to rounding.
    """

    hat: Floats
    jump: Floats
    step_s: float
    _spectra: dict[int, NDArray[np.complex128]] = field(
        default_factory=dict, init=False, repr=False
    )

    @classmethod
    def of(
        cls,
        plate: ModalPlate,
        point: str,
        sensors: Sequence[str] | None,
        step_s: float,
        samples: int,
    ) -> Self:
        """The answers of a plate under a force at one point.

        Parameters:
            plate: The plate.
            point: Name of the impact point.
            sensors: Names of the sensors; None for all sensors of the plate.
            step_s: Time between two samples.
            samples: n, the number of samples of a record, 2 or more.

        Raises:
            LookupError: As `respond`.
            ValueError: As `respond`, and for too few samples.
        """
        if samples < 2:
            raise ValueError(f"samples = {samples}: expected 2 or more")
        unit = np.zeros((2, samples + 1))
        unit[0, 1] = unit[1, 0] = 1.0
        late, jump = respond(plate, unit, step_s, point, sensors)
        return cls(np.ascontiguousarray(late[:, 1:]), np.ascontiguousarray(jump[:, :-1]), step_s)

    def accelerations(self, force_n: Floats, workers: int = _WORKERS) -> Floats:
        """Accelerations under forces, m/s2.

        Parameters:
            force_n: One force (p,) or k of them (k, p), in samples that are `step_s` apart; p is at
                most n, and the force is zero after them.
            workers: Threads of one transform; two by default. Two end sooner and take more
                processor time than one.

        Returns:
            Accelerations (sensors, n) for one force, (k, sensors, n) for k forces.

        Raises:
            ValueError: For another shape, and for a force that is not finite.
        """
        force = np.asarray(force_n, dtype=np.float64)
        samples = self.hat.shape[1]
        if force.ndim not in (1, 2) or force.shape[-1] > samples or not np.all(np.isfinite(force)):
            raise ValueError(
                f"force_n has shape {force.shape}: expected (p,) or (k, p), p "
                f"up to {samples}, all finite"
            )
        rows = np.atleast_2d(force)
        out = self._convolved(rows, workers)
        begun = np.flatnonzero(rows[:, 0])
        out[begun] += rows[begun, 0, None, None] * (self.jump - self.hat)
        return np.asarray(out[0] if force.ndim == 1 else out)

    def _convolved(self, rows: Floats, workers: int) -> Floats:
        from scipy.fft import irfft, next_fast_len, rfft

        samples = self.hat.shape[1]
        length = next_fast_len(samples + _ROOM * -(-rows.shape[1] // _ROOM), real=True)
        spectra = rfft(rows, length, workers=workers)
        if length not in self._spectra:
            self._spectra[length] = rfft(self.hat, length)
        answers = self._spectra[length]
        return np.asarray(
            irfft(spectra[:, None] * answers, length, workers=workers, overwrite_x=True)[
                ..., :samples
            ]
        )


#: Modes that go through one loop over time together: their states stay in registers or the first
#: cache.
BLOCK = 32


@njit(cache=True, fastmath={"reassoc", "contract", "nsz"})
def _ring(
    turn_r: Floats,
    turn_i: Floats,
    before_r: Floats,
    before_i: Floats,
    after_r: Floats,
    after_i: Floats,
    weights: Floats,
    force: Floats,
    out: Floats,
) -> None:
    """Adds the sum over modes of weight times Im(w) to `out` (k, sensors, n).

    Modes lie in blocks (blocks, BLOCK), `weights` (blocks, sensors, BLOCK); `force` is (k, n).
    """
    blocks, sensors = weights.shape[0], weights.shape[1]
    real, imag = np.empty(BLOCK), np.empty(BLOCK)
    for shot in range(force.shape[0]):
        for b in range(blocks):
            tr, ti, br, bi, ar, ai = (
                turn_r[b],
                turn_i[b],
                before_r[b],
                before_i[b],
                after_r[b],
                after_i[b],
            )
            rate = weights[b]
            # At rest before the first sample: a force that begins with a jump has had no time to
            # act.
            real[:] = 0.0
            imag[:] = 0.0
            for n in range(1, force.shape[1]):
                old, new = force[shot, n - 1], force[shot, n]
                for j in range(BLOCK):
                    r = tr[j] * real[j] - ti[j] * imag[j] + br[j] * old + ar[j] * new
                    imag[j] = tr[j] * imag[j] + ti[j] * real[j] + bi[j] * old + ai[j] * new
                    real[j] = r
                for s in range(sensors):
                    total = 0.0
                    for j in range(BLOCK):
                        total += rate[s, j] * imag[j]
                    out[shot, s, n] += total


def ring(
    turn: Complexes,
    before: Complexes,
    after: Complexes,
    weights: Floats,
    force: Floats,
    out: Floats,
) -> None:
    """Adds the sum over modes of weight times Im(w) to an array, for any number of modes.

    Parameters:
        turn: Factors of the last state of each mode (m,).
        before: Factors of the force at the last sample (m,).
        after: Factors of the force at this sample (m,).
        weights: Shape at the sensor times shape at the hit (sensors, m), 1/kg.
        force: Forces (k, n), N.
        out: Accelerations (k, sensors, n), m/s2, which are added to in place.
    """
    blocks = -(-turn.size // BLOCK)
    padding = blocks * BLOCK - turn.size
    parts = (part for z in (turn, before, after) for part in (z.real, z.imag))
    tr, ti, br, bi, ar, ai = (np.pad(part, (0, padding)).reshape(blocks, BLOCK) for part in parts)
    padded = np.pad(weights, ((0, 0), (0, padding))).reshape(len(weights), blocks, BLOCK)
    _ring(
        tr,
        ti,
        br,
        bi,
        ar,
        ai,
        np.ascontiguousarray(padded.swapaxes(0, 1)),
        np.ascontiguousarray(force),
        out,
    )
