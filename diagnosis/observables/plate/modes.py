"""Frequency, damping and amplitude of a plate's modes, run by run, as the accelerations show them.

Which line that rings is which mode of the table: an alignment that keeps the order.

Needleman and Wunsch, J. Mol. Biol. 48 (1970) 443, with modes in the place of letters. It is tried
for the plate as the table has it and for plates with other frequencies; the plate that fits best
names the modes.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats, Rows
from ....twin.effects import catalogue
from ....twin.plate.modal import ModalPlate, PlateEffect
from ....twin.plate.poles import (
    Basis,
    damping_ratios,
    frequencies_hz,
    poles_of,
    refined,
    search_poles,
    stepped_poles,
)
from .signals import AccelerationBlock, PlateSignals
from .spectra import RingingWindow, delays_s, excited, force_transforms, levels

#: How far a mode may lie from where a candidate plate has it, in ln frequency, at the cost of 1.
_WIDTH = 0.02
#: Cost of another pattern over channels and runs, and of a mode that finds no partner: at least,
#: and for each decade.
_PATTERN, _ALONE, _DECADE = 4.0, 1.0, 2.0
#: Modes below this share of the loudest are not expected to be found.
_SILENT = 0.01
#: From one candidate to the next no mode moves by more than this, in ln frequency; so many at most
#: to each effect.
_STEP, _MATCH_MOST = 0.015, 16


@dataclass(frozen=True, eq=False)
class ModeLines:
    """Frequencies (M,) in rising order, with levels (M, k) over records; None where they are not
    known."""

    frequency_hz: Floats
    level: Floats | None = None

    @property
    def cost_alone(self) -> Floats:
        """(M,): of a line without a partner; louder ones are missed more."""
        if self.level is None:
            return np.full(self.frequency_hz.size, _ALONE)
        size = np.linalg.norm(self.level, axis=1)
        loudness = np.log10(np.maximum(size / (_SILENT * size.max(initial=1e-300)), 1e-300))
        return np.asarray(np.where(loudness > 0, _ALONE + _DECADE * loudness, 0.0))

    def pair_cost(self, lines: ModeLines) -> Floats:
        """(M, L): of each of these modes with each of L lines."""
        cost = np.asarray(np.log(lines.frequency_hz / self.frequency_hz[:, None]) / _WIDTH) ** 2
        if self.level is None or lines.level is None:
            return cost
        pattern, other = (
            level / np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-300)
            for level in (self.level, lines.level)
        )
        silent = (
            self.cost_alone[:, None] == 0
        )  # a mode that is not expected takes no line from its neighbours
        return np.where(silent, np.inf, cost + _PATTERN * (1 - pattern @ other.T))


def matched(lines: ModeLines, candidates: Sequence[ModeLines]) -> Rows:
    """(M,): for each mode the line that is it, -1 for none; `candidates` are plates with the same M
    modes in order."""
    pair = np.stack(
        [plate.pair_cost(lines) for plate in candidates], axis=2
    )  # (M, L, plates), as all that follows
    mode_alone, line_alone = (
        np.stack([plate.cost_alone for plate in candidates], axis=1),
        lines.cost_alone,
    )
    m, k, _ = pair.shape
    costs = np.zeros((m + 1, k + 1, len(candidates)))
    costs[1:, 0], costs[0, 1:] = np.cumsum(mode_alone, axis=0), np.cumsum(line_alone)[:, None]
    for i, j in np.ndindex(m, k):
        alone = np.minimum(costs[i, j + 1] + mode_alone[i], costs[i + 1, j] + line_alone[j])
        costs[i + 1, j + 1] = np.minimum(costs[i, j] + pair[i, j], alone)
    best = int(np.argmin(costs[m, k]))
    cost, pair, mode_alone = costs[:, :, best], pair[:, :, best], mode_alone[:, best]
    rows = np.full(m, -1)
    i, j = m, k
    while i and j:  # the way back through the costs
        if cost[i, j] == cost[i - 1, j - 1] + pair[i - 1, j - 1]:
            i, j = i - 1, j - 1
            rows[i] = j
        elif cost[i, j] == cost[i - 1, j] + mode_alone[i - 1]:
            i -= 1
        else:
            j -= 1
    return rows


def candidate_plates(nominal: ModalPlate) -> list[ModalPlate]:
    """The nominal plate and those that any one effect of the plate makes of it within what is
    likely.

    All have the same number of modes in rising order, the k-th of each the k-th of the nominal one.
    """
    plates = [nominal]
    kinds = [kind for kind in catalogue().values() if issubclass(kind, PlateEffect)]
    for effect, item in [(kind, item) for kind in kinds for item in kind.parameters()]:
        if item.likely is not None:
            low, high = (
                effect(**{item.name: end}).apply(nominal).frequency_hz for end in item.likely
            )
            elastic = (low > 0) & (high > 0)
            farthest = float(np.max(np.abs(np.log(low[elastic] / high[elastic])), initial=0.0))
            count = min(_MATCH_MOST, int(np.ceil(farthest / _STEP)) + 1)
            values = np.linspace(*item.likely, count) if count > 1 else ()
            plates += [effect(**{item.name: float(value)}).apply(nominal) for value in values]
    return plates


#: Modes that are compared, at most; runs that modes are searched in; the fewest samples that show
#: modes.
_MOST, _SEARCHED, _FEWEST_SAMPLES = 10, 8, 40
#: Of these at either end of the band, however faint: supports act on the lowest, mountings on the
#: highest.
_ENDS = 2
#: A mode is compared where noise moves ln damping, and its ln amplitude at a channel, by less than
#: this.
CLEAR_DAMPING, _CLEAR_LEVEL = 0.15, 0.05
#: A run in which noise moves a logarithm by more than this says nothing of a mode.
LOST = 0.1
#: An amplitude that is known in no more than this share of the runs is not compared.
_SELDOM = 0.2
#: A force that gives a mode less than the first share of its impulse is near a zero of its
#: spectrum: there the least error of its shape decides, and the amplitude says nothing. From the
#: second on the phase does not hang on that shape.
_EXCITED, _PHASED = 0.1, 0.3
#: Below this share of its usual size, near a node, the table's shape is no more than its error.
_NODE = 0.1
#: More lines than modes may ring: those of mountings and clamps.
_MORE_LINES, _MOST_LINES = 10, 40
#: Modes from here on, in sampling rates, are left out: a record shows next to nothing of them.
HIGHEST = 0.45
#: Ringing is looked for from below the lowest to above the highest mode, where mountings ring.
_BAND, _MOST_OF_RATE = (0.7, 2.0), 0.49
#: Of a plate with more modes the lowest are looked for: above, they lie closer than their own
#: widths.
_MANY = 24
#: Steps that each configuration's poles are refined by; below this an amplitude is silence.
_STEPS, _SILENCE = 3, 1e-12
#: No smaller damping ratio is a first guess; below the second a simulated one is none.
_LEAST_DAMPING, LEAST_RATIO = 1e-3, 1e-6


@dataclass(frozen=True, eq=False)
class Reading:
    """Natural logarithms of all lines as read, NaN where nothing was measured, and their deviations
    under noise."""

    frequency: Floats  # (R, M)
    damping: Floats  # (R, M)
    level: Floats  # (R, S, M)
    phase: Floats  # (R, S, M): where ringing begins
    damping_noise: Floats  # (R, M)
    level_noise: Floats  # (R, S, M)

    @classmethod
    def empty(cls, runs: int, channels: int, lines: int) -> Self:
        flat, deep = (runs, lines), (runs, channels, lines)
        return cls(*(np.full(shape, np.nan) for shape in (flat, flat, deep, deep, flat, deep)))

    def of_lines(self, lines: Rows) -> Self:
        """Some lines of the reading."""
        return type(self)(*(getattr(self, item.name)[..., lines] for item in fields(self)))

    def enter(self, runs: Rows, ringing: Floats, basis: Basis, *, noisy: bool = True) -> Self:
        """Enters the `runs` of records (R, S, n), each one Gauss-Newton step from the poles of
        `basis`.

        Records that are not `noisy` have no deviations.
        """
        measured = np.isfinite(ringing[runs, :, 0])
        records, scale = scaled(ringing[runs])
        amplitudes, timed = basis.projected(records)
        residual = basis.residual(records) if noisy else records
        ends = np.cumsum(measured.sum(axis=1))
        for run, channels, end in zip(runs, measured, ends, strict=True):
            columns = slice(end - channels.sum(), end)
            step, jtj = basis.step(amplitudes[:, columns], timed[:, columns])
            poles, amplitude = (
                stepped_poles(basis.poles, step),
                basis.shifted(amplitudes[:, columns], step),
            )
            self.frequency[run], self.damping[run] = (
                np.log(frequencies_hz(poles)),
                np.log(damping_ratios(poles)),
            )
            self.level[run, channels] = np.log(
                np.maximum(np.abs(amplitude), _SILENCE) * scale[columns]
            ).T
            self.phase[run, channels] = np.angle(amplitude).T
            if noisy:
                noise = float(np.sqrt(np.mean(residual[:, columns] ** 2)))
                self.damping_noise[run], level_noise = basis.deviations(jtj, amplitude, noise)
                self.level_noise[run, channels] = level_noise.T
        return self


def scaled(ringing: Floats) -> tuple[Floats, Floats]:
    """Records (n, k) of one loudness each, from (..., n), and their loudness (k,); those not
    measured are left out."""
    flat = ringing.reshape(-1, ringing.shape[-1])
    flat = flat[np.isfinite(flat[:, 0])]
    scale = np.maximum(np.abs(flat).max(axis=1), 1e-300)
    return np.asarray((flat / scale[:, None]).T), scale


def median(values: Floats) -> Floats:
    """Over the first axis, of what is known; NaN where nothing is."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanmedian(values, axis=0))


class ModeSearch:
    """The `modes` (M,) of a plate, by their rows in its table, that are looked for below the end of
    a band.

    In `ringing` (R, S, n), which is what `window` leaves of the accelerations, and first in the
    runs `searched` (r,).
    """

    def __init__(
        self,
        plate: ModalPlate,
        block: AccelerationBlock,
        begin: int,
        configuration: Rows,
        peak: Floats,
    ) -> None:
        """Of a plate with an elastic mode, in accelerations that ring freely from the sample
        `begin` on.

        Of each of some of the configurations (R,) the run with the highest `peak` (R,) is searched;
        0 for a run that cannot be used.
        """
        elastic = plate.frequency_hz > 0
        frequency = plate.frequency_hz[elastic]
        highest = (
            float(frequency.max()) * _BAND[1]
            if frequency.size <= _MANY
            else float(frequency[_MANY])
        )
        self.band_hz = (
            _BAND[0] * float(frequency.min()),
            min(highest, _MOST_OF_RATE * block.rate_hz),
        )
        self.damping_ratio = max(float(np.median(plate.damping_ratio[elastic])), _LEAST_DAMPING)
        self.modes: Rows = np.flatnonzero(elastic & (plate.frequency_hz <= self.band_hz[1]))
        self.window = RingingWindow.of(begin, block.samples, block.rate_hz, self.band_hz[1])
        self.ringing = self.window.cut(block.acceleration)
        self.configuration = configuration
        best = [
            int(np.argmax(np.where(configuration == c, peak, -1.0)))
            for c in np.unique(configuration)
        ]
        rows = np.array([row for row in best if peak[row] > 0], dtype=np.intp)
        self.searched: Rows = rows[
            np.linspace(0, rows.size - 1, min(_SEARCHED, rows.size)).round().astype(np.intp)
        ]

    def read(self, candidates: Sequence[ModeLines]) -> tuple[Rows, Reading]:
        """The rows in the table (K,) of the modes that ring, and their reading run by run.

        Modes are named by the candidate plate that fits best, as in `matched`. None where ringing
        is too short.
        """
        runs, channels, samples = self.ringing.shape
        step_s, nothing = (
            self.window.step_s,
            (np.zeros(0, dtype=np.intp), Reading.empty(runs, channels, 0)),
        )
        if not self.searched.size or samples < _FEWEST_SAMPLES:
            return nothing
        records, _ = scaled(self.ringing[self.searched])
        most = min(_MOST_LINES, self.modes.size + _MORE_LINES)
        poles = search_poles(records, step_s, self.band_hz, self.damping_ratio, most)
        if not poles.size:
            return nothing
        amplitudes, _ = Basis.of(poles, samples, step_s).projected(records)
        lines = matched(ModeLines(frequencies_hz(poles), np.abs(amplitudes)), candidates)
        reading = Reading.empty(runs, channels, poles.size)
        measured = np.isfinite(self.ringing[:, :, 0]).any(axis=1)
        for c in np.unique(self.configuration[measured]):  # each has its poles, from all its runs
            rows = np.flatnonzero((self.configuration == c) & measured)
            refined_poles = refined(poles, scaled(self.ringing[rows])[0], step_s, _STEPS)
            reading.enter(rows, self.ringing, Basis.of(refined_poles, samples, step_s))
        return self.modes[lines >= 0], reading.of_lines(lines[lines >= 0])


def best_modes(clear: NDArray[np.bool_], loudness: Floats) -> Rows:
    """Of M modes the ends and the loudest of those that are `clear` (M,), in rising order."""
    good = np.flatnonzero(clear)
    middle = good[_ENDS:-_ENDS]
    loudest = middle[np.argsort(-loudness[middle])][: _MOST - 2 * _ENDS]
    return np.unique(np.concatenate([good[:_ENDS], loudest, good[-_ENDS:]])).astype(np.intp)


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """Of K modes: their `rows` (K,) in the table, where they are at `frequency_hz` (K,).

    `ringing` are the rows of all modes that ring in `window`, those that are too faint to be
    compared among them.
    """

    window: RingingWindow
    rows: Rows
    ringing: Rows
    frequency_hz: Floats
    frequency: Floats  # (R, K): natural logarithm, as that of `damping`
    damping: Floats  # (R, K)
    # (R, S, K): ln of the amplitude in m/s2 where ringing begins, NaN where it was not measured
    level: Floats
    clear: NDArray[
        np.bool_
    ]  # (S, K): at which channels a mode stands out of the noise, and is not near a node
    delay_s: Floats  # (R, S): by how much later than its force the plate rings,
    weight: Floats  # (S, K): read with this weight from its modes


def measured_modes(plate: ModalPlate, signals: PlateSignals, configuration: Rows) -> MeasuredModes:
    """Modes that ring and that are the table's: the ends and the loudest of the clear modes, in
    rising order."""
    peak = np.where(signals.good.all(axis=1), np.nan_to_num(signals.peak_n), 0.0)
    search = ModeSearch(plate, signals, signals.ringing, configuration, peak)
    modes, reading = search.read(_candidate_lines(plate, signals, search))
    # how much of a force acts on a mode, where it is and where the table has it
    measured = np.where(
        np.isfinite(reading.frequency), np.exp(reading.frequency), plate.frequency_hz[modes]
    )
    table = np.broadcast_to(plate.frequency_hz[modes], measured.shape)
    share = np.minimum(excited(signals.force, measured), excited(signals.force, table))
    level = np.where((share > _EXCITED)[:, None], reading.level, np.nan)
    legible = np.isfinite(level) & (reading.level_noise < LOST)
    noise = median(np.where(legible, reading.level_noise, np.nan))
    clear = (noise < _CLEAR_LEVEL) & (legible.sum(axis=0) > _SELDOM * level.shape[0])
    loudness = np.max(np.where(clear, median(level), -np.inf), axis=0)
    best = best_modes((median(reading.damping_noise) < CLEAR_DAMPING) & clear.any(axis=0), loudness)
    reading, clear, legible, rows = (
        reading.of_lines(best),
        clear[:, best],
        legible[:, :, best],
        modes[best],
    )
    weight = np.where(clear & (median(share[:, best]) > _PHASED), 1.0, 0.0)
    shapes = np.abs(plate.shapes[[plate.sensor(name) for name in signals.channels]])
    nodes = shapes < _NODE * np.sqrt(np.mean(shapes**2, axis=1, keepdims=True))
    comparable = clear & ~nodes[:, rows]
    undisturbed = reading.damping_noise < LOST
    return MeasuredModes(
        window=search.window,
        rows=rows,
        ringing=modes,
        frequency_hz=plate.frequency_hz[rows],
        frequency=np.where(undisturbed, reading.frequency, np.nan),
        damping=np.where(undisturbed, reading.damping, np.nan),
        level=np.where(legible, reading.level, np.nan),
        clear=comparable,
        delay_s=_delay_s(reading, signals, search.window, weight),
        weight=np.where(comparable, weight, 0.0),
    )


def _candidate_lines(
    plate: ModalPlate, signals: PlateSignals, search: ModeSearch
) -> list[ModeLines]:
    """What candidate plates ring with in the runs that are searched, in shares of what is the
    loudest in a record."""
    runs, begin_s = search.searched, search.window.start_s
    forces = [signals.force[run] for run in runs]
    size = np.abs(search.ringing[runs]).max(axis=2, keepdims=True, initial=1e-300)
    lines = []
    for candidate in candidate_plates(plate):
        poles = poles_of(
            candidate.frequency_hz[search.modes], candidate.damping_ratio[search.modes]
        )
        transforms = force_transforms(forces, poles, signals.first_s[runs] + begin_s)
        level = levels(candidate, search.modes, signals, runs, transforms) / size
        lines.append(
            ModeLines(candidate.frequency_hz[search.modes], level.reshape(-1, search.modes.size).T)
        )
    return lines


def _delay_s(
    reading: Reading, signals: PlateSignals, window: RingingWindow, weight: Floats
) -> Floats:
    """(R, S): by how much later modes begin than under the force that was read."""
    poles = poles_of(np.exp(reading.frequency), np.exp(reading.damping))
    since_s = signals.first_s + window.start_s - signals.centre_s
    # turned back to the force's centre, less the phase of -i lambda^2, which a mode has of itself
    angle = reading.phase - (np.angle(-1j * poles**2) + poles.imag * since_s[:, None])[:, None]
    usual = poles_of(np.exp(median(reading.frequency)), np.exp(median(reading.damping)))
    angle = angle - np.angle(force_transforms(signals.force, usual, signals.centre_s))[:, None]
    return delays_s(angle, 2 * np.pi * np.exp(reading.frequency), weight)
