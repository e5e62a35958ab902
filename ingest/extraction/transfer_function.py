"""Transfer function between two channels, by H1 (thesis, eq. 2.7 and 4.2; MATLAB's
`tfestimate`)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats

#: Bins below this coherence (or NaN, without excitation) say nothing about the size of the
#: response.
MEANINGFUL_COHERENCE = 0.5
ACCELERATION_OVER_FORCE = "(m/s2)/N"


class TransferFunctionError(ValueError):
    """A transfer function cannot be estimated or applied; the message says what was found and
    expected."""


@dataclass(frozen=True)
class TransferFunction:
    """Response on the bins of a real FFT of `segment` samples: all arrays (segment // 2 + 1,),
    segment even.

    `unit` is output unit over input unit, "1" once normalised. `decay_1_s` is the rate of the
    exponential window under which the response was seen: it is then that of a system with that much
    more damping, and whatever uses it weights its signals alike.
    """

    frequency_hz: Floats
    response: NDArray[np.complex128]
    coherence: Floats
    unit: str
    decay_1_s: float = 0.0

    @property
    def segment(self) -> int:
        return 2 * (self.frequency_hz.size - 1)

    @property
    def sampling_rate_hz(self) -> float:
        return 2 * float(self.frequency_hz[-1])

    @property
    def largest_gain(self) -> float:
        """Largest `|response|` over the bins with coherence; `TransferFunctionError` when there is
        none."""
        meaningful = self.coherence >= MEANINGFUL_COHERENCE
        if not meaningful.any():
            raise TransferFunctionError(f"no bin has a coherence of {MEANINGFUL_COHERENCE} or more")
        return float(np.abs(self.response[meaningful]).max())


def estimate_transfer_function(
    output: Floats,
    input_: Floats,
    sampling_rate_hz: float,
    *,
    starts: NDArray[np.int64] | None = None,
    segment: int | None = None,
    end_weight: float = 1.0,
    unit: str = ACCELERATION_OVER_FORCE,
) -> TransferFunction:
    """H1, cross spectrum over input spectrum: noise of the output averages out, noise of the input
    biases it low.

    For a record of hits give `starts`: each segment then holds one whole hit, and is not tapered,
    since a taper would weigh the hit by where it lies. Without `starts`: Welch with Hann windows
    that overlap by half, as `tfestimate` cuts a record. Right for steady excitation; on hits most
    windows hold silence, or part of a hit. The coherence of a single segment is 1 by construction.

    Parameters:
        output: The record (n,) of the response, such as an acceleration in m/s2.
        input_: The record (n,) of the excitation, such as a force in N, on the same clock.
        sampling_rate_hz: The sampling rate of both.
        starts: The samples (hits,) at which the segments begin, each some samples before its
            contact; by default (None) the record is cut evenly.
        segment: The number of samples of a segment. It is by default the least distance between
            starts, or without `starts` such that there are eight segments.
        end_weight: The weight at the end of a segment, in (0, 1], of an exponential that both
            channels are weighted by. By default 1, no weight; less, 0.01 say, where the response
            outlasts the segment. Without `starts` it has no effect.
        unit: The unit of the output over that of the input; by default that of an acceleration over
            a force.

    Raises:
        TransferFunctionError: For records of different lengths, for segments that do not fit into
            the record, for an `end_weight` out of its bounds, and where nothing was excited.
    """
    if output.ndim != 1 or output.shape != input_.shape:
        raise TransferFunctionError(
            f"output {output.shape}, input {input_.shape}: expected two records of one length"
        )
    if starts is None:
        return _welch(output, input_, sampling_rate_hz, segment, unit)
    starts = np.sort(np.asarray(starts, dtype=np.int64))
    if segment is None:
        segment = int(np.diff(starts, append=output.size).min()) // 2 * 2 if starts.size else 0
    x, y, decay = _hit_spectra(output, input_, sampling_rate_hz, starts, segment, end_weight)
    return _h1(x, y, sampling_rate_hz, unit, decay)


def transfer_functions_of_the_others(
    output: Floats,
    input_: Floats,
    sampling_rate_hz: float,
    starts: NDArray[np.int64],
    *,
    segment: int,
) -> Iterator[TransferFunction]:
    """For each hit in turn `estimate_transfer_function` over all hits but this one, each
    transformed only once.

    Parameters:
        output: The record (n,) of the acceleration in m/s2.
        input_: The record (n,) of the force in N, on the same clock.
        sampling_rate_hz: The sampling rate of both.
        starts: The samples (hits,) at which the segments begin.
        segment: The number of samples of a segment, even.

    Raises:
        TransferFunctionError: As `estimate_transfer_function`.
    """
    x, y, decay = _hit_spectra(output, input_, sampling_rate_hz, starts, segment, 1.0)
    for hit in range(len(starts)):
        yield _h1(
            np.delete(x, hit, axis=0),
            np.delete(y, hit, axis=0),
            sampling_rate_hz,
            ACCELERATION_OVER_FORCE,
            decay,
        )


def hit_windows(signal: Floats, starts: NDArray[np.int64], segment: int) -> Floats:
    """Windows (hits, segment) of a record.

    Parameters:
        signal: The record (n,).
        starts: The samples (hits,) at which the windows begin.
        segment: The number of samples of a window, even, 4 or more.

    Raises:
        TransferFunctionError: When there is no hit, or a window does not fit.
    """
    starts = np.asarray(starts, dtype=np.int64)
    if starts.size == 0 or segment < 4 or segment % 2:
        raise TransferFunctionError(
            f"{starts.size} hits, segments of {segment}: expected a hit, and an even 4 or more"
        )
    if starts.min() < 0 or starts.max() + segment > signal.size:
        raise TransferFunctionError(
            f"segments of {segment} from {starts.min()} to {starts.max()} "
            f"leave the record of {signal.size} samples"
        )
    return np.asarray(signal[starts[:, None] + np.arange(segment)], dtype=np.float64)


def rigid_body_normalised(tf: TransferFunction, band_hz: tuple[float, float]) -> TransferFunction:
    """A transfer function over its mean real part below the first resonance: 1 where the structure
    moves as one body.

    Deviation from eq. 4.2, which divides by acceleration over force and so returns a force: divided
    by this, a cleaned acceleration stays an acceleration, with the sensor's own sign.

    Parameters:
        tf: The transfer function, acceleration over force.
        band_hz: The lower and the upper end of the band in which the structure moves as one body.

    Raises:
        TransferFunctionError: Where the band has no coherent bin, or the response in it is not in
            phase with the force.
    """
    inside = (tf.frequency_hz >= band_hz[0]) & (tf.frequency_hz <= band_hz[1])
    inside &= tf.coherence >= MEANINGFUL_COHERENCE
    if not inside.any():
        raise TransferFunctionError(
            f"no coherent bin between {band_hz[0]:g} and {band_hz[1]:g} Hz to normalise by"
        )
    rigid = float(tf.response[inside].real.mean())
    if not abs(rigid) > 0.1 * float(np.abs(tf.response[inside]).mean()):
        raise TransferFunctionError(
            f"between {band_hz[0]:g} and {band_hz[1]:g} Hz the response is "
            f"not in phase with the force: no rigid body"
        )
    return replace(tf, response=tf.response / rigid, unit="1")


def _hit_spectra(
    output: Floats,
    input_: Floats,
    sampling_rate_hz: float,
    starts: NDArray[np.int64],
    segment: int,
    end_weight: float,
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], float]:
    """Spectra (hits, bins) of input and output under the exponential window, and its rate."""
    x, y = hit_windows(input_, starts, segment), hit_windows(output, starts, segment)
    if not 0 < end_weight <= 1:
        raise TransferFunctionError(f"end_weight = {end_weight!r}: expected in (0, 1]")
    decay = -np.log(end_weight) * sampling_rate_hz / segment
    weight = np.exp(-decay / sampling_rate_hz * np.arange(segment))
    return np.fft.rfft(x * weight), np.fft.rfft(y * weight), float(decay)


def _h1(
    x: NDArray[np.complex128],
    y: NDArray[np.complex128],
    sampling_rate_hz: float,
    unit: str,
    decay: float,
) -> TransferFunction:
    """From the spectra (hits, bins) of input and output."""
    xx, yy = _power(x), _power(y)
    xy = (np.conj(x) * y).sum(axis=0)
    frequency = np.linspace(0.0, sampling_rate_hz / 2, xx.size)
    return _from_spectra(frequency, xx, yy, xy, unit, decay)


def _welch(
    output: Floats, input_: Floats, sampling_rate_hz: float, segment: int | None, unit: str
) -> TransferFunction:
    from scipy.signal import csd, welch

    segment = (int(output.size / 4.5) if segment is None else segment) // 2 * 2
    if not 4 <= segment <= output.size:
        raise TransferFunctionError(
            f"segments of {segment} in a record of {output.size}: expected 4 to its length"
        )
    # A pulse has a mean: the detrending that scipy does by default would take it out.
    frequency, xy = csd(input_, output, fs=sampling_rate_hz, nperseg=segment, detrend=False)
    _, xx = welch(input_, fs=sampling_rate_hz, nperseg=segment, detrend=False)
    _, yy = welch(output, fs=sampling_rate_hz, nperseg=segment, detrend=False)
    return _from_spectra(frequency, xx, yy, xy, unit, 0.0)


def _power(spectra: NDArray[np.complex128]) -> Floats:
    return np.asarray((spectra.real**2 + spectra.imag**2).sum(axis=0), dtype=np.float64)


def _from_spectra(
    frequency: Floats, xx: Floats, yy: Floats, xy: NDArray[np.complex128], unit: str, decay: float
) -> TransferFunction:
    if not np.any(xx > 0):
        raise TransferFunctionError("the input is zero in every segment: nothing was excited")
    # A bin without input has no response that anyone saw: zero, with zero coherence.
    response = np.divide(xy, xx, out=np.zeros_like(xy), where=xx > 0)
    power = xx * yy
    coherence = np.divide(np.abs(xy) ** 2, power, out=np.zeros_like(power), where=power > 0)
    return TransferFunction(frequency, response, np.minimum(coherence, 1.0), unit, decay)
