"""What modes a plate rings with after a contact, in closed form, and how a mounted sensor shows them.

q'' of mode m is Im(lambda^2 / omega_d Z exp(lambda t)) with Z the integral of F exp(-lambda t): recursion.py.

By how much later than its force a plate rings tells a slow force channel from a mounting that resonates. Under a force
about the time c a mode begins with the phase of Z exp(lambda c), 0 or a half turn for a short and even contact,
whatever its frequency; a delay d turns it by omega d. An uneven and long contact has a phase of its own, which is taken
off: it would be taken for other half turns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ....array_types import Complexes, Floats, Rows
from ....twin.plate.modal import ModalPlate
from ....twin.plate.poles import poles_of
from ....twin.sensors.chain import SensorChain
from ...record import Series
from .signals import PlateSignals

Forces = Sequence[Series | None]
_NO_EFFECTS = SensorChain()


def levels(
    plate: ModalPlate,
    modes: Rows,
    signals: PlateSignals,
    runs: Rows,
    forces: Forces,
    begin_s: float,
    chain: SensorChain = _NO_EFFECTS,
) -> Floats:
    """Amplitudes (k, S, K) in m/s2 of K modes as sensors show them; NaN without a force.

    Of the `runs` (k,) of the record under other `forces` (k,), `begin_s` after the first sample.
    """
    poles = poles_of(plate.frequency_hz[modes], plate.damping_ratio[modes])
    gain = np.abs(poles**2 / poles.imag * chain.transmissibility(poles))
    at_sensors = np.abs(plate.shapes[[plate.sensor(name) for name in signals.channels]][:, modes]) * gain
    at_points = np.abs(plate.shape_impact[[plate.point(signals.points[run]) for run in runs]][:, modes])
    transforms = np.abs(_transforms(forces, poles, signals.first_s[runs] + begin_s))
    return at_sensors * at_points[:, None] * transforms[:, None]


def phases(poles: Complexes, forces: Forces, centre_s: Floats, chain: SensorChain = _NO_EFFECTS) -> Floats:
    """(R, S, K), or (R, 1, K) where all sensors show the same: phases that K modes begin with at the times `centre_s`
    (R,), up to half turns; NaN without a force."""
    return np.angle(_transforms(forces, poles, centre_s)[:, None] * chain.transmissibility(poles))


def excited(forces: Forces, frequency_hz: Floats) -> Floats:
    """(R, K): how much of each force's impulse acts on a mode at `frequency_hz` (R, K); 1 for a very short contact."""
    impulse = [np.nan if f is None else float(np.abs(f.values).sum() / f.sampling_rate_hz) for f in forces]
    transforms = _transforms(forces, np.asarray(2j * np.pi * frequency_hz), np.zeros(len(forces)))
    return np.asarray(np.abs(transforms) / np.maximum(impulse, 1e-300)[:, None])


def _transforms(forces: Forces, poles: Complexes, at_s: Floats) -> Complexes:
    """Z exp(lambda at) (R, K) for `poles` lambda (K,) or (R, K), NaN without a force.

    By sums over samples: for a band-limited force they are the integral.
    """
    rows = np.broadcast_to(poles, (len(forces), poles.shape[-1]))
    transforms = np.full(rows.shape, np.nan, dtype=np.complex128)
    for run, force in enumerate(forces):
        if force is not None:
            acting = force.values != 0
            waves = np.exp(np.outer(rows[run], at_s[run] - force.time_s[acting]))
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
