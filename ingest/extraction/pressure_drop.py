"""The drop of the tank's pressure in a gun's recording: the level before it, and the moment at
which it begins.

Both are fitted together. A mean over what lies before some sample is wrong where a valve opens
slowly, because the drop has begun long before it exceeds the noise; here the level holds what the
drop has taken by then.

The record is y = p0 - D f(t - t0) (1 + g(ln(t - t0))) + noise with f = (t - t0)^k, scaled to 1 at
the end of the fit: while a port opens, its area grows with a power of time (1 for a sharp edge, 3/2
for two circles, 2 for a cosine), and the gas that has left with one more. A gun keeps to no power:
gas fills the dead volume, and the projectile moves off. g is what the power leaves open, a Gaussian
process over the logarithm of time (Kennedy and O'Hagan 2001). p0 and D are integrated out in closed
form, t0 and k on a grid, so that the uncertainties hold the form of the law, too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats

#: Noise and drop are looked for in means over this time.
_BLOCK_S = 1e-3
_FEWEST_BLOCKS = 12
#: A shot falls by more than this many deviations of a block's noise.
_SEEN = 4.0
#: The fit ends where the pressure has fallen by so many deviations of a block's noise, or by the
#: first share of its fall where that is more, and by the second one at most.
_DEPTH, _LEAST_DEPTH, _MOST_DEPTH = 40.0, 0.01, 0.5
#: Means in the fit: within the drop, as close before it, and in the rest before that.
_IN_DROP, _BEFORE, _AT_REST = 16, 12, 8
#: Means within a drop are of 5 ms at most, unless there would be more of them than this: memory
#: goes with their square.
_MOST_IN_DROP = 100
_LONGEST_REST_S = 0.25
#: Powers of time, and the standard deviation of their prior about that of an area that grows
#: evenly.
_POWERS = np.array([0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5])
_POWER, _POWER_U = 2.0, 0.7
#: Of g: standard deviation, and length in nats of time. By virtual guns with five laws of the
#: valve.
_FORM, _FORM_NATS = 0.25, 0.8
#: The level may creep by this share of itself in a second (standard deviation), as a gas that was
#: filled in cools.
_CREEP_1_S = 0.02
#: A transducer and its filter delay the drop, by 0.4 ms with a corner at 1 kHz and by 1 ms at 400
#: Hz (fourth order); nobody states it.
_DELAY_U_S = 0.8e-3
_MOMENTS = 32
#: With more probability than this that the drop has begun before the record, there is no level to
#: be read.
_MOST_BEFORE_RECORD = 0.05
#: A drop that begins so many deviations from where those of other records begin is another one.
_FARTHEST = 2.0
#: Hum stands out of its neighbours in the spectrum by this factor of power, in this band.
_HUM_MARGIN, _HUM_HZ = 20.0, (40.0, 220.0)
#: Means over so many pieces of the rest show noise that is not white, where they scatter by this
#: factor of variance.
_PIECES, _PIECES_MARGIN = 8, 2.5


class NoDropError(ValueError):
    """The pressure record shows no shot; the message says what was seen."""


class ShortRestError(NoDropError):
    """The pressure falls from the record's beginning on, so that nobody can know from which
    level."""


@dataclass(frozen=True)
class PressureDrop:
    """Level before the drop and moment (s from the record's first sample) at which it begins, with
    their standard uncertainties: of noise, hum, creep and of the law of the drop, without the
    calibration.

    The drop exceeds the noise at `seen_s`; `power` of time is the mean one.
    """

    pressure_pa: float
    pressure_u_pa: float
    time_s: float
    time_u_s: float
    seen_s: float
    power: float


def pressure_drop(
    pressure_pa: NDArray[Any], sampling_rate_hz: float, opening: tuple[float, float] | None = None
) -> PressureDrop:
    """The drop in a record of tank pressure. Lone spikes are left out.

    Parameters:
        pressure_pa: The record (n,).
        sampling_rate_hz: Its sampling rate.
        opening: The moment (s from the first sample) at which the drop begins in other records of
            the same trigger, and its standard deviation, for a record whose noise leaves open
            whether it begins within the drop; by default (None) the record alone decides.

    Raises:
        NoDropError: Where the pressure does not fall by more than its noise.
        ShortRestError: Where it may have fallen before the record began.
        ValueError: For a sample that is not finite.
    """
    values = np.asarray(pressure_pa, dtype=np.float64)
    if not np.all(np.isfinite(values)):
        raise ValueError(f"pressure: sample {int(np.argmin(np.isfinite(values)))} is not finite")
    block = max(1, round(_BLOCK_S * sampling_rate_hz))
    if values.size < _FEWEST_BLOCKS * block:
        raise NoDropError(
            f"{values.size} samples of pressure: expected at least {_FEWEST_BLOCKS * block}"
        )
    values = _without_spikes(values)
    means = _block_means(values, block)
    noise = max(_noise(means), _resolution(values) / math.sqrt(block))
    level, begin, stop = _located(means, noise)
    hum = _hum_lines(means[stop:], block / sampling_rate_hz)
    edges = _edges(begin * block, stop * block, sampling_rate_hz)
    window = _window(values, edges, sampling_rate_hz, level, hum, begin * block / sampling_rate_hz)
    fit = _fitted(window, opening)
    rest_samples = 0 if opening else max(2 * int(edges[-1] - edges[-2]), 16)
    shortest = (edges[0] + rest_samples) / sampling_rate_hz
    early = float(fit.of_moment[fit.moment_s < shortest].sum())
    if opening is not None and abs(fit.time_s - opening[0]) > _FARTHEST * opening[1]:
        early = 1.0  # what follows is no drop that begins when those of the other records do
    if early > _MOST_BEFORE_RECORD:
        raise ShortRestError(
            "the pressure falls from the record's beginning on, or from within "
            f"{1e3 * shortest:.2g} ms of it, with a probability of {early:.2g}: the level before "
            "the shot is not in the record; begin it earlier (a longer pre-trigger)"
        )
    above = np.flatnonzero(means[:stop] >= level - _SEEN * noise)
    seen_s = (float(above[-1] + 1 if above.size else 0) + 0.5) * block / sampling_rate_hz
    return PressureDrop(
        fit.level, fit.level_u, fit.time_s, math.hypot(fit.time_u_s, _DELAY_U_S), seen_s, fit.power
    )


def _without_spikes(values: Floats) -> Floats:
    """A sample far from both of its neighbours is replaced by their middle one."""
    before, here, after = values[:-2], values[1:-1], values[2:]
    middle = np.maximum(np.minimum(before, here), np.minimum(np.maximum(before, here), after))
    noise = _noise(values)
    away = np.abs(here - middle) > 8 * noise
    if not noise or not away.any():
        return values
    cleaned = values.copy()
    cleaned[1:-1][away] = middle[away]
    return cleaned


def _block_means(values: Floats, block: int) -> Floats:
    count = values.size // block
    return np.asarray(values[: count * block].reshape(count, block).mean(axis=1), dtype=np.float64)


def _noise(values: Floats) -> float:
    """Robust deviation of white noise, of second differences, which the slope of the drop leaves
    alone."""
    return float(np.median(np.abs(np.diff(values, 2)))) * 1.4826 / math.sqrt(6)


def _resolution(values: Floats) -> float:
    """Deviation of a sample by its converter's step; far less than the fall, and never zero."""
    steps = np.diff(np.unique(values[:: max(1, values.size // 4000)]))
    least = 1e-9 * (1 + float(np.abs(values[0])))
    return max(
        least,
        min(float(steps.min()) if steps.size else 0.0, 1e-2 * float(np.ptp(values)))
        / math.sqrt(12),
    )


def _located(means: Floats, noise: float) -> tuple[float, int, int]:
    """The level before the drop, the block at which it is first seen, and the number of blocks up
    to the fit's end.

    The knee of the curve is where it lies highest above the chord from its beginning to half its
    fall: a level that leaks before the shot has the same knee, where a threshold would be crossed
    by the leak.
    """
    level = float(np.median(means[: max(3, means.size // 20)]))
    fall = level - float(means.min())
    half = int(np.argmax(means <= level - fall / 2))
    above = means[: half + 1] - np.linspace(means[0], means[half], half + 1)
    knee = int(np.argmax(above))
    if not min(fall, 2 * float(above[knee])) > 2 * _SEEN * noise:
        raise NoDropError(
            f"no drop: pressure falls by {fall:.3g} Pa, by {float(above[knee]):.3g} Pa at once, "
            f"with noise of {noise:.3g} Pa in {_BLOCK_S * 1e3:g} ms; a shot is expected to exceed "
            f"{2 * _SEEN:g} times the noise"
        )
    early = max(0, knee - (half - knee) // 4)
    near = means[max(0, early - 50) : early + 1]
    level = float(np.median(near)) if near.size >= 3 else float(means[:3].mean())
    depth = min(max(_DEPTH * noise, _LEAST_DEPTH * fall), _MOST_DEPTH * fall)
    stop = int(np.argmax((means <= level - depth) & (np.arange(means.size) >= knee))) + 1
    begin = stop - 1
    while begin > 0 and means[begin] < level - 2 * noise:
        begin -= 1
    return level, begin, stop


def _hum_lines(means: Floats, period_s: float) -> list[tuple[float, float, float]]:
    """Frequency (Hz), amplitude (Pa) and uncertainty of the frequency of up to three lines in what
    follows the drop."""
    if means.size < 64:
        return []
    differences = np.diff(means, 2)  # the blow-down leaks less into the lines
    taper = np.hanning(differences.size)
    frequency = np.fft.rfftfreq(differences.size, period_s)
    gain = np.maximum(np.abs(2 * np.sin(np.pi * frequency * period_s)) ** 2, 1e-9)
    power = np.abs(np.fft.rfft(differences * taper) / gain) ** 2
    low = int(np.searchsorted(frequency, max(_HUM_HZ[0], 6 * frequency[1])))
    high = int(np.searchsorted(frequency, min(_HUM_HZ[1], 0.4 / period_s)))
    lines: list[tuple[float, float, float]] = []
    while len(lines) < 3 and high - low > 10:
        at = low + int(np.argmax(power[low:high]))
        around = np.concatenate(
            [power[max(low, at - 25) : max(low, at - 3)], power[at + 4 : min(high, at + 26)]]
        )
        if at in (low, high - 1) or not power[at] > _HUM_MARGIN * np.median(around):
            break
        before, top, after = np.log(power[at - 1 : at + 2] + 1e-300)
        bend = before - 2 * top + after
        shift = 0.5 * (before - after) / bend if bend < 0 else 0.0
        centre, bin_hz = float(frequency[at] + shift * frequency[1]), float(frequency[1])
        lines.append((centre, 2 * math.sqrt(power[at]) / float(taper.sum()), 0.15 * bin_hz))
        power[max(0, at - 3) : at + 4] = 0.0
    return lines


def _edges(begin: int, stop: int, rate_hz: float) -> NDArray[np.intp]:
    """First samples of the means that are fitted, and the end of the last: short ones in the drop
    and before it."""
    longest = max(1.0, 5e-3 * rate_hz, (stop - begin) / _MOST_IN_DROP)
    length = int(min(max((stop - begin) / _IN_DROP, 1e-4 * rate_hz, 1.0), longest))
    nearest = max(0, min(begin - _BEFORE * length, 2 * begin - stop))
    edges = list(range(stop, nearest - 1, -length))
    first = max(0, edges[-1] - max(int(_LONGEST_REST_S * rate_hz), 10 * (stop - begin)))
    pieces = min(_AT_REST, (edges[-1] - first) // length)
    if pieces:
        edges += np.linspace(edges[-1], first, pieces + 1).astype(int)[1:].tolist()
    return np.array(edges[::-1], dtype=np.intp)


@dataclass(frozen=True)
class _Window:
    """Means (m,) of the pressure above `level`, their middle times, and the covariance (m, m) of
    all but the drop, which is seen first at `begin_s`."""

    begin_s: float
    time_s: Floats
    above_pa: Floats
    covariance: Floats
    level: float


def _window(
    values: Floats,
    edges: NDArray[np.intp],
    rate_hz: float,
    level: float,
    hum: list[tuple[float, float, float]],
    begin_s: float,
) -> _Window:
    samples = np.diff(edges)
    sums = np.concatenate([[0.0], np.cumsum(values - level)])
    above = np.diff(sums[edges]) / samples
    time = (edges[1:] + edges[:-1]) / 2 / rate_hz
    lag_s = time[:, None] - time
    # Noise behind a filter is alike in neighbouring samples: longer means tell it from white noise.
    lengths = {max(1, samples[-1] * factor) for factor in (1, 4)}
    lengths = {
        length
        for length in lengths
        if length <= max(samples[-1], 2e-3 * rate_hz) and values.size // length > 23
    }
    white = max(
        _noise(_block_means(values, int(length))) ** 2 * length
        for length in lengths or {samples[-1]}
    )
    step = _resolution(values) ** 2
    white = max(white, step)
    # Less noise than a converter's step: the samples of a mean are rounded alike.
    covariance = np.diag(white / samples + (step if white < 4 * step else 0.0))
    for frequency, amplitude, frequency_u in hum:
        averaged = np.sinc(frequency * samples / rate_hz)
        coherence = np.exp(-0.5 * (2 * math.pi * frequency_u * lag_s) ** 2)
        covariance += (
            amplitude**2
            / 2
            * np.cos(2 * math.pi * frequency * lag_s)
            * coherence
            * np.outer(averaged, averaged)
        )
    covariance *= _excess(values[edges[0] : edges[-1 - _IN_DROP]], white, hum)
    covariance += np.outer(time - begin_s, time - begin_s) * (_CREEP_1_S * level) ** 2
    return _Window(begin_s, time, np.asarray(above), covariance, level)


def _excess(rest: Floats, white: float, hum: list[tuple[float, float, float]]) -> float:
    """By how much more the means of pieces of the rest vary than white noise (of this variance) and
    hum let them."""
    length = rest.size // _PIECES
    if length < 16:
        return 1.0
    pieces = _block_means(rest, length)
    pieces = pieces - np.polyval(
        np.polyfit(np.arange(pieces.size), pieces, 1), np.arange(pieces.size)
    )
    expected = white / length + sum(amplitude**2 / 2 for _, amplitude, _ in hum)
    factor = float(pieces @ pieces) / (_PIECES - 2) / expected
    return factor if factor > _PIECES_MARGIN else 1.0


@dataclass(frozen=True)
class _DropFit:
    level: float
    level_u: float
    time_s: float
    time_u_s: float
    power: float
    moment_s: Floats
    of_moment: Floats  # probability of each moment


def _fitted(window: _Window, opening: tuple[float, float] | None) -> _DropFit:
    """By two grids of moments: one that is the finer the closer it is to what is seen of the drop,
    and one between the moments that the first one leaves possible."""
    moments = _around(window)
    likelihood, _, _ = _posterior(window, moments, opening)
    possible = np.flatnonzero(likelihood.max(axis=1) > likelihood.max() - 12.0)
    low, high = moments[max(possible[0] - 1, 0)], moments[min(possible[-1] + 1, moments.size - 1)]
    moments = np.linspace(low, high, _MOMENTS)
    likelihood, level, level_var = _posterior(window, moments, opening)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    of_moment = weight.sum(axis=1)
    moment = float(of_moment @ moments)
    moment_var = float(of_moment @ (moments - moment) ** 2) + (moments[1] - moments[0]) ** 2 / 12
    mean = float((weight * level).sum())
    spread = float((weight * (level_var + (level - mean) ** 2)).sum())
    power = float(weight.sum(axis=0) @ _POWERS)
    return _DropFit(
        window.level + mean,
        math.sqrt(spread),
        moment,
        math.sqrt(moment_var),
        power,
        moments,
        of_moment,
    )


def _around(window: _Window) -> Floats:
    """Moments (k,), rising, from as long before the window as it is long to the last but one of its
    means."""
    time = window.time_s
    earliest, latest = 2 * float(time[0]) - float(time[-1]), float(time[-2])
    middle = min(max(window.begin_s, float(time[0])), latest)
    shortest = float(time[-1] - time[-2]) / 4
    count = _MOMENTS * 3 // 4
    before = middle - np.geomspace(shortest, max(middle - earliest, 2 * shortest), count)
    return np.concatenate([before[::-1], np.linspace(middle, latest, _MOMENTS - count)])


def _posterior(
    window: _Window, moments: Floats, opening: tuple[float, float] | None
) -> tuple[Floats, Floats, Floats]:
    """Logarithm of the probability of each moment and power (g, k), up to a constant; level above
    the window's and its variance for each."""
    from scipy.special import log_ndtr

    time, above = window.time_s, window.above_pa
    since = np.maximum(time - moments[:, None], 0.0) / (time[-1] - moments)[:, None]
    nats = np.log(np.maximum(since, 1e-9))
    alike = np.exp(-0.5 * ((nats[:, :, None] - nats[:, None, :]) / _FORM_NATS) ** 2)
    law = since[:, None, :] ** _POWERS[:, None]
    form = (_FORM * above[-1]) ** 2
    covariance = window.covariance + form * (law[..., :, None] * law[..., None, :]) * alike[:, None]
    root = np.linalg.cholesky(covariance)
    columns = np.stack([np.ones_like(law), -law, np.broadcast_to(above, law.shape)], axis=-1)
    whitened = np.linalg.solve(root, columns)
    products = np.swapaxes(whitened, -1, -2) @ whitened
    normal, right = products[..., :2, :2], products[..., :2, 2]
    determinant = np.maximum(normal[..., 0, 0] * normal[..., 1, 1] - normal[..., 0, 1] ** 2, 1e-300)
    level = (normal[..., 1, 1] * right[..., 0] - normal[..., 0, 1] * right[..., 1]) / determinant
    depth = (normal[..., 0, 0] * right[..., 1] - normal[..., 0, 1] * right[..., 0]) / determinant
    misfit = products[..., 2, 2] - level * right[..., 0] - depth * right[..., 1]
    # Residuals beyond the noise widen everything.
    scale = max(1.0, float(misfit.min()) / max(time.size - 4, 1))
    size = 2 * np.log(np.diagonal(root, axis1=-2, axis2=-1)).sum(axis=-1)
    falls = log_ndtr(depth * np.sqrt(determinant / normal[..., 0, 0]))
    prior = -0.5 * ((_POWERS - _POWER) / _POWER_U) ** 2
    likelihood = prior + falls - 0.5 * (size + np.log(determinant) + misfit / scale)
    if opening is not None:
        likelihood = likelihood - 0.5 * (((moments - opening[0]) / opening[1]) ** 2)[:, None]
    return likelihood, level, scale * normal[..., 1, 1] / determinant
