"""What modes a plate rings with after a contact, in closed form, and how a mounted sensor shows them.

q'' of mode m is Im(lambda^2 / omega_d Z exp(lambda t)) with Z the integral of F exp(-lambda t): recursion.py.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import Effect
from ....twin.plate.modal import ModalPlate
from ....twin.sensors.effects.acceleration_gain import AccelerationGain
from ....twin.sensors.effects.mount_resonance import MountResonance
from ...record import Floats, Series
from .poles import Poles

Complexes = NDArray[np.complex128]


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
    root = -poles.decay + 1j * poles.omega
    gain = np.abs(root**2 / poles.omega * shown(root, effects))
    at_sensors = np.abs(plate.shapes[[plate.sensor(name) for name in channels]][:, modes]) * gain
    out = np.full((len(forces), len(channels), modes.size), np.nan)
    for run, (force, point, at) in enumerate(zip(forces, points, at_s, strict=True)):
        if force is not None:
            shape = np.abs(plate.shape_impact[plate.point(point)][modes])
            out[run] = at_sensors * shape * np.abs(_given(force, root, at))
    return out


def phases(
    frequency_hz: Floats,
    damping_ratio: Floats,
    forces: Sequence[Series | None],
    centre_s: Floats,
    effects: Sequence[Effect] = (),
) -> Floats:
    """(R, K): phases that K modes begin with at the times `centre_s` (R,), up to half turns; NaN without a force."""
    poles = Poles.of(frequency_hz, damping_ratio)
    root = -poles.decay + 1j * poles.omega
    out = np.full((len(forces), root.size), np.nan)
    for run, (force, centre) in enumerate(zip(forces, centre_s, strict=True)):
        if force is not None:
            out[run] = np.angle(_given(force, root, centre) * shown(root, effects))
    return out


def phases_at(phase: Floats, frequency: Floats, damping: Floats, since_s: Floats) -> Floats:
    """(R, S, K): phases read `since_s` (R,) after a time, turned back to it; logarithms (R, K) of the modes as read.

    Less the phase of -i lambda^2, which a mode has of itself.
    """
    poles = Poles.of(np.exp(frequency), np.exp(damping))
    own = np.angle(-1j * (-poles.decay + 1j * poles.omega) ** 2)
    return np.asarray(phase - (own + poles.omega * since_s[:, None])[:, None])


def shown(root: Complexes, effects: Sequence[Effect]) -> Complexes:
    """What a sensor shows of accelerations exp(root t): gain, and transmissibility of its mounting."""
    factor = np.ones_like(root)
    for each in effects:
        if isinstance(each, AccelerationGain):
            factor = factor * float(each.gain)
        elif isinstance(each, MountResonance) and float(each.period_s) > 0:
            omega = 2 * np.pi / float(each.period_s)
            follows = 2 * float(each.damping_ratio) * omega * root + omega**2
            factor = factor * follows / (root**2 + follows)
    return np.asarray(factor)


def _given(force: Series, root: Complexes, at_s: float) -> Complexes:
    """Z exp(lambda at) (K,), by sums over samples: for a band-limited force they are the integral."""
    acting = force.values != 0
    time = force.time_s[acting]
    return np.asarray(np.exp(np.outer(root, at_s - time)) @ force.values[acting] / force.sampling_rate_hz)


def excited(forces: Sequence[Series | None], frequency_hz: Floats) -> Floats:
    """(R, K): how much of each force's impulse acts on a mode at `frequency_hz` (R, K); 1 for a very short contact."""
    out = np.full((len(forces), frequency_hz.shape[-1]), np.nan)
    for run, force in enumerate(forces):
        if force is not None:
            acting = force.values != 0
            waves = np.exp(-2j * np.pi * np.outer(frequency_hz[run], force.time_s[acting]))
            out[run] = np.abs(waves @ force.values[acting]) / max(np.abs(force.values).sum(), 1e-300)
    return out
