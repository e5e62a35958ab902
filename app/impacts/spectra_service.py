"""`pyroshock.srs`: the shock response spectrum of arrays, Series and DataFrames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.errors import raises_library_errors

if TYPE_CHECKING:
    import pandas as pd

#: Steps of an index of time may differ by this share: files round their times.
_UNEVEN = 1e-3


@overload
def srs(
    acceleration: pd.DataFrame,
    rate: float | None = None,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
    frequencies: str | Sequence[float] | NDArray[np.float64] | None = None,
    resample: bool = True,
) -> pd.DataFrame: ...


@overload
def srs(
    acceleration: ArrayLike | pd.Series[Any],
    rate: float | None = None,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
    frequencies: str | Sequence[float] | NDArray[np.float64] | None = None,
    resample: bool = True,
) -> pd.Series[float]: ...


@raises_library_errors
def srs(
    acceleration: ArrayLike | pd.Series[Any] | pd.DataFrame,
    rate: float | None = None,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
    frequencies: str | Sequence[float] | NDArray[np.float64] | None = None,
    resample: bool = True,
) -> pd.Series[float] | pd.DataFrame:
    """The maximax absolute acceleration of oscillators (ISO 18431-4), in the unit of the acceleration.

    `acceleration` is an array (n,) with its `rate` in Hz, a Series, or a DataFrame with a column for each record (an
    array (n, k) is taken as one). Without `rate`, the index of a Series or DataFrame is the time in s. `frequencies`
    are in Hz: numbers, or "100:10000:6" for six lines an octave; by default six an octave over what the record's length
    and rate allow. Q is 10 unless `q` or `damping_ratio` says otherwise. A record whose content
    requires it is interpolated band-limited, so that the steps between its samples hide at most 1 % of a line;
    `resample=False` takes it as it is.

    Returns a Series over `frequency_hz`, or a DataFrame with a column for each record. Raises `InvalidValueError` for a
    record that is empty, constant or not finite, for a missing rate or uneven times, and for lines from half of the
    rate upwards.
    """
    import pandas as pd

    from ...signals.srs.spectrum import RESAMPLED_WITHIN, shock_response_spectrum
    from .spectra import parse_lines

    frame = acceleration if isinstance(acceleration, pd.DataFrame | pd.Series) else None
    values = np.asarray(acceleration, dtype=np.float64)
    if values.ndim not in (1, 2):
        raise ValueError(f"an acceleration has the shape {values.shape}; expected samples (n,), or records as columns")
    if rate is None:
        if frame is None:
            raise ValueError("rate is missing: give the sampling rate in Hz, or a Series whose index is the time in s")
        rate = _rate_of(frame.index)
    lines = parse_lines(frequencies, "frequencies") if isinstance(frequencies, str) else frequencies
    spectrum = shock_response_spectrum(
        values.T,
        float(rate),
        None if lines is None else np.asarray(lines, dtype=np.float64),
        q=q,
        damping_ratio=damping_ratio,
        resample_within=RESAMPLED_WITHIN if resample else None,
    )
    index = pd.Index(spectrum.frequency_hz, name="frequency_hz")
    attributes: dict[Any, Any] = {"q": 1 / (2 * spectrum.damping_ratio), "quantity": "maximax absolute acceleration"}
    unit = None if frame is None else frame.attrs.get("unit")
    attributes |= {"unit": unit} if unit else {}
    if values.ndim == 1:
        name = getattr(frame, "name", None) or "srs"
        series = pd.Series(spectrum.maximax, index=index, name=name)
        series.attrs = attributes
        return series
    columns = frame.columns if isinstance(frame, pd.DataFrame) else range(values.shape[1])
    spectra = pd.DataFrame(spectrum.maximax.T, index=index, columns=columns)
    spectra.attrs = attributes
    return spectra


def _rate_of(index: pd.Index[Any]) -> float:
    """The sampling rate of times in s. Raises `ValueError` where they are no rising, even times."""
    times = np.asarray(index)
    if times.dtype.kind not in "fiu" or len(times) < 2:
        raise ValueError("rate is missing, and the index is no time in s: give the sampling rate in Hz")
    if times.dtype.kind in "iu" and np.array_equal(times, np.arange(len(times))):
        raise ValueError("rate is missing, and the index only counts the samples: give the sampling rate in Hz")
    step = float(times[-1] - times[0]) / (len(times) - 1)
    uneven = np.max(np.abs(np.diff(times.astype(np.float64)) - step))
    if not step > 0 or uneven > _UNEVEN * step:
        raise ValueError(f"the times of the index are not even (steps differ by {uneven:.3g} s): give the rate in Hz")
    return 1.0 / step
