"""What modes a plate rings with after a contact, in closed form, and how a mounted sensor shows them.

q'' of mode m is Im(lambda^2 / omega_d Z exp(lambda t)) with Z the integral of F exp(-lambda t): recursion.py.

By how much later than its force a plate rings tells a slow force channel from a mounting that resonates. Under a force
about the time c a mode begins with the phase of Z exp(lambda c), 0 or a half turn for a short and even contact,
whatever its frequency; a delay d turns it by omega d. An uneven and long contact has a phase of its own, which is taken
off: it would be taken for other half turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import Effect
from ....twin.plate.modal import ModalPlate
from ....twin.sensors.effects.acceleration_gain import AccelerationGain
from ....twin.sensors.effects.mount_resonance import MountResonance
from ...record import Floats, Series
from .poles import Complexes, Poles

#: Modes that most of a force's impulse acts on have a phase that does not hang on its shape.
ENOUGH = 0.3


def levels(
    plate: ModalPlate,
    modes: NDArray[np.intp],
    points: Sequence[str],
    channels: Sequence[str],
    forces: Sequence[Series | None],
    at_s: Floats,
    effects: Sequence[Effect] = (),
) -> Floats:
    """Amplitudes (R, S, K) in m/s2 of K modes at the times `at_s` (R,), as sensors show them; NaN without a force."""
    poles = Poles.of(plate.frequency_hz[modes], plate.damping_ratio[modes])
    gain = np.abs(poles.root**2 / poles.omega * shown(poles.root, effects))
    at_sensors = np.abs(plate.shapes[[plate.sensor(name) for name in channels]][:, modes]) * gain  # (S, K)
    at_points = np.abs(plate.shape_impact[[plate.point(point) for point in points]][:, modes])
    return at_sensors * at_points[:, None] * np.abs(_transforms(forces, poles.root, at_s))[:, None]


def phases(
    frequency_hz: Floats,
    damping_ratio: Floats,
    forces: Sequence[Series | None],
    centre_s: Floats,
    effects: Sequence[Effect] = (),
) -> Floats:
    """(R, S, K), or (R, 1, K) where all sensors show the same: phases that K modes begin with at the times `centre_s`
    (R,), up to half turns; NaN without a force."""
    root = Poles.of(frequency_hz, damping_ratio).root
    return np.angle(_transforms(forces, root, centre_s)[:, None] * shown(root, effects))


def phases_at(phase: Floats, frequency: Floats, damping: Floats, since_s: Floats) -> Floats:
    """(R, S, K): phases read `since_s` (R,) after a time, turned back to it; logarithms (R, K) of the modes as read.

    Less the phase of -i lambda^2, which a mode has of itself.
    """
    poles = Poles.of(np.exp(frequency), np.exp(damping))
    mode_phase = np.angle(-1j * poles.root**2)
    return np.asarray(phase - (mode_phase + poles.omega * since_s[:, None])[:, None])


def shown(root: Complexes, effects: Sequence[Effect]) -> Complexes:
    """What sensors show of accelerations exp(root t), root (K,): gain, and transmissibility of the mounting. (S, K), or
    (1, K) where all sensors show the same."""
    factor = np.ones((1, len(root)), dtype=np.complex128)
    for effect in effects:
        if isinstance(effect, AccelerationGain):
            factor = factor * np.reshape(effect.gain, (-1, 1))
        elif isinstance(effect, MountResonance):
            # times the period's square: a mounting without a resonance follows the plate
            period = np.reshape(effect.period_s, (-1, 1)) / (2 * np.pi)
            follows = 2 * np.reshape(effect.damping_ratio, (-1, 1)) * period * root + 1
            factor = factor * follows / ((period * root) ** 2 + follows)
    return np.asarray(factor)


def excited(forces: Sequence[Series | None], frequency_hz: Floats) -> Floats:
    """(R, K): how much of each force's impulse acts on a mode at `frequency_hz` (R, K); 1 for a very short contact."""
    impulse = [np.nan if f is None else float(np.abs(f.values).sum() / f.sampling_rate_hz) for f in forces]
    transforms = _transforms(forces, 2j * np.pi * frequency_hz, np.zeros(len(forces)))
    return np.asarray(np.abs(transforms) / np.maximum(impulse, 1e-300)[:, None])


def _transforms(
    forces: Sequence[Series | None], root: NDArray[np.complexfloating[Any, Any]], at_s: Floats
) -> Complexes:
    """Z exp(lambda at) (R, K) for `root` lambda (K,) or (R, K), NaN without a force.

    By sums over samples: for a band-limited force they are the integral.
    """
    roots = np.broadcast_to(root, (len(forces), root.shape[-1]))
    transforms = np.full(roots.shape, np.nan, dtype=np.complex128)
    for run, force in enumerate(forces):
        if force is not None:
            acting = force.values != 0
            waves = np.exp(np.outer(roots[run], at_s[run] - force.time_s[acting]))
            transforms[run] = waves @ force.values[acting] / force.sampling_rate_hz
    return transforms


def delays_s(angle: Floats, omega: Floats, weight: Floats) -> Floats:
    """(R, S) from phases (R, S, K), circular frequencies (R, K) in rising order and weights (S, K), 0: not used.

    Modes may begin either way, so that a phase is known up to half turns: each mode takes the half turn that fits the
    delay of those below it. NaN without any weight.
    """
    total, used = np.zeros(angle.shape[:2]), np.zeros(angle.shape[:2])
    for k in range(angle.shape[2]):
        w = np.where(np.isfinite(angle[:, :, k]), weight[:, k] * omega[:, k, None] ** 2, 0.0)
        so_far = np.divide(total, used, out=np.zeros_like(total), where=used > 0)
        turn = np.where(w > 0, -angle[:, :, k], 0.0) - so_far * omega[:, k, None]
        delay = so_far + (turn - np.pi * np.round(turn / np.pi)) / omega[:, k, None]
        total, used = total + w * delay, used + w
    return np.divide(total, used, out=np.full_like(total, np.nan), where=used > 0)


def force_centre_s(force: Series | None) -> float:
    """Where half of the weight of a force is before and half after; NaN without a force."""
    return np.nan if force is None else float(force.time_s @ np.abs(force.values) / np.abs(force.values).sum())


def force_duration_s(force: Series | None) -> float:
    """How long a half sine of the same impulse and peak lasts; NaN without a force."""
    if force is None:
        return np.nan
    weight = np.abs(force.values)
    return float(0.5 * np.pi * weight.sum() / (weight.max() * force.sampling_rate_hz))
