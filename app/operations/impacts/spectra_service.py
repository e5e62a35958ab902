"""`pyroshock.srs`: the shock response spectrum of arrays, Series and DataFrames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...common.errors import raises_library_errors

if TYPE_CHECKING:
    import pandas as pd

#: Steps of an index of time may differ by this share: files round their times.
_UNEVEN = 1e-3


@overload
def srs(
    acceleration: pd.DataFrame,
    rate: float | str | None = None,
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
    rate: float | str | None = None,
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
    rate: float | str | None = None,
    *,
    q: float | None = None,
    damping_ratio: float | None = None,
    frequencies: str | Sequence[float] | NDArray[np.float64] | None = None,
    resample: bool = True,
    rest: str | None = None,
    hit: int | str | None = None,
) -> pd.Series[float] | pd.DataFrame:
    """The shock response spectrum: the maximax absolute acceleration of oscillators with one degree
    of freedom.

    A record whose content requires it is interpolated band-limited first, so that the steps between
    its samples hide at most 1 % of a line.

    Parameters:
        acceleration: An array (n,), a Series, or a DataFrame with a column for each record; an
            array (n, k) is taken as one. In any unit.
        rate: Sampling rate in Hz, or as text with its unit ("20 kHz"). By default it follows from
            the index of the Series or DataFrame: the time in s, or in the unit that its name
            carries (`time_ms`).
        q: Q of the oscillators; by default 10.
        damping_ratio: Their damping ratio, in the place of `q`: 1/(2 Q).
        frequencies: The lines in Hz, or "100:10000:6" for six lines an octave; by default six an
            octave over what the record's length and rate allow.
        resample: Whether the record is interpolated; False takes it as it is.
        rest: The zero of each record: "none" for zero as recorded, or "0ms:5ms" for the mean
            between two times; by default the rest before the shock, where there is one.
        hit: Of a record with several hits the number from 1, or "whole".

    Returns:
        A Series over `frequency_hz`, or a DataFrame with a column for each record, in the unit of
        the acceleration. In `attrs`, `rest` is what was subtracted, and `sampling_error` the share
        of each line that sampling may have changed at most.

    Raises:
        InvalidValueError: For a record that is empty, constant, not finite or masked in part; for
            records that lie as rows, samples that are no readings (-9999), a missing rate, uneven
            times, and lines from half of the rate upwards.

    Source:
        ISO 18431-4, by the ramp-invariant rule of Smallwood (Shock and Vibration Bulletin 51,
        1981).
    """
    import pandas as pd

    from ....signals.record_rest import without_rest
    from ....signals.srs.spectrum import RESAMPLED_WITHIN, shock_response_spectrum
    from .record_choice import chosen_part, parse_rest
    from .spectra import parse_lines

    frame = acceleration if isinstance(acceleration, pd.DataFrame | pd.Series) else None
    _refuse_masked(acceleration)
    values = np.asarray(acceleration, dtype=np.float64)
    if values.ndim not in (1, 2):
        raise ValueError(
            f"an acceleration has the shape {values.shape}; expected samples "
            f"(n,), or records as columns"
        )
    if frame is None and values.ndim == 2 and values.shape[0] < values.shape[1]:
        raise ValueError(
            f"an acceleration has the shape {values.shape}, more records than samples; expected "
            "records as columns: give its transpose, acceleration.T"
        )
    if rate is None:
        if frame is None:
            raise ValueError(
                "rate is missing: give the sampling rate in Hz, or a Series "
                "whose index is the time in s"
            )
        rate = _rate_of(frame.index)
    rate_hz = _rate_hz(rate)
    _refuse_placeholders(values, frame)
    lines = parse_lines(frequencies, "frequencies") if isinstance(frequencies, str) else frequencies
    records = values.T if values.ndim == 2 else values[np.newaxis]
    start_s = 0.0 if frame is None else _start_of(frame.index)
    choice = parse_rest(rest, "rest")
    parts = [record[chosen_part(record, rate_hz, start_s, hit, "hit")[0]] for record in records]
    if len({part.size for part in parts}) > 1:
        raise ValueError(
            "the records hold their hits at other times; compute the spectrum of each alone"
        )
    removed = [without_rest(part, rate_hz, start_s, choice) for part in parts]
    shocks = np.stack([shock for shock, _ in removed])
    spectrum = shock_response_spectrum(
        shocks if values.ndim == 2 else shocks[0],
        rate_hz,
        None if lines is None else np.asarray(lines, dtype=np.float64),
        q=q,
        damping_ratio=damping_ratio,
        resample_within=RESAMPLED_WITHIN if resample else None,
    )
    index = pd.Index(spectrum.frequency_hz, name="frequency_hz")
    attributes: dict[Any, Any] = {
        "q": 1 / (2 * spectrum.damping_ratio),
        "quantity": "maximax absolute acceleration",
    }
    unit = None if frame is None else frame.attrs.get("unit")
    attributes |= {"unit": unit} if unit else {}
    attributes["rest"] = (
        tuple(rest.level_m_s2 for _, rest in removed)
        if values.ndim == 2
        else removed[0][1].level_m_s2
    )
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


def _refuse_placeholders(
    values: NDArray[np.float64], frame: pd.DataFrame | pd.Series[Any] | None
) -> None:
    """Raise `ValueError` for a sample that is no reading: it would be the whole spectrum."""
    from ....signals.placeholders import without_placeholders

    columns = list(getattr(frame, "columns", ())) or None
    for number, record in enumerate(values.reshape(values.shape[0], -1).T):
        placeholders, usable = without_placeholders(record, record)
        at = np.union1d(placeholders.lone, placeholders.beyond_range)
        if at.size:
            column = "" if columns is None else f" of column {columns[number]!r}"
            samples = "sample" if at.size == 1 else "samples"
            raise ValueError(
                f"{at.size} {samples}{column}, the first number {at[0]} = {record[at[0]]:.7g}, far "
                f"outside of the neighbours ({usable[at[0]]:.4g}): a placeholder is no reading; "
                "replace it, for example by the mean of its neighbours, or leave the record out"
            )


def _refuse_masked(acceleration: Any) -> None:
    """Raise `ValueError` for an array whose mask leaves samples out: numpy would hand on what lies
    below."""
    masked = (
        int(np.ma.getmaskarray(acceleration).sum())
        if isinstance(acceleration, np.ma.MaskedArray)
        else 0
    )
    if masked:
        raise ValueError(
            f"{masked} samples are masked, and a spectrum needs all of them; "
            f"fill them (acceleration.filled(...), or "
            "by interpolation), or give the part of the record that has none"
        )


def _rate_hz(rate: float | str) -> float:
    """A rate in Hz, or as a text with its unit. Raises `ValueError` for what is no rate above
    zero."""
    from ...common.frames import parse_quantity

    if isinstance(rate, str):
        try:
            rate = float(rate)
        except ValueError:
            rate = parse_quantity(str(rate), "Hz", "rate")
    if not 0.0 < float(rate) < float("inf"):
        raise ValueError(f"rate is {rate!r}; expected a number above zero, in Hz")
    return float(rate)


def _start_of(index: pd.Index[Any]) -> float:
    """The first time of an index in s; 0 for one that holds no times."""
    try:
        scale = _index_unit_s(index)
    except ValueError:
        return 0.0
    return float(index[0]) * scale if len(index) and index.dtype.kind == "f" else 0.0


def _rate_of(index: pd.Index[Any]) -> float:
    """The sampling rate of times in s, or in the unit of the index's name. Raises `ValueError`
    where they are no rising, even times, and for a name that is no time."""
    times = np.asarray(index)
    if times.dtype.kind not in "fiu" or len(times) < 2:
        raise ValueError(
            "rate is missing, and the index is no time in s: give the sampling rate in Hz"
        )
    scale = _index_unit_s(index)
    if times.dtype.kind in "iu" and np.array_equal(times, np.arange(len(times))):
        raise ValueError(
            "rate is missing, and the index only counts the samples: give the sampling rate in Hz"
        )
    step = float(times[-1] - times[0]) / (len(times) - 1)
    uneven = np.max(np.abs(np.diff(times.astype(np.float64)) - step))
    if not step > 0 or uneven > _UNEVEN * step:
        raise ValueError(
            f"the times of the index are not even (steps differ by "
            f"{uneven:.3g} s): give the rate in Hz"
        )
    return 1.0 / (step * scale)


def _index_unit_s(index: pd.Index[Any]) -> float:
    """Seconds per unit of an index of time: what its name carries (`time_ms`, `t [us]`, `Zeit
    (ms)`), else 1."""
    from ....ingest.readers.contents import is_time_name, name_and_unit, time_scale

    if index.name is None:
        return 1.0
    name, unit = name_and_unit(str(index.name))
    scale = time_scale(name, unit) if is_time_name(name) or unit is not None else None
    if scale is None:
        raise ValueError(
            f"the index is called {index.name!r}, which is no time in s, ms or us: call it time_s "
            "or time_ms, or give the rate in Hz"
        )
    return scale
