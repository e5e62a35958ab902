"""What sampling hides of a shock response spectrum, as a bound from the content of the record.

The oscillators follow straight lines between the samples, and their peaks are read at samples.
Three errors follow:

- Straight lines pass (sin x / x)^2 of content at f, x = pi f / fs, and add its images about every
  multiple of fs.
- A peak lies at most half a sample beside a sample. There the response has fallen by at most |x''|
  / (8 fs^2); x'' is bounded by the oscillator's equation, x'' = omega^2 (a - x) + 2 zeta omega (a'
  - x'), and by the content.
- Content above half the sampling rate was folded into the record. The record cannot tell how much
  that was. The bound assumes that the content goes on from the level that it has close to half the
  sampling rate, and falls by 6 dB an octave at least, as that of a jump does. An anti-alias filter,
  or a shock recorded fast enough, does that.

The first two shrink when the record is resampled, the third does not.

A sum over frequency of amplitude times gain bounds any response, and is reached where the parts are
in phase, as those of a short burst are. Of parts of random phase it is many times too large: there
the largest of the content of each half octave times the largest gain in it is the smaller bound,
with a reserve for what the gain does within the half octave.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .resampling import extended

#: Bands of the content: so many to an octave, down to half the sampling rate over 2^octaves; all
#: below is one band, whose content straight lines reproduce to 1e-5.
_PER_OCTAVE, _OCTAVES = 24, 9
#: The level at half the sampling rate is looked for in these shares of the band below it. The
#: spectrum of a pulse of four samples or more has gaps like those of |sin|: at such a gap the
#: largest amplitude in a share w is at least sin(2 pi w) of the next summit, which the level is
#: divided by.
_LEVEL_SHARES = (1 / 128, 1 / 64, 1 / 32, 1 / 16, 1 / 8)
#: Content is followed up to so many times half the sampling rate, in so many bands to each.
_FOLDED_UP_TO, _FOLDED_BANDS = 4, 32
#: Bands of half an octave whose largest value over time is known, from half the sampling rate
#: downwards. The integral of the magnitude of a resonator's response to an impulse is 4 / pi of its
#: largest gain.
_HALF_OCTAVES, _GAIN_RESERVE = 8, 4 / math.pi
#: Above half the sampling rate no course over time is known: a filtered record may have this much
#: more of a crest factor than its high differences.
_CREST_RESERVE = 1.3
#: Differences of this order are of what lies close to half the sampling rate: an octave below they
#: have 1/16 of it, two octaves below 1/2200. Noise passes six of its standard deviations once in
#: some 10^9 samples.
_HIGH_DIFFERENCE, _STEADY_CREST = 8, 6.0
#: Images about multiples of the sampling rate; the next ones hold less than a hundredth of these.
_IMAGES = (1, -1, 2, -2)
#: The record between its samples may pass the largest of them by so much (five samples a cycle or
#: more).
_BETWEEN_SAMPLES = 1.1


@dataclass(frozen=True, eq=False)
class SamplingBound:
    """Shares of the maximax spectrum, (..., f), infinite where they reach the spectrum itself.

    `total` bounds all that sampling may have changed, `hidden` is what straight lines and peaks
    between samples add to it, `unseen` what content above half the sampling rate adds. `high_share`
    (...): the largest of what lies close to half the sampling rate over the record's largest, 0
    where it lasts as long as the record, as noise does.
    """

    total: Floats
    hidden: Floats
    unseen: Floats
    high_share: Floats


@dataclass(frozen=True, eq=False)
class RecordContent:
    """Amplitudes of records (k, n) over frequency: sums in bands (k, b), `upper_hz` (b,) the upper
    ends of those.

    `half_octave` (b,) is the number of the half octave that each lies in, and `peaks` (k, h) the
    largest of each of those over time, NaN until `find_peaks` was asked for it. `spectrum` (k,
    bins) is of the `extended` records.
    """

    sampling_rate_hz: float
    records: Floats
    spectrum: NDArray[np.complex128]
    samples: int
    upper_hz: Floats
    amplitudes: Floats
    half_octave: NDArray[np.intp]
    spans: tuple[slice, ...]
    peaks: Floats
    largest_m_s2: Floats

    @classmethod
    def of(cls, records: Floats, sampling_rate_hz: float) -> RecordContent:
        from scipy.fft import rfft

        whole = extended(records)
        samples = whole.shape[-1]
        spectrum = rfft(whole)
        amplitude = _amplitude(spectrum, samples)
        upper_hz = (
            sampling_rate_hz / 2 * 2.0 ** (np.arange(-_PER_OCTAVE * _OCTAVES, 1) / _PER_OCTAVE)
        )
        edges = upper_hz * (1 + 1e-12) * samples / sampling_rate_hz
        stops = np.searchsorted(np.arange(amplitude.shape[-1]), edges, side="right")
        starts = np.concatenate(([0], stops[:-1]))
        filled = stops > starts
        down = np.arange(upper_hz.size)[::-1] // (_PER_OCTAVE // 2)
        half_octave = np.minimum(down, _HALF_OCTAVES)
        peaks = np.full((len(records), _HALF_OCTAVES + 1), np.nan)
        peaks[:, _HALF_OCTAVES] = np.inf
        return cls(
            sampling_rate_hz,
            records,
            spectrum,
            samples,
            upper_hz[filled],
            np.add.reduceat(amplitude, starts[filled], axis=-1),
            half_octave[filled],
            tuple(
                slice(starts[half_octave == band][0], stops[half_octave == band][-1])
                for band in range(_HALF_OCTAVES)
            ),
            peaks,
            np.maximum(records.max(axis=-1), -records.min(axis=-1)),
        )

    def take(self, rows: np.ndarray[tuple[int], np.dtype[np.intp]]) -> RecordContent:
        """The content of some of the records."""
        if rows.size == len(self.records):
            return self
        names = ("records", "spectrum", "amplitudes", "peaks", "largest_m_s2")
        return replace(self, **{name: getattr(self, name)[rows] for name in names})

    def find_peaks(self, rows: NDArray[np.intp]) -> None:
        """Puts the `peaks` of records `rows` that are not known."""
        from scipy.fft import irfft

        rows = rows[np.isnan(self.peaks[rows, 0])]
        if rows.size:
            part = np.zeros((rows.size, self.spectrum.shape[-1]), dtype=np.complex128)
            for band, inside in enumerate(self.spans):
                part[:, inside] = self.spectrum[rows, inside]
                series = irfft(part, self.samples)
                self.peaks[rows, band] = np.maximum(series.max(axis=-1), -series.min(axis=-1))
                part[:, inside] = 0

    def fine(
        self, lines_hz: Floats, zeta: float, factor: int, maximax: Floats, limit: Floats
    ) -> NDArray[np.bool_]:
        """Records (k,) of which `hidden` is at most `limit` (k, f), m/s2, at each line of their
        spectra `maximax`."""
        weights = self._weights(lines_hz, zeta, factor)
        fine = np.all(self._hidden(weights, lines_hz, zeta, factor, maximax) <= limit, axis=-1)
        if not fine.all():
            # Sums in phase are too large, and the peaks over time cost several transforms.
            self.find_peaks(np.flatnonzero(~fine))
            fine = np.all(self._hidden(weights, lines_hz, zeta, factor, maximax) <= limit, axis=-1)
        return np.asarray(fine)

    def hidden(self, lines_hz: Floats, zeta: float, factor: int, maximax: Floats) -> Floats:
        """What straight lines and peaks between samples may hide (k, f), m/s2, of records resampled
        by `factor`."""
        self.find_peaks(np.arange(len(self.peaks)))
        return self._hidden(self._weights(lines_hz, zeta, factor), lines_hz, zeta, factor, maximax)

    def _weights(self, lines_hz: Floats, zeta: float, factor: int) -> tuple[Floats, Floats]:
        """What straight lines lose of content (f, b), and peaks between samples."""
        rate = self.sampling_rate_hz * factor
        turn = np.pi * self.upper_hz / rate
        gain = _largest_gain(
            np.concatenate(([0.0], self.upper_hz[:-1])), self.upper_hz, lines_hz, zeta
        )
        straight = gain * (1 - np.sinc(turn / np.pi) ** 2)
        for image in _IMAGES:
            image_hz = np.abs(self.upper_hz + image * rate)
            straight += np.sinc(image_hz / rate) ** 2 * _gain(image_hz, lines_hz, zeta)
        return straight, gain * np.minimum(turn**2 / 2, 2.0)

    def _hidden(
        self,
        weights: tuple[Floats, Floats],
        lines_hz: Floats,
        zeta: float,
        factor: int,
        maximax: Floats,
    ) -> Floats:
        straight, beside = (self._sum(weight) for weight in weights)
        omega = 2 * np.pi * lines_hz
        slope = self._sum(2 * np.pi * self.upper_hz[None, :])
        largest = _BETWEEN_SAMPLES * self.largest_m_s2[:, None]
        curvature = omega**2 * (largest + maximax) + 2 * zeta * omega * slope
        return straight + np.minimum(
            curvature / (8 * (self.sampling_rate_hz * factor) ** 2), beside
        )

    def unseen(self, lines_hz: Floats, zeta: float) -> Floats:
        """What content above half the sampling rate may have changed (k, f), m/s2: its response is
        missing, and what it was folded to responds instead."""
        amplitude = _amplitude(self.spectrum, self.samples)
        bins_of_band = amplitude.shape[-1] / _FOLDED_BANDS
        assumed = _above(amplitude)
        half = self.sampling_rate_hz / 2
        edges = half * (1 + np.arange(assumed.shape[-1] + 1) / _FOLDED_BANDS)
        # A band lies folded about the multiples of half the sampling rate that it does not cross.
        folded = half - np.abs(edges % (2 * half) - half)
        above, below = (
            _mean_gain(low, high, lines_hz, zeta)
            for low, high in (
                (edges[:-1], edges[1:]),
                (np.minimum(folded[:-1], folded[1:]), np.maximum(folded[:-1], folded[1:])),
            )
        )
        in_phase = assumed * bins_of_band @ (above[0] + below[0]).T
        squares = assumed**2 * bins_of_band @ (above[1] + below[1]).T
        random = _CREST_RESERVE * _crest(self._high_differences())[:, None] * np.sqrt(squares / 2)
        return np.asarray(np.minimum(in_phase, random))

    def bound(
        self, lines_hz: Floats, zeta: float, factor: int, maximax: Floats, by_differences: Floats
    ) -> SamplingBound:
        """Of maximax spectra (k, f) of records that were resampled by `factor`. `by_differences`
        (k, f), m/s2, bounds what is hidden as well, and the smaller bound holds."""
        unseen = self.unseen(lines_hz, zeta)
        hidden = np.minimum(self.hidden(lines_hz, zeta, factor, maximax), by_differences)
        total, hidden, unseen = (
            _share(part, maximax) for part in (hidden + unseen, hidden, unseen)
        )
        high, largest = self._high_differences(), self.largest_m_s2
        high_share = np.abs(high).max(axis=-1) / np.where(largest > 0, largest, 1.0)
        return SamplingBound(
            total, hidden, unseen, np.where(_crest(high) < _STEADY_CREST, 0.0, high_share)
        )

    def _high_differences(self) -> Floats:
        """Of gain 1 at half the sampling rate."""
        return np.asarray(
            np.diff(self.records, min(_HIGH_DIFFERENCE, self.records.shape[-1] - 1))
            / 2**_HIGH_DIFFERENCE
        )

    def _sum(self, weights: Floats) -> Floats:
        """The largest response (k, f) to content that is weighted by (f, b)."""
        total = np.zeros((len(self.amplitudes), len(weights)))
        for band in np.unique(self.half_octave):
            inside = slice(
                *np.searchsorted(-self.half_octave, (-band, 1 - band))
            )  # the bands go up, their numbers down
            part = weights[:, inside]
            in_phase = self.amplitudes[:, inside] @ part.T
            of_peak = _GAIN_RESERVE * self.peaks[:, band, None] * part.max(axis=-1)
            total += np.fmin(in_phase, of_peak)
        return total


def _amplitude(spectrum: NDArray[np.complex128], samples: int) -> Floats:
    amplitude = np.abs(spectrum)
    amplitude *= 2 / samples
    amplitude[..., [0, -1]] *= 0.5
    return np.asarray(amplitude)


def _crest(series: Floats) -> Floats:
    """Crest factors (k,) of series (k, n); 1 for one of zeros."""
    rms = np.sqrt(np.mean(series**2, axis=-1))
    return np.asarray(np.abs(series).max(axis=-1) / np.where(rms > 0, rms, 1.0)).clip(1.0)


def _above(amplitude: Floats) -> Floats:
    """Amplitudes (k, bands) that are assumed in bands above half the sampling rate, of those below
    it (k, b)."""
    bins = amplitude.shape[-1]
    levels = [
        amplitude[:, -max(2, round(share * bins)) :].max(axis=-1) / math.sin(2 * math.pi * share)
        for share in _LEVEL_SHARES
    ]
    bands = np.arange((_FOLDED_UP_TO - 1) * _FOLDED_BANDS)
    level = np.min(levels, axis=0)[:, None] / (1 + bands / _FOLDED_BANDS)
    per = -(-bins // _FOLDED_BANDS)
    padded = np.zeros((len(amplitude), (_FOLDED_BANDS + 2) * per))
    padded[:, :bins] = amplitude[:, ::-1]
    blocks = padded.reshape(len(amplitude), -1, per).max(axis=-1)
    mirrored = np.minimum.accumulate(
        np.maximum(np.maximum(blocks[:, :-2], blocks[:, 1:-1]), blocks[:, 2:]), axis=-1
    )
    return np.asarray(np.minimum(level, mirrored[:, np.minimum(bands, _FOLDED_BANDS - 4)]))


@lru_cache(maxsize=16)
def _integrated_gain(zeta: float) -> tuple[Floats, Floats, Floats]:
    """Ratios of frequency to line, and the integrals of the gain and of its square up to each."""
    ratio = np.concatenate(([0.0], np.geomspace(1e-4, 1e6, 4001)))
    near = 1 + np.linspace(-1, 1, 801) ** 3 * min(0.9, 20 * zeta)
    ratio = np.unique(np.concatenate((ratio, near)))
    gain = _gain(ratio, np.ones(1), zeta)[0]
    steps = np.diff(ratio)
    integrals = [
        np.concatenate(([0.0], np.cumsum(steps * (y[1:] + y[:-1]) / 2))) for y in (gain, gain**2)
    ]
    return ratio, integrals[0], integrals[1]


def _mean_gain(
    low_hz: Floats, high_hz: Floats, lines_hz: Floats, zeta: float
) -> tuple[Floats, Floats]:
    """Means of the gain and of its square over bands (f, b)."""
    ratio, gain, square = _integrated_gain(zeta)
    low, high = low_hz / lines_hz[:, None], high_hz / lines_hz[:, None]
    means = [
        (np.interp(high, ratio, y) - np.interp(low, ratio, y)) / (high - low)
        for y in (gain, square)
    ]
    return means[0], means[1]


def _gain(frequency_hz: Floats, lines_hz: Floats, zeta: float) -> Floats:
    """Absolute acceleration of oscillators over that of their base, (f, b)."""
    ratio = frequency_hz[None, :] / lines_hz[:, None]
    damping = (2 * zeta * ratio) ** 2
    return np.asarray(np.sqrt((1 + damping) / ((1 - ratio**2) ** 2 + damping)))


def _largest_gain(low_hz: Floats, high_hz: Floats, lines_hz: Floats, zeta: float) -> Floats:
    """The largest gain in each band (f, b): it rises up to the resonance and falls beyond it."""
    resonance = lines_hz * np.sqrt((np.sqrt(1 + 8 * zeta**2) - 1) / (4 * zeta**2))
    nearest = np.clip(resonance[:, None], low_hz[None, :], high_hz[None, :])
    ratio = nearest / lines_hz[:, None]
    damping = (2 * zeta * ratio) ** 2
    return np.asarray(np.sqrt((1 + damping) / ((1 - ratio**2) ** 2 + damping)))


def _share(bound: Floats, maximax: Floats) -> Floats:
    """Of the true spectrum, which is at least the computed one less the bound."""
    remaining = maximax - bound
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(remaining > 0, bound / remaining, np.inf)
    return np.asarray(np.where(bound > 0, share, 0.0))
