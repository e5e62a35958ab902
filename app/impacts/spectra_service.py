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
    rest: str | None = None,
    hit: int | str | None = None,
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
    rest: str | None = None,
    hit: int | str | None = None,
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
    rest: str | None = None,
    hit: int | str | None = None,
) -> pd.Series[float] | pd.DataFrame:
    """The maximax absolute acceleration of oscillators (ISO 18431-4), in the unit of the acceleration.

    `acceleration` is an array (n,) with its `rate` in Hz, a Series, or a DataFrame with a column for each record (an
    array (n, k) is taken as one). Without `rate`, the index of a Series or DataFrame is the time in s. `frequencies`
    are in Hz: numbers, or "100:10000:6" for six lines an octave; by default six an octave over what the record's length
    and rate allow. Q is 10 unless `q` or `damping_ratio` says otherwise. A record whose content
    requires it is interpolated band-limited, so that the steps between its samples hide at most 1 % of a line;
    `resample=False` takes it as it is. `rest` chooses the zero of each record: by default the rest before the shock,
    where there is one, "none" for zero as recorded, "0ms:5ms" for the mean between two times. A record that holds
    several hits needs `hit`: a number from 1, or "whole". The result's `attrs` say what was done: `rest` holds what was
    subtracted, `sampling_error` what sampling may have changed of each line at most, as a share.

    Returns a Series over `frequency_hz`, or a DataFrame with a column for each record. Raises `InvalidValueError` for a
    record that is empty, constant or not finite, for a missing rate or uneven times, and for lines from half of the
    rate upwards.
    """
    import pandas as pd

    from ...signals.record_rest import without_rest
    from ...signals.srs.spectrum import RESAMPLED_WITHIN, shock_response_spectrum
    from .record_choice import chosen_part, parse_rest
    from .spectra import parse_lines

    frame = acceleration if isinstance(acceleration, pd.DataFrame | pd.Series) else None
    values = np.asarray(acceleration, dtype=np.float64)
    if values.ndim not in (1, 2):
        raise ValueError(f"an acceleration has the shape {values.shape}; expected samples (n,), or records as columns")
    if rate is None:
        if frame is None:
            raise ValueError("rate is missing: give the sampling rate in Hz, or a Series whose index is the time in s")
        rate = _rate_of(frame.index)
    _refuse_placeholders(values, frame)
    lines = parse_lines(frequencies, "frequencies") if isinstance(frequencies, str) else frequencies
    records = values.T if values.ndim == 2 else values[np.newaxis]
    start_s = 0.0 if frame is None else _start_of(frame.index)
    choice = parse_rest(rest, "rest")
    parts = [record[chosen_part(record, float(rate), start_s, hit, "hit")[0]] for record in records]
    if len({part.size for part in parts}) > 1:
        raise ValueError("the records hold their hits at other times; compute the spectrum of each alone")
    removed = [without_rest(part, float(rate), start_s, choice) for part in parts]
    shocks = np.stack([shock for shock, _ in removed])
    spectrum = shock_response_spectrum(
        shocks if values.ndim == 2 else shocks[0],
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
    attributes["rest"] = tuple(rest.level_m_s2 for _, rest in removed) if values.ndim == 2 else removed[0][1].level_m_s2
    attributes["sampling_error"] = spectrum.sampling_error.tolist()
    if values.ndim == 1:
        name = getattr(frame, "name", None) or "srs"
        series = pd.Series(spectrum.maximax, index=index, name=name)
        series.attrs = attributes
        return series
    columns = frame.columns if isinstance(frame, pd.DataFrame) else range(values.shape[1])
    spectra = pd.DataFrame(spectrum.maximax.T, index=index, columns=columns)
    spectra.attrs = attributes
    return spectra


def _start_of(index: pd.Index[Any]) -> float:
    """The first time of an index in s; 0 for one that holds no times."""
    return float(index[0]) if len(index) and index.dtype.kind == "f" else 0.0


def _refuse_placeholders(values: NDArray[np.float64], frame: pd.DataFrame | pd.Series[Any] | None) -> None:
    """Raise `ValueError` for a sample that is no reading: it would be the whole spectrum."""
    from ...signals.placeholders import without_placeholders

    for number, record in enumerate(values.reshape(values.shape[0], -1).T):
        placeholders, usable = without_placeholders(record, record)
        at = np.union1d(placeholders.lone, placeholders.beyond_range)
        if at.size:
            which = f" of column {frame.columns[number]!r}" if values.ndim == 2 and hasattr(frame, "columns") else ""
            raise ValueError(
                f"{at.size} sample{'s' if at.size > 1 else ''}{which}, the first number {at[0]} = {record[at[0]]:.7g}, "
                f"far outside of the neighbours ({usable[at[0]]:.4g}): a placeholder is no reading; replace it, for "
                "example by the mean of its neighbours, or leave the record out"
            )


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
