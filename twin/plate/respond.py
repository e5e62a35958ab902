"""The acceleration of a plate under a force at one of its impact points, by superposition of modes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...array_types import Floats
from .modal import ModalPlate
from .recursion import Recursion


def respond(
    plate: ModalPlate, force_n: Floats, step_s: float, point: str = "#1", sensors: Sequence[str] | None = None
) -> Floats:
    """Acceleration in m/s2 at the sensors, all unless told: (sensors, n) for a force (n,), (k, sensors, n) for (k, n).

    The plate is at rest at the first sample; between samples the force is straight, and the answer to that is exact.
    Raises `LookupError` for a point or a sensor that the plate has not, `ValueError` for a force that is not finite and
    for modes beyond half of the sampling rate (`kept_below`).
    """
    force = np.asarray(force_n, dtype=np.float64)
    if force.ndim not in (1, 2) or not np.all(np.isfinite(force)):
        raise ValueError(f"force_n has shape {force.shape}: expected (n,) or (k, n), all finite")
    check_step(plate, step_s)
    gathered = weights(plate, point, sensors)
    rows = np.atleast_2d(force)
    # What a mode adds at once: its acceleration is the force itself, less what its spring and damper have built up.
    out = gathered.sum(axis=1)[:, None] * rows[:, None, :]
    _add_ringing(plate, rows, step_s, gathered, out)
    return np.asarray(out[0] if force.ndim == 1 else out)


def kept_below(plate: ModalPlate, frequency_hz: float) -> ModalPlate:
    """The plate with its modes below a frequency only."""
    kept = plate.frequency_hz < frequency_hz
    return replace(
        plate,
        frequency_hz=plate.frequency_hz[kept],
        damping_ratio=plate.damping_ratio[kept],
        shape_impact=plate.shape_impact[:, kept],
        shapes=plate.shapes[:, kept],
    )


def check_step(plate: ModalPlate, step_s: float) -> None:
    """Raises `ValueError` for a step that is no positive number, or too long for the plate's highest mode."""
    if not (math.isfinite(step_s) and step_s > 0):
        raise ValueError(f"step_s = {step_s!r}: expected a positive number")
    highest = float(plate.frequency_hz.max(initial=0.0))
    if highest * step_s >= 0.5:
        raise ValueError(
            f"step_s = {step_s:g}: the mode at {highest:g} Hz is beyond half the sampling rate, {0.5 / step_s:g} Hz; "
            "take a shorter step, or leave it out (kept_below)"
        )


def weights(plate: ModalPlate, point: str, sensors: Sequence[str] | None) -> Floats:
    """Shape at the sensor times shape at the hit, (sensors, m), 1/kg."""
    rows = [plate.sensor(name) for name in (plate.sensors if sensors is None else sensors)]
    return np.asarray(plate.shapes[rows] * plate.shape_impact[plate.point(point)])


def _add_ringing(plate: ModalPlate, force: Floats, step_s: float, gathered: Floats, out: Floats) -> None:
    from .kernels import ring

    elastic = plate.frequency_hz > 0  # a rigid mode's acceleration is the force, and no more
    step = Recursion.of(plate.frequency_hz[elastic], plate.damping_ratio[elastic], step_s)
    ring(step.turn, step.before, step.after, gathered[:, elastic], force, out)
