"""How accelerations are read, measured or simulated: the ringing, spectrum lines and what a channel
rests at.

What modes a plate rings with after a contact, in closed form, and how a mounted sensor shows them.

q'' of mode m is Im(lambda^2 / omega_d Z exp(lambda t)) with Z the integral of F exp(-lambda t).

By how much later than its force a plate rings tells a slow force channel from a mounting that
resonates. Under a force about the time c a mode begins with the phase of Z exp(lambda c), 0 or a
half turn for a short and even contact, whatever its frequency; a delay d turns it by omega d. An
uneven and long contact has a phase of its own, which is taken off: it would be taken for other half
turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from ....array_types import Complexes, Floats, Rows
from ....signals.srs.spectrum import shock_response_spectrum
from ....twin.plate.modal import ModalPlate
from ....twin.plate.poles import poles_of
from ....twin.sensors.chain import SensorChain
from ...record import Series
from .signals import PlateSignals

Q, PER_OCTAVE = 10.0, 3
#: Lines reach from below the lowest mode to below the highest: beyond, modes that are not listed
#: would tell.
_BELOW, _ABOVE = 0.7, 0.75
#: Lines are below this share of the sampling rate, and have so many cycles in a record.
_RATE, _CYCLES = 0.1, 3.0
#: Periods of the lowest mode that a window needs to see the level under the ringing; shares of the
#: ringing it spans.
_PERIODS = 5.0
_HALVES, _WHOLE = ((0.0, 0.5), (0.5, 1.0)), ((0.0, 1.0),)
#: Samples to a cycle of the highest mode that are kept at least; attenuation of what is beyond, dB.
_PER_CYCLE, _ATTENUATION = 4.0, 70.0
#: From here on, over the highest mode, nothing is left.
_STEEP = 1.2


@dataclass(frozen=True, eq=False)
class RingingWindow:
    """The part of a record in which a plate rings freely, at no higher rate than the modes that are
    looked for need.

    The samples `kept` of records that `taps` have filtered; none for None. They begin `start_s`
    after the first.
    """

    kept: slice
    step_s: float
    start_s: float
    taps: Floats | None = None

    @classmethod
    def of(cls, ringing: int, samples: int, rate_hz: float, highest_hz: float) -> RingingWindow:
        """For records of so many samples that ring freely from sample `ringing` on."""
        from scipy.signal import firwin, kaiser_beta, kaiserord

        factor = int(rate_hz / (_PER_CYCLE * highest_hz))
        if factor < 2:
            return cls(slice(ringing, samples, 1), 1 / rate_hz, ringing / rate_hz)
        stop = min(rate_hz / factor - highest_hz, _STEEP * highest_hz)
        count = kaiserord(_ATTENUATION, 2 * (stop - highest_hz) / rate_hz)[0] | 1
        middle = 0.5 * (stop + highest_hz)
        taps = firwin(count, middle, window=("kaiser", kaiser_beta(_ATTENUATION)), fs=rate_hz)
        first, last = ringing + count // 2, samples - count // 2
        return cls(slice(first, last, factor), factor / rate_hz, first / rate_hz, np.asarray(taps))

    @property
    def samples(self) -> int:
        return len(range(self.kept.start, self.kept.stop, self.kept.step))

    def cut(self, acceleration: Floats) -> Floats:
        """(..., samples) of (..., n). The filter is even: it delays nothing, and leaves modes below
        as they are."""
        from scipy.signal import fftconvolve

        if self.taps is not None:
            taps = self.taps.reshape((1,) * (acceleration.ndim - 1) + (-1,))
            acceleration = np.asarray(fftconvolve(acceleration, taps, mode="same", axes=-1))
        return acceleration[..., self.kept]


@dataclass(frozen=True, eq=False)
class Spectra:
    """How accelerations (..., n) are read: at `lines_hz` (f,), and in `windows`, in samples, for
    the level at rest."""

    lines_hz: Floats
    rate_hz: float
    windows: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, plate: ModalPlate, signals: PlateSignals) -> Spectra:
        samples, ringing, rate_hz = signals.samples, signals.ringing, signals.rate_hz
        modes = plate.frequency_hz[plate.frequency_hz > 0]
        low = max(_BELOW * float(modes.min()), _CYCLES * rate_hz / samples)
        high = min(_ABOVE * float(modes.max()), _RATE * rate_hz)
        count = int(PER_OCTAVE * np.log2(high / low)) + 1 if low < high else 0
        periods = (samples - ringing) / rate_hz * float(modes.min())
        parts = _HALVES if periods >= 2 * _PERIODS else _WHOLE if periods >= _PERIODS else ()
        ends = [[ringing + round(share * (samples - ringing)) for share in part] for part in parts]
        return cls(
            low * 2 ** (np.arange(count) / PER_OCTAVE),
            rate_hz,
            tuple((begin, end) for begin, end in ends),
        )

    def levels_db(self, acceleration: Floats) -> Floats:
        """(..., f): maximax in dB over 1 m/s2, NaN for records that are not numbers or silent."""
        flat = acceleration.reshape(-1, acceleration.shape[-1])
        levels = np.full((len(flat), self.lines_hz.size), np.nan)
        good = np.isfinite(flat).all(axis=1) & (np.ptp(flat, axis=1) > 0)
        if good.any() and self.lines_hz.size:
            # Records are compared with simulated ones of the same rate and length, in which
            # sampling hides the same.
            spectrum = shock_response_spectrum(
                flat[good], self.rate_hz, self.lines_hz, q=Q, resample_within=None, threads=1
            )
            levels[good] = 20 * np.log10(spectrum.maximax)
        return levels.reshape(*acceleration.shape[:-1], -1)

    def rests(self, acceleration: Floats) -> Floats:
        """(..., windows): the level under the ringing over the largest acceleration.

        Blackman's window lets modes of five periods in it through by less than 1e-4.
        """
        size = np.abs(acceleration).max(axis=-1)
        rests = np.zeros((*acceleration.shape[:-1], len(self.windows)))
        for i, (begin, end) in enumerate(self.windows):
            rests[..., i] = (
                acceleration[..., begin:end]
                @ _mean_weights(end - begin)
                / np.where(size > 0, size, np.nan)
            )
        return rests


@cache
def _mean_weights(samples: int) -> Floats:
    weights = np.blackman(samples)
    return np.asarray(weights / weights.sum())


Forces = Sequence[Series | None]
_NO_EFFECTS = SensorChain()


def levels(
    plate: ModalPlate,
    modes: Rows,
    signals: PlateSignals,
    runs: Rows,
    transforms: Complexes,
    chain: SensorChain = _NO_EFFECTS,
) -> Floats:
    """Amplitudes (k, S, K) in m/s2 of K modes as sensors show them; NaN without a force.

    Of the `runs` (k,) of the record, at the time about which forces on them have the `transforms`
    (k, K).
    """
    poles = poles_of(plate.frequency_hz[modes], plate.damping_ratio[modes])
    gain = np.abs(poles**2 / poles.imag * chain.transmissibility(poles))
    at_sensors = (
        np.abs(plate.shapes[[plate.sensor(name) for name in signals.channels]][:, modes]) * gain
    )
    at_points = np.abs(
        plate.shape_impact[[plate.point(signals.points[run]) for run in runs]][:, modes]
    )
    return np.asarray(at_sensors * at_points[:, None] * np.abs(transforms)[:, None])


def excited(forces: Forces, frequency_hz: Floats) -> Floats:
    """(R, K): how much of each force's impulse acts on a mode at `frequency_hz` (R, K); 1 for a
    very short contact."""
    impulse = [
        np.nan if f is None else float(np.abs(f.values).sum() / f.sampling_rate_hz) for f in forces
    ]
    transforms = force_transforms(
        forces, np.asarray(2j * np.pi * frequency_hz), np.zeros(len(forces))
    )
    return np.asarray(np.abs(transforms) / np.maximum(impulse, 1e-300)[:, None])


def force_transforms(forces: Forces, poles: Complexes, at_s: Floats) -> Complexes:
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
    """(R, S) from phases (R, S, K), circular frequencies (R, K) in rising order and weights (S, K),
    0: not used.

    Modes may begin either way, so that a phase is known up to half turns: each mode takes the half
    turn that fits the delay of those below it. NaN without any weight.
    """
    total, used = np.zeros(angle.shape[:2]), np.zeros(angle.shape[:2])
    for k in range(angle.shape[2]):
        w = np.where(np.isfinite(angle[:, :, k]), weight[:, k] * omega[:, k, None] ** 2, 0.0)
        so_far = np.divide(total, used, out=np.zeros_like(total), where=used > 0)
        turn = np.where(w > 0, -angle[:, :, k], 0.0) - so_far * omega[:, k, None]
        delay = so_far + (turn - np.pi * np.round(turn / np.pi)) / omega[:, k, None]
        total, used = total + w * delay, used + w
    return np.divide(total, used, out=np.full_like(total, np.nan), where=used > 0)
