"""A structure's own dynamics taken out of what a sensor on it saw (thesis, eq. 2.8, 2.9 and
4.2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from ...array_types import Floats
from .transfer_function import (
    TransferFunction,
    TransferFunctionError,
    hit_windows,
    rigid_body_normalised,
    transfer_functions_of_the_others,
)

#: On a resonance of 2 % damping a half-sine comes back to 1 % of its peak, and to 3 % under noise
#: of 0.1 %.
DEFAULT_REGULARISATION = 1e-7

#: Segments in one block of a long record, without its margins: beyond, a transform leaves the
#: processor's cache.
_BLOCK_SEGMENTS = 6


def deconvolve(
    output: Floats,
    tf: TransferFunction,
    sampling_rate_hz: float,
    regularisation: float = DEFAULT_REGULARISATION,
) -> Floats:
    """What drove a response through a transfer function, regularised after Tikhonov.

    `conj(H) / (|H|^2 + regularisation * max |H|^2)` replaces 1 / H, which would amplify noise
    without bound where the structure does not respond; noise grows by `1 / (2 sqrt(regularisation)
    max |H|)` at most. Zeros on either side keep the end of a record from wrapping around to its
    beginning. A long one is cut into blocks that overlap by two segments, half the time of one long
    transform.

    Parameters:
        output: The response (..., n). A record of hits is better given as windows (hits, n), one
            for each hit: cheaper, and silence adds only noise.
        tf: The transfer function.
        sampling_rate_hz: The sampling rate of the response, which is that of the transfer function.
        regularisation: The share of the largest `|H|^2` that is added to it everywhere, 0 or more;
            by default 1e-7.

    Returns:
        The drive (..., n) in the unit of the response over that of the transfer function.

    Raises:
        TransferFunctionError: When the rates differ, or `output` outlasts an exponentially weighted
            `tf`.

    Source:
        Thesis, eq. 4.2.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    _check(output, tf, sampling_rate_hz, regularisation)
    samples = output.shape[-1]
    weight = np.exp(-tf.decay_1_s / sampling_rate_hz * np.arange(samples)) if tf.decay_1_s else 1.0
    margin = tf.segment
    length = int(next_fast_len(min(samples, _BLOCK_SEGMENTS * margin) + 2 * margin, real=True))
    step = length - 2 * margin
    padded = np.zeros((*output.shape[:-1], -(-samples // step) * step + 2 * margin))
    np.multiply(output, weight, out=padded[..., margin : margin + samples])
    spectrum = rfft(sliding_window_view(padded, length, axis=-1)[..., ::step, :])
    spectrum *= _regularised_inverse(tf, length, regularisation)
    blocks = irfft(spectrum, length, overwrite_x=True)[..., margin:-margin]
    driven: Floats = blocks.reshape(*output.shape[:-1], -1)[..., :samples]
    return driven / weight


def deconvolve_together(
    outputs: Floats,
    functions: Sequence[TransferFunction],
    sampling_rate_hz: float,
    to_hz: float,
    regularisation: float = DEFAULT_REGULARISATION,
) -> Floats:
    """What drove several responses through as many transfer functions at once: the least squares of
    all.

    As `deconvolve`, for one window.

    Parameters:
        outputs: The responses (k, n), no longer than the functions' segment.
        functions: The k transfer functions, of one segment and one exponential weight.
        sampling_rate_hz: The sampling rate of the responses, which is that of the functions.
        to_hz: The frequency up to which the functions are known. From 0.8 of it on the result fades
            to zero.
        regularisation: As of `deconvolve`, of the summed `|H|^2`; by default 1e-7.

    Returns:
        The drive (n,) in the unit of the responses over that of the functions.

    Raises:
        TransferFunctionError: As `deconvolve`.
    """
    from scipy.fft import irfft, next_fast_len, rfft

    for output, tf in zip(outputs, functions, strict=True):
        _check(output, tf, sampling_rate_hz, regularisation)
    samples, segment, decay = outputs.shape[-1], functions[0].segment, functions[0].decay_1_s
    weight = np.exp(-decay / sampling_rate_hz * np.arange(samples))
    length = int(next_fast_len(3 * segment, real=True))
    padded = np.zeros((len(outputs), length))
    padded[:, segment : segment + samples] = outputs * weight
    responses = np.stack([_padded_response(tf, length) for tf in functions])
    power = (np.abs(responses) ** 2).sum(axis=0)
    spectrum = (np.conj(responses) * rfft(padded)).sum(axis=0) / (
        power + regularisation * float(power.max())
    )
    frequency = np.linspace(0.0, sampling_rate_hz / 2, spectrum.size)
    fade = np.clip((frequency - 0.8 * to_hz) / (0.2 * to_hz), 0.0, 1.0)
    driven: Floats = irfft(spectrum * np.cos(np.pi / 2 * fade) ** 2, length)[
        segment : segment + samples
    ]
    return np.asarray(driven / weight, dtype=np.float64)


def clean_acceleration(
    acceleration: Floats,
    force: Floats,
    sampling_rate_hz: float,
    starts: NDArray[np.int64],
    *,
    segment: int,
    band_hz: tuple[float, float],
) -> Floats:
    """The acceleration at the impact plane, hit by hit.

    Each hit is cleaned by the transfer function of the others: by its own, a / (a / F) returns the
    measured force whatever the acceleration was.

    Parameters:
        acceleration: The record (n,) of the impactor's acceleration in m/s2.
        force: The record (n,) of the contact force in N, on the same clock.
        sampling_rate_hz: The sampling rate of both.
        starts: The samples (hits,) at which the windows begin, some before each contact.
        segment: The number of samples of a window, even.
        band_hz: The lower and the upper end of the band in which the impactor moves as one body.

    Returns:
        The cleaned windows (hits, segment) in m/s2.

    Raises:
        TransferFunctionError: For fewer than two hits, and as `hit_windows`,
            `rigid_body_normalised` and `deconvolve`.

    Source:
        Thesis, eq. 4.2.
    """
    if len(starts) < 2:
        raise TransferFunctionError(
            f"{len(starts)} hit: expected at least two, each cleaned by the others"
        )
    windows = hit_windows(acceleration, starts, segment)
    of_others = transfer_functions_of_the_others(
        acceleration, force, sampling_rate_hz, starts, segment=segment
    )
    for window, tf in zip(windows, of_others, strict=True):
        window[:] = deconvolve(window, rigid_body_normalised(tf, band_hz), sampling_rate_hz)
    return windows


def force_from_acceleration(
    acceleration_m_s2: Floats, tf: TransferFunction, plate_mass_kg: float, sampling_rate_hz: float
) -> Floats:
    """Contact force (..., n): minus plate mass times corrected acceleration.

    The minus makes the force of a blow positive for a sensor whose axis points against it.

    Parameters:
        acceleration_m_s2: The acceleration (..., n) of the plate.
        tf: A transfer function of `rigid_body_normalised`: by eq. 2.7 as printed, eq. 2.8 already
            is a force.
        plate_mass_kg: The mass of the plate.
        sampling_rate_hz: The sampling rate of the acceleration.

    Raises:
        TransferFunctionError: For any other `tf`, and as `deconvolve`.

    Source:
        Thesis, eq. 2.9.
    """
    if tf.unit != "1":
        raise TransferFunctionError(
            f"transfer function in {tf.unit}: expected a normalised one, in 1"
        )
    return -plate_mass_kg * deconvolve(acceleration_m_s2, tf, sampling_rate_hz)


def _check(
    output: Floats, tf: TransferFunction, sampling_rate_hz: float, regularisation: float
) -> None:
    if not np.isclose(tf.sampling_rate_hz, sampling_rate_hz, rtol=1e-6):
        raise TransferFunctionError(
            f"transfer function at {tf.sampling_rate_hz:g} Hz, signal at {sampling_rate_hz:g}"
        )
    if tf.decay_1_s and output.shape[-1] > tf.segment:
        raise TransferFunctionError(
            f"{output.shape[-1]} samples under an exponential window of "
            f"{tf.segment}: give one window per hit"
        )
    if not regularisation >= 0:
        raise TransferFunctionError(f"regularisation = {regularisation!r}: expected not negative")


def _regularised_inverse(
    tf: TransferFunction, length: int, regularisation: float
) -> NDArray[np.complex128]:
    """On the bins of a longer FFT, by the impulse response: interpolating the response itself would
    smear its phase."""
    response = _padded_response(tf, length)
    floor = regularisation * tf.largest_gain**2
    return np.asarray(
        np.conj(response) / (response.real**2 + response.imag**2 + floor), dtype=np.complex128
    )


def _padded_response(tf: TransferFunction, length: int) -> NDArray[np.complex128]:
    from scipy.fft import irfft, rfft

    impulse = irfft(tf.response, tf.segment)
    early = (
        tf.segment // 4
    )  # an inverted delay, or leakage, lies before time zero: at the end of the segment
    padded = np.zeros(length)
    padded[: tf.segment - early] = impulse[: tf.segment - early]
    padded[length - early :] = impulse[tf.segment - early :]
    return np.asarray(rfft(padded), dtype=np.complex128)
