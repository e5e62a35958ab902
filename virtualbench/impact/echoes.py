"""What the edges of a plate send back to the point that was struck, while the impactor still
touches it.

The chain's plate is without edges: its surface moves with P / Z. A plate with edges has modes, and
its surface moves by their sum instead. The difference of both answers to an impulse is the echo,

    e(t) = sum of g W(omega) exp(-zeta omega t) (cos omega_d t - zeta omega / omega_d sin omega_d t)
           - 2 / (pi Z) integral of W(omega) cos(omega t),

with g the squared mass-normalised shape at the point: P / Z is the answer of modes that lie evenly
over all frequencies with 2 / (pi Z) for each unit (Cremer, Heckl and Petersson, Structure-Borne
Sound, 2005, ch. 5). Both end at the same frequency with the same raised cosine W, above which the
plate stays the one without edges. The echo velocity is the convolution of the plate's force with e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...array_types import Floats

#: Where the raised cosine begins, over its end at the highest mode.
_TAPER = 0.6


@dataclass(frozen=True)
class PlateEchoes:
    """Modes (m,) at the point that is struck, rigid ones at 0 Hz, and the impedance (N s/m) of the
    chain's plate.

    The modes are all of those up to `frequencies_hz[-1]`.
    """

    frequencies_hz: Floats
    damping: Floats
    shape_1_sqrt_kg: Floats
    plate_impedance_n_s_m: float

    def answer(self, time_s: Floats) -> Floats:
        """e (m/s for 1 N s) at times (n,) from 0 on."""
        omega = 2 * np.pi * self.frequencies_hz
        last = omega[-1]
        begin = _TAPER * last
        window = np.where(
            omega > begin, 0.5 * (1 + np.cos(np.pi * (omega - begin) / (last - begin))), 1.0
        )
        damped = omega * np.sqrt(1 - self.damping**2)
        decay = self.damping * omega
        turns = np.exp(np.outer(time_s, 1j * damped - decay))
        lag = np.divide(decay, damped, out=np.zeros_like(decay), where=damped > 0)
        modes = (turns.real - lag * turns.imag) @ (window * self.shape_1_sqrt_kg**2)
        return np.asarray(
            modes - 2 / (np.pi * self.plate_impedance_n_s_m) * _low_pass(time_s, begin, last)
        )


def _low_pass(time_s: Floats, begin: float, end: float) -> Floats:
    """Integral of the raised cosine from `begin` to `end` (rad/s) times cos(omega t), in closed
    form."""
    middle, half = (begin + end) / 2, (end - begin) / 2
    spread = 1 - (2 * half * time_s / np.pi) ** 2
    near = np.abs(spread) < 1e-6
    shape = np.where(near, np.pi / 4, np.cos(half * time_s) / np.where(near, 1.0, spread))
    return np.asarray(middle * np.sinc(middle * time_s / np.pi) * shape)
