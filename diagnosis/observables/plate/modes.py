"""Frequency, damping and amplitude of a plate's modes, run by run, as the accelerations show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ....twin.plate.modal import ModalPlate
from ...record import Floats
from .match import Lines, Rows, matched
from .poles import Basis, Complexes, Poles, bounded_step, moved, refined, search_poles
from .ringing import ENOUGH, delays_s, excited, phases, phases_at
from .signals import PlateSignals
from .spectra import RingingWindow

#: Modes that are compared, at most; runs that modes are searched in; the fewest samples that show modes.
MOST, _SEARCHED, _FEWEST_SAMPLES = 10, 8, 40
#: Of these at either end of the band, however faint: supports act on the lowest, mountings on the highest.
_ENDS = 2
#: A mode is compared where noise moves ln damping, and its ln amplitude at a channel, by less than this.
CLEAR_DAMPING, _CLEAR_LEVEL = 0.15, 0.05
#: A run in which noise moves a logarithm by more than this says nothing of a mode.
LOST = 0.1
#: An amplitude that is known in no more than this share of the runs is not compared.
_SELDOM = 0.2
#: A force that gives a mode less than this share of its impulse is near a zero of its spectrum: there the least error
#: of its shape decides, and the amplitude says nothing.
_EXCITED = 0.1
#: More lines than modes may ring: those of mountings and clamps.
_MORE_LINES, _MOST_LINES = 10, 40
#: Modes from here on, in sampling rates, are left out: a record shows next to nothing of them.
HIGHEST = 0.45
#: Ringing is looked for from below the lowest to above the highest mode, where mountings ring.
_BAND, _MOST_OF_RATE = (0.7, 2.0), 0.49
#: Of a plate with more modes the lowest are looked for: above, they lie closer than their own widths.
_MANY = 24
#: Steps that each configuration's poles are refined by; below this an amplitude is silence.
_STEPS, _SILENCE = 3, 1e-12
#: No smaller damping ratio is a first guess.
_LEAST_DAMPING = 1e-3


@dataclass(frozen=True, eq=False)
class Reading:
    """All lines, (R, M) and (R, S, M), with their standard deviations under noise; `phase` where ringing begins."""

    frequency: Floats
    damping: Floats
    level: Floats
    phase: Floats
    damping_noise: Floats
    level_noise: Floats

    @classmethod
    def empty(cls, runs: int, channels: int, lines: int) -> Self:
        flat, deep = (runs, lines), (runs, channels, lines)
        return cls(*(np.full(shape, np.nan) for shape in (flat, flat, deep, deep, flat, deep)))

    def of_lines(self, lines: NDArray[np.intp]) -> Self:
        """Some lines of the reading."""
        return type(self)(*(getattr(self, item.name)[..., lines] for item in fields(self)))

    def enter_step(
        self, run: int, channels: NDArray[np.intp], scale: Floats, basis: Basis, amplitudes: Complexes, timed: Floats
    ) -> tuple[Floats, Complexes]:
        """Enters a run, one Gauss-Newton step from the poles of `basis`, and returns J'J and the new amplitudes.

        `scale` (k,) is the loudness of its records, by which amplitudes (M, k) are multiplied; `timed` as in
        `Basis.normal`.
        """
        jtj, jtr = basis.normal(amplitudes, timed)
        step = bounded_step(basis, jtj, jtr)
        poles, amplitudes = moved(basis.poles, step), basis.shifted(amplitudes, step)
        self.frequency[run], self.damping[run] = np.log(poles.frequency_hz), np.log(poles.damping_ratio)
        self.level[run, channels] = np.log(np.maximum(np.abs(amplitudes), _SILENCE) * scale).T
        self.phase[run, channels] = np.angle(amplitudes).T
        return jtj, amplitudes


def median(values: Floats, axis: int) -> Floats:
    """Median of what is known; NaN where nothing is."""
    ranked = np.sort(values, axis=axis)  # NaN goes last
    count = np.isfinite(values).sum(axis=axis, keepdims=True)
    low, high = np.maximum((count - 1) // 2, 0), np.maximum(count // 2, 0)
    ends = [np.take_along_axis(ranked, np.minimum(at, ranked.shape[axis] - 1), axis=axis) for at in (low, high)]
    return np.asarray(np.where(count > 0, (ends[0] + ends[1]) / 2, np.nan).squeeze(axis))


def read_runs(ringing: Floats, configuration: NDArray[np.intp], poles: Poles, step_s: float) -> Reading:
    """Each configuration has its poles, from all its runs; each run is one Gauss-Newton step from them."""
    runs, channels, samples = ringing.shape
    reading = Reading.empty(runs, channels, poles.omega.size)
    good = np.isfinite(ringing[:, :, 0])
    for c in np.unique(configuration[good.any(axis=1)]):
        rows = np.flatnonzero((configuration == c) & good.any(axis=1))
        basis = Basis.of(refined(poles, scaled(ringing[rows])[0], step_s, _STEPS), samples, step_s)
        for run in rows:
            measured = np.flatnonzero(good[run])
            records, scale = scaled(ringing[run])
            residual = basis.residual(records)
            amplitudes, timed = basis.amplitudes(records), basis.timed.T @ residual
            jtj, amplitudes = reading.enter_step(int(run), measured, scale, basis, amplitudes, timed)
            noise = float(np.sqrt(np.mean(residual**2)))
            reading.damping_noise[run], level_noise = basis.deviations(jtj, amplitudes, noise)
            reading.level_noise[run, measured] = level_noise.T
    return reading


def read_simulated(basis: Basis, ringing: Floats) -> Reading:
    """As `read_runs`, of records (R, S, n) without noise, all with the poles of `basis`: their deviations are not asked
    for. A run is NaN in all of its channels or in none."""
    runs, channels, _ = ringing.shape
    reading = Reading.empty(runs, channels, basis.poles.omega.size)
    records, scale = scaled(ringing)
    amplitudes, timed = basis.projected(records)
    every = np.arange(channels)
    for k, run in enumerate(np.flatnonzero(np.isfinite(ringing[:, 0, 0]))):
        columns = slice(k * channels, (k + 1) * channels)
        reading.enter_step(int(run), every, scale[columns], basis, amplitudes[:, columns], timed[:, columns])
    return reading


def scaled(ringing: Floats) -> tuple[Floats, Floats]:
    """Records (n, k) of one loudness each, from (..., n), and their loudness (k,); those not measured are left out."""
    flat = ringing.reshape(-1, ringing.shape[-1])
    flat = flat[np.isfinite(flat[:, 0])]
    scale = np.maximum(np.abs(flat).max(axis=1), 1e-300)
    return np.asarray((flat / scale[:, None]).T), scale


@dataclass(frozen=True, eq=False)
class ModeSearch:
    """What is looked for: the `modes` (M,) of a plate, by their rows in its table, that lie below the end of a band."""

    plate: ModalPlate
    modes: Rows
    band_hz: tuple[float, float]
    damping_ratio: float

    @classmethod
    def of(cls, plate: ModalPlate, rate_hz: float) -> ModeSearch:
        """In records of this sampling rate, of a plate with an elastic mode."""
        elastic = plate.frequency_hz > 0
        frequency = plate.frequency_hz[elastic]
        highest = float(frequency.max()) * _BAND[1] if frequency.size <= _MANY else float(frequency[_MANY])
        band = _BAND[0] * float(frequency.min()), min(highest, _MOST_OF_RATE * rate_hz)
        modes = np.flatnonzero(elastic & (plate.frequency_hz <= band[1]))
        return cls(plate, modes, band, max(float(np.median(plate.damping_ratio[elastic])), _LEAST_DAMPING))

    def read(
        self,
        ringing: Floats,
        step_s: float,
        searched: Rows,
        configuration: NDArray[np.intp],
        candidates: Sequence[Lines],
        *,
        patterns: bool = True,
    ) -> tuple[Rows, Reading]:
        """The rows in the table (K,) of the modes that ring in records (R, S, n), and their reading run by run.

        Modes are searched in the runs `searched` and named by the candidate plate that fits best, as in `matched`.
        None where ringing is too short to tell them.
        """
        runs, channels, samples = ringing.shape
        if searched.size and samples >= _FEWEST_SAMPLES:
            records, _ = scaled(ringing[searched])
            most = min(_MOST_LINES, self.modes.size + _MORE_LINES)
            poles = search_poles(records, step_s, self.band_hz, self.damping_ratio, most)
            if poles.omega.size:
                level = np.abs(Basis.of(poles, records.shape[0], step_s).amplitudes(records))
                lines = matched(Lines(poles.frequency_hz, level), candidates, patterns=patterns)
                known = np.flatnonzero(lines >= 0)
                return self.modes[known], read_runs(ringing, configuration, poles, step_s).of_lines(lines[known])
        return np.zeros(0, dtype=np.intp), Reading.empty(runs, channels, 0)


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """Of K modes: `modes` (K,) their rows in the table, natural logarithms of `frequency` and `damping` (R, K).

    `ringing` are the rows of all modes that were found, those that are too faint to be compared among them.
    `delay` (R, S) in s is by how much later than its force the plate rings, read with `weight` (S, K) from its modes.
    `level` (R, S, K) is the logarithm of the amplitude in m/s2 where ringing begins, NaN where it was not measured.
    `clear` (S, K) says at which channels a mode stands out of the noise, and is not near a node.
    """

    modes: Rows
    frequency: Floats
    damping: Floats
    level: Floats
    clear: NDArray[np.bool_]
    ringing: Rows
    delay: Floats
    weight: Floats


def measured_modes(
    signals: PlateSignals,
    window: RingingWindow,
    search: ModeSearch,
    searched: Rows,
    configuration: NDArray[np.intp],
    candidates: Sequence[tuple[Floats, Floats]],
    nodes: NDArray[np.bool_],
) -> MeasuredModes:
    """Modes that ring and that are the table's: the ends and the loudest of the clear modes, in rising order.

    `candidates`: frequencies (M,) and amplitudes (r, S, M), at the runs `searched` (r,), of plates with the M modes of
    the search. Amplitudes near `nodes` (S, all modes) are not compared.
    """
    ringing = window.cut(signals.acceleration)
    size = np.abs(ringing[searched]).max(axis=2, keepdims=True, initial=1e-300)
    lines = [Lines(f, (level / size).reshape(-1, level.shape[-1]).T) for f, level in candidates]
    modes, reading = search.read(ringing, window.step_s, searched, configuration, lines)
    share = _excited_share(reading, signals, search.plate.frequency_hz[modes])
    level = np.where((share > _EXCITED)[:, None], reading.level, np.nan)
    known = np.isfinite(level) & (reading.level_noise < LOST)
    noise = median(np.where(known, reading.level_noise, np.nan), axis=0)
    clear = (noise < _CLEAR_LEVEL) & (known.sum(axis=0) > _SELDOM * level.shape[0])
    loud = np.max(np.where(clear, median(level, axis=0), -np.inf), axis=0)
    damped = median(reading.damping_noise, axis=0) < CLEAR_DAMPING
    best = best_modes(np.flatnonzero(damped & clear.any(axis=0)), loud)
    reading = replace(reading, level=level).of_lines(best)
    measured = reading.damping_noise < LOST
    weight = np.where(clear[:, best] & (median(share[:, best], axis=0) > ENOUGH), 1.0, 0.0)
    comparable = clear[:, best] & ~nodes[:, modes[best]]
    return MeasuredModes(
        modes=modes[best],
        frequency=np.where(measured, reading.frequency, np.nan),
        damping=np.where(measured, reading.damping, np.nan),
        level=np.where(known[:, :, best], reading.level, np.nan),
        clear=comparable,
        ringing=modes,
        delay=_delay(reading, signals, window, weight),
        weight=np.where(comparable, weight, 0.0),
    )


def _excited_share(reading: Reading, signals: PlateSignals, frequency_hz: Floats) -> Floats:
    """(R, M): how much of a force acts on a mode, where it is or where the table has it."""
    measured = np.where(np.isfinite(reading.frequency), np.exp(reading.frequency), frequency_hz)
    table = np.broadcast_to(frequency_hz, measured.shape)
    return np.minimum(excited(signals.force, measured), excited(signals.force, table))


def _delay(reading: Reading, signals: PlateSignals, window: RingingWindow, weight: Floats) -> Floats:
    """(R, S): by how much later modes begin than under the force that was read."""
    since_s = signals.first_s + window.start_s - signals.centre_s
    angle = phases_at(reading.phase, reading.frequency, reading.damping, since_s)
    frequency, damping = (np.exp(median(values, axis=0)) for values in (reading.frequency, reading.damping))
    usual = phases(frequency, damping, signals.force, signals.centre_s)
    return delays_s(angle - usual, 2 * np.pi * np.exp(reading.frequency), weight)


def best_modes(good: Rows, loud: Floats) -> Rows:
    """Of the rows `good` the ends and the loudest, in rising order; `loud` (M,) of all."""
    middle = good[_ENDS:-_ENDS]
    loudest = middle[np.argsort(-loud[middle])][: MOST - 2 * _ENDS]
    return np.unique(np.concatenate([good[:_ENDS], loudest, good[-_ENDS:]])).astype(np.intp)


def searched_runs(peak: Floats, configuration: NDArray[np.intp]) -> Rows:
    """Of each of some configurations the run with the highest `peak` (R,), 0 for a run that cannot be used."""
    best = [int(np.argmax(np.where(configuration == c, peak, -1.0))) for c in np.unique(configuration)]
    rows = np.array([row for row in best if peak[row] > 0], dtype=np.intp)
    return rows[np.linspace(0, rows.size - 1, min(_SEARCHED, rows.size)).round().astype(np.intp)]
