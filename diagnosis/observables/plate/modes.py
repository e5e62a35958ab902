"""Frequency, damping and amplitude of a plate's modes, run by run, as the accelerations show them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...record import Floats
from .delay import ENOUGH, delays_s
from .match import Lines, Rows, matched
from .poles import Basis, Poles
from .ringing import excited, phases, phases_at
from .runs import Reading, median, read_runs, scaled
from .search import found_poles
from .signals import PlateSignals
from .window import RingingWindow

#: Modes that are compared, at most; runs that modes are searched in.
MOST, _SEARCHED = 10, 8
#: Of these at either end of the band, however faint: supports act on the lowest, mountings on the highest.
_ENDS = 2
#: A mode is compared where noise moves ln damping, and its ln amplitude at a channel, by less than this.
_CLEAR_DAMPING, _CLEAR_LEVEL = 0.15, 0.05
#: A run in which noise moves a logarithm by more than this says nothing of a mode.
_LOST = 0.1
#: An amplitude that is known in no more than this share of the runs is not compared.
_SELDOM = 0.2
#: A force that gives a mode less than this share of its impulse is near a zero of its spectrum: there the least error
#: of its shape decides, and the amplitude says nothing.
_EXCITED = 0.1
#: More lines than modes may ring: those of mountings and clamps.
_MORE_LINES, _MOST_LINES = 10, 40


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """Of K modes: `modes` (K,) their rows in the table, natural logarithms of `frequency` and `damping` (R, K).

    `ringing` are the rows of all modes that were found, those that are too faint to be compared among them.
    `delay` (R, S) in s is by how much later than its force the plate rings, read with `weight` (S, K) from its modes.
    `level` (R, S, K) is the logarithm of the amplitude in m/s2 where ringing begins, NaN where it was not measured.
    `clear` (S, K) says at which channels a mode stands out of the noise.
    """

    modes: Rows
    frequency: Floats
    damping: Floats
    level: Floats
    clear: NDArray[np.bool_]
    ringing: Rows
    delay: Floats
    weight: Floats

    @classmethod
    def none(cls, runs: int, channels: int) -> MeasuredModes:
        empty = np.zeros((runs, 0))
        clear = np.zeros((channels, 0), dtype=bool)
        rows = np.zeros(0, dtype=np.intp)
        level, delay = np.zeros((runs, channels, 0)), np.full((runs, channels), np.nan)
        return cls(rows, empty, empty, level, clear, rows, delay, np.zeros((channels, 0)))


def measured_modes(
    signals: PlateSignals,
    window: RingingWindow,
    configuration: NDArray[np.intp],
    tried: Sequence[tuple[Floats, Floats]],
    band_hz: tuple[float, float],
    damping_ratio: float,
) -> MeasuredModes:
    """Modes that ring and that are the table's.

    `tried`: frequencies (M,) and amplitudes (r, S, M), at the runs of `searched_runs`, of plates with the table's M
    modes. No modes where ringing is too short to tell them.
    """
    ringing = window.cut(signals.acceleration)
    rows = searched_runs(signals, configuration)
    if not rows.size or ringing.shape[2] < 4 * MOST:
        return MeasuredModes.none(*ringing.shape[:2])
    most = min(_MOST_LINES, tried[0][0].size + _MORE_LINES)
    records = scaled(ringing[rows])
    poles = found_poles(records, window.step_s, band_hz, damping_ratio, most)
    if not poles.omega.size:
        return MeasuredModes.none(*ringing.shape[:2])
    named = matched(_found(poles, records, window.step_s), [_predicted(*each, ringing[rows]) for each in tried])
    known = np.flatnonzero(named >= 0)
    reading = read_runs(ringing, configuration, poles, window.step_s).of_lines(named[known])
    share = _share(reading, signals, tried[0][0][known])
    reading = replace(reading, level=np.where((share > _EXCITED)[:, None], reading.level, np.nan))
    return _chosen(reading, known, signals, window, share)


def _share(reading: Reading, signals: PlateSignals, frequency_hz: Floats) -> Floats:
    """(R, M): how much of a force acts on a mode, where it is or where the table has it."""
    measured = np.where(np.isfinite(reading.frequency), np.exp(reading.frequency), frequency_hz)
    table = np.broadcast_to(frequency_hz, measured.shape)
    return np.minimum(excited(signals.force, measured), excited(signals.force, table))


def _chosen(
    reading: Reading, modes: Rows, signals: PlateSignals, window: RingingWindow, share: Floats
) -> MeasuredModes:
    """The ends and the loudest of the clear modes, in rising order."""
    known = np.isfinite(reading.level) & (reading.level_noise < _LOST)
    damping = median(reading.damping_noise, axis=0)
    noise = median(np.where(known, reading.level_noise, np.nan), axis=0)
    clear = (noise < _CLEAR_LEVEL) & (known.sum(axis=0) > _SELDOM * reading.level.shape[0])
    loud = np.max(np.where(clear, median(reading.level, axis=0), -np.inf), axis=0)
    best = best_modes(np.flatnonzero((damping < _CLEAR_DAMPING) & clear.any(axis=0)), loud)
    picked = reading.of_lines(best)
    heard, enough = picked.damping_noise < _LOST, median(share[:, best], axis=0) > ENOUGH
    weight = np.where(clear[:, best] & enough, 1.0, 0.0)
    return MeasuredModes(
        modes=modes[best],
        frequency=np.where(heard, picked.frequency, np.nan),
        damping=np.where(heard, picked.damping, np.nan),
        level=np.where(known[:, :, best], picked.level, np.nan),
        clear=clear[:, best],
        ringing=modes,
        delay=_delay(picked, signals, window, weight),
        weight=weight,
    )


def _delay(reading: Reading, signals: PlateSignals, window: RingingWindow, weight: Floats) -> Floats:
    """(R, S): by how much later modes begin than under the force that was read."""
    since_s = signals.first_s + window.start_s - signals.centre_s
    angle = phases_at(reading.phase, reading.frequency, reading.damping, since_s)
    usual = phases(
        np.exp(median(reading.frequency, axis=0)),
        np.exp(median(reading.damping, axis=0)),
        signals.force,
        signals.centre_s,
    )
    return delays_s(angle - usual[:, None], 2 * np.pi * np.exp(reading.frequency), weight)


def best_modes(good: Rows, loud: Floats) -> Rows:
    """Of the rows `good` the ends and the loudest, in rising order; `loud` (M,) of all."""
    middle = good[_ENDS:-_ENDS]
    loudest = middle[np.argsort(-loud[middle])][: MOST - 2 * _ENDS]
    return np.unique(np.concatenate([good[:_ENDS], loudest, good[-_ENDS:]])).astype(np.intp)


def of_table(found: MeasuredModes, rows: Rows, nodes: NDArray[np.bool_]) -> MeasuredModes:
    """With the rows that the modes have in a table; amplitudes near nodes (S, all modes) are not compared."""
    modes = rows[found.modes]
    clear = found.clear & ~nodes[:, modes]
    return replace(
        found, modes=modes, ringing=rows[found.ringing], clear=clear, weight=np.where(clear, found.weight, 0.0)
    )


def searched_runs(signals: PlateSignals, configuration: NDArray[np.intp]) -> Rows:
    """The hardest run of each of some configurations, with all channels."""
    peak = np.array([0.0 if force is None else float(np.abs(force.values).max()) for force in signals.force])
    peak = np.where(signals.good.all(axis=1), peak, 0.0)
    best = [int(np.argmax(np.where(configuration == c, peak, -1.0))) for c in np.unique(configuration)]
    rows = np.array([row for row in best if peak[row] > 0], dtype=np.intp)
    return rows[np.linspace(0, rows.size - 1, min(_SEARCHED, rows.size)).round().astype(np.intp)]


def _found(poles: Poles, records: Floats, step_s: float) -> Lines:
    level = np.abs(Basis.of(poles, records.shape[0], step_s).amplitudes(records))
    return Lines(poles.frequency_hz, level)


def _predicted(frequency_hz: Floats, level: Floats, ringing: Floats) -> Lines:
    """As loud beside each other as the measured records are made."""
    scaled = level / np.abs(ringing).max(axis=2, keepdims=True)
    return Lines(frequency_hz, scaled.reshape(-1, level.shape[-1]).T)
