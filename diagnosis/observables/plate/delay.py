"""By how much later than its force a plate rings: what tells a slow force channel from a mounting that resonates.

Under a force about the time c a mode begins with the phase of Z exp(lambda c), 0 or a half turn for a short and
even contact, whatever its frequency; a delay d turns it by omega d. An uneven and long contact has a phase of its own,
which is taken off: it would be taken for other half turns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...record import Floats, Series

#: Modes that most of a force's impulse acts on have a phase that does not hang on its shape.
ENOUGH = 0.3


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


def centres_s(forces: Sequence[Series | None]) -> Floats:
    """(R,): where half of the weight of each force is before and half after; NaN without a force."""
    return np.array([np.nan if force is None else _centre(force) for force in forces])


def durations_s(forces: Sequence[Series | None]) -> Floats:
    """(R,): how long a half sine of the same impulse and peak lasts; NaN without a force."""
    return np.array([np.nan if force is None else _duration(force) for force in forces])


def _centre(force: Series) -> float:
    weight = np.abs(force.values)
    return float(force.time_s @ weight / weight.sum())


def _duration(force: Series) -> float:
    weight = np.abs(force.values)
    return float(0.5 * np.pi * weight.sum() / (weight.max() * force.sampling_rate_hz))
