"""What the modes that a plate does not list leave out."""

from __future__ import annotations

import numpy as np

from .modal import Floats, ModalPlate

_PADDING = 4


def beyond_modes(plate: ModalPlate, force_n: Floats, step_s: float) -> Floats:
    """Which share of a force's power of ringing lies above the highest mode, (k,) for forces (k, n), 0 to 1.

    A mode at f rings with an acceleration that goes with f |F(f)|; the share is that of the integral of its square.
    What is above the highest mode is missing in the answer.
    """
    force = np.atleast_2d(np.asarray(force_n, dtype=np.float64))
    length = _PADDING * force.shape[1]
    frequency = np.fft.rfftfreq(length, step_s)
    power = (frequency * np.abs(np.fft.rfft(force, length, axis=1))) ** 2
    total = power.sum(axis=1)
    above = power[:, frequency > plate.frequency_hz.max(initial=0.0)].sum(axis=1)
    return np.asarray(above / np.where(total > 0, total, 1.0))
