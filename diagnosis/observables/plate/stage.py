"""The plate: from the force on it, as read, to the accelerations that the channels show.

The observables of the plate stage and their order: modes, then channel by channel lines, amplitudes
and rests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np

from ....array_types import Floats, Rows
from ....twin.effects import Effect
from ....twin.plate.modal import ModalPlate, PlateEffect
from ....twin.plate.response import kept_below
from ....twin.sensors.chain import SensorChain
from ...record import CampaignRecord, Series
from ..base import Observable, Stage, Upstream, changes_reading, sensor_chain
from .driven import DrivenPlates
from .modes import HIGHEST, LEAST_RATIO, MeasuredModes, measured_modes
from .signals import PlateSignals
from .spectra import Forces, Spectra, delays_s, levels

#: Tolerances and floors. 0.5 dB of a spectrum is what the field calls agreement, and 6 % of an
#: amplitude. 0.2 % of a frequency is 0.4 % of a modulus. Damping is seldom known to 10 %. A rest is
#: a share of the largest acceleration.
_SRS = (0.5, 0.15)
_FREQUENCY = (0.002, 0.0003)
_DAMPING = (0.1, 0.02)
_LEVEL = (0.06, 0.015)
_REST = (0.002, 0.0003)
#: A delay is a share of the contact time. Small errors of frequencies, within their tolerance, look
#: like a tenth of it.
_DELAY = (0.1, 0.004)
#: A delay that is measured to be larger is a contact whose begin could not be read.
_MOST_DELAY = 0.25


def mode_observables(
    frequency_hz: Floats,
    ringing_s: tuple[float, float],
    tolerance: tuple[float, float] = (_FREQUENCY[0], _DAMPING[0]),
) -> tuple[Observable, ...]:
    """Logarithms of frequencies, then of damping ratios, of modes. They belong to the plate and no
    sensor alone.

    Parameters:
        frequency_hz: Where the table has the modes (K,).
        ringing_s: Begin and end of the part of the records that they are read from.
        tolerance: The tolerances of frequency and damping ratio, as logarithms; by default 0.002
            and 0.1.
    """
    return tuple(
        Observable(
            f"ln {what} of the mode at {f:.4g} Hz",
            "plate",
            "plate",
            "1",
            within,
            floor,
            float(f),
            ringing_s,
        )
        for what, within, floor in zip(
            ("frequency", "damping"), tolerance, (_FREQUENCY[1], _DAMPING[1]), strict=True
        )
        for f in frequency_hz
    )


@dataclass(frozen=True, eq=False)
class Columns:
    """Which of the readings are observables."""

    signals: PlateSignals
    spectra: Spectra
    modes: MeasuredModes

    def observables(self) -> tuple[Observable, ...]:
        ringing_s = self.signals.window_s(self.signals.ringing, self.signals.samples)
        rests_s = [self.signals.window_s(*window) for window in self.spectra.windows]
        columns = list(mode_observables(self.modes.frequency_hz, ringing_s))
        for row, channel in enumerate(self.signals.channels):
            modes_hz = self.modes.frequency_hz[self.modes.clear[row]].tolist()
            # name, unit, tolerance and floor, frequency, window, whether it is a detail
            kinds: list[
                tuple[str, str, tuple[float, float], float | None, tuple[float, float] | None, bool]
            ] = [
                *(
                    (f"spectrum at {f:.4g} Hz", "dB", _SRS, f, None, False)
                    for f in self.spectra.lines_hz.tolist()
                ),
                *(
                    (f"ln amplitude of the mode at {f:.4g} Hz", "1", _LEVEL, f, ringing_s, False)
                    for f in modes_hz
                ),
                *(
                    (f"rest from {a * 1e3:.3g} to {b * 1e3:.3g} ms", "1", _REST, None, (a, b), True)
                    for a, b in rests_s
                ),
                *([("delay", "1", _DELAY, None, None, True)] if self._shows_delay(row) else []),
            ]
            columns += [
                Observable(
                    f"{channel} {name}",
                    "plate",
                    channel,
                    unit,
                    *accuracy,
                    frequency_hz,
                    window_s,
                    detail,
                )
                for name, unit, accuracy, frequency_hz, window_s, detail in kinds
            ]
        return tuple(columns)

    def table(
        self,
        frequency: Floats,
        damping: Floats,
        level: Floats,
        acceleration: Floats,
        delay_s: Floats,
    ) -> Floats:
        """The observables (R, d) of R runs.

        Parameters:
            frequency: Logarithms (R, K) of the frequencies of K modes, Hz.
            damping: Logarithms (R, K) of their damping ratios.
            level: Logarithms (R, S, K) of their amplitudes in S channels, m/s2.
            acceleration: Accelerations (R, S, n), m/s2, as the channels show them.
            delay_s: By how much later than its force the plate rings (R, S).
        """
        lines_db, rests = self.spectra.levels_db(acceleration), self.spectra.rests(acceleration)
        parts = [frequency, damping]
        for row in range(len(self.signals.channels)):
            parts += [lines_db[:, row], level[:, row, self.modes.clear[row]], rests[:, row]]
            if self._shows_delay(row):
                parts.append(delay_s[:, row, None] / self.signals.contact_s)
        return np.concatenate(parts, axis=1)

    def measured(self) -> Floats:
        """(R, d): as the records show them."""
        modes = self.modes
        delay_s = np.where(
            np.abs(modes.delay_s) < _MOST_DELAY * self.signals.contact_s, modes.delay_s, np.nan
        )
        return self.table(
            modes.frequency, modes.damping, modes.level, self.signals.acceleration, delay_s
        )

    def _shows_delay(self, row: int) -> bool:
        return bool(np.any(self.modes.weight[row] > 0))


#: Below this the logarithm of a level is one of nothing.
_LEAST_LEVEL = 1e-12
#: With fewer compared modes there are no bands of them that could differ.
_FEWEST_IN_BANDS = 6


class PlateObservables(Stage):
    """The modal table, or a solved model, driven by the measured force at the impact point of each
    run.

    In what follows `forces` (k,) are the true ones of the `runs` (k,) of the record, None where
    there is none. Raises `ValueError` for a record without a plate, without a run that has a force
    and an acceleration at one of its sensors, and for an impact position that the plate has not.
    """

    name = "plate"
    simulator = "plate:modal"
    effect_kind = PlateEffect
    sensor_hooks = ("measured_force_n", "measured_acceleration_m_s2")

    def __init__(self, record: CampaignRecord) -> None:
        super().__init__(record)
        if record.plate is None:
            raise ValueError(
                f"campaign {record.name!r} has no plate: "
                f"its modes or its make stand in [bench.plate]"
            )
        self.signals = signals = PlateSignals.of_record(record, record.plate)
        limit_hz = HIGHEST * signals.rate_hz
        self.plate: ModalPlate = kept_below(record.plate, limit_hz)
        if not np.any(self.plate.frequency_hz > 0):
            raise ValueError(
                f"campaign {record.name!r}: no mode of the plate lies below {limit_hz:g} Hz, "
                "which is as high as its records reach"
            )
        self.assumptions = signals.assumptions
        if dropped := record.plate.frequency_hz.size - self.plate.frequency_hz.size:
            note = (
                f"{dropped} modes of the plate above "
                f"{limit_hz:g} Hz are left out: records end there"
            )
            self.assumptions = (*self.assumptions, note)
        self.modes = measured_modes(self.plate, signals, record.configuration_of)
        self.columns = Columns(signals, Spectra.of(self.plate, signals), self.modes)
        self._measured = self.columns.measured()
        self._driven = DrivenPlates(signals, self.modes, self.plate)

    @property
    def observables(self) -> tuple[Observable, ...]:
        return self.columns.observables()

    def parts(self, kind: type[Effect]) -> dict[str, tuple[tuple[int, ...], tuple[str, ...]]]:
        """A value for each accelerometer, and of the plate itself for each band of its modes.

        Parameters:
            kind: The class of the effect.
        """
        if not issubclass(kind, PlateEffect):
            channels = self.signals.channels
            shows_acceleration = changes_reading(kind, "measured_acceleration_m_s2")
            return (
                {"channel": (tuple(range(len(channels))), channels)} if shows_acceleration else {}
            )
        sensors = self.plate.sensors
        owners = {"channel": (tuple(range(len(sensors))), sensors)}
        if self.modes.rows.size < _FEWEST_IN_BANDS:
            return owners
        low, high = self._band_edges_hz
        names = (
            f"modes up to {low:.4g} Hz",
            f"modes up to {high:.4g} Hz",
            f"modes above {high:.4g} Hz",
        )
        levels = np.searchsorted((low, high), self.plate.frequency_hz)
        return {**owners, "mode band": (tuple(levels.tolist()), names)}

    def part_of_observables(self, owner: str, names: Sequence[str]) -> Rows:
        """(d,): which accelerometer or band of modes each observable tells of; -1 for none.

        Parameters:
            owner: "channel" or "mode band".
            names: The names of its parts, as `parts` gives them.
        """
        if owner == "channel":
            place = {name: level for level, name in enumerate(names)}
            return np.array([place.get(item.channel, -1) for item in self.observables])
        frequency = np.array(
            [np.nan if o.frequency_hz is None else o.frequency_hz for o in self.observables]
        )
        return np.where(np.isfinite(frequency), np.searchsorted(self._band_edges_hz, frequency), -1)

    @cached_property
    def _band_edges_hz(self) -> Floats:
        """(2,): frequencies of compared modes that part them into three bands of as many modes."""
        return np.quantile(
            self.plate.frequency_hz[self.modes.rows], (1 / 3, 2 / 3), method="nearest"
        )

    def measured(self) -> Floats:
        return self._measured

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """Observables (R, d) that the records would show; NaN where a run has no force.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each
                mode or sensor of the plate.
            upstream: The true force on the plate of each run, N; by default the forces as read.
        """
        return self._observed(np.arange(len(self.record.runs)), effects, upstream)

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        """(k, C, d): by how much each of k sets of effects moves the nominal observables, at the
        run of median peak force of each configuration; NaN where it has none.

        Parameters:
            sets: The k sets of effects; effects of other stages in a set do nothing here. A
                parameter is one value or one for each mode or sensor of the plate.
        """
        runs, nominal = self.representative
        changes = np.full((len(sets), len(self.record.configurations), nominal.shape[1]), np.nan)
        configurations = self.record.configuration_of[runs]
        for k, effects in enumerate(sets):
            acting = self.acting(effects)
            changes[k, configurations] = self._observed(runs, acting) - nominal if acting else 0.0
        return changes

    @cached_property
    def representative(self) -> tuple[Rows, Floats]:
        """Runs of median peak force, one for each configuration that has any, and their nominal
        observables."""
        runs = self.median_runs(self.signals.peak_n)
        return runs[runs >= 0], self._observed(runs[runs >= 0], ())

    def records(self, effects: Sequence[Effect] = ()) -> Floats:
        """(R, S, n): simulated accelerations beside `signals.acceleration`; NaN where there is no
        force.

        Parameters:
            effects: Effects that act, by default none. A parameter is one value or one for each
                mode or sensor of the plate.
        """
        driven = self._driven.under(effects, np.arange(len(self.record.runs)))
        return _by_channel(sensor_chain(effects), driven.accelerations, self.signals.step_s)

    def _observed(
        self, runs: Rows, effects: Sequence[Effect], upstream: Upstream | None = None
    ) -> Floats:
        """(k, d): NaN where there is no force."""
        modes, signals = self.modes, self.signals
        forces = (
            None
            if upstream is None
            else self._compared(runs, cast(Sequence[Series | None], upstream))
        )
        driven, chain = (
            self._driven.under(effects, runs, forces),
            sensor_chain(effects, "measured_acceleration_m_s2"),
        )
        plate, poles = driven.plate, driven.poles
        sensed = _by_channel(chain, driven.accelerations, signals.step_s)
        frequency_hz, ratio = plate.frequency_hz[modes.rows], plate.damping_ratio[modes.rows]
        answered = np.where(np.isfinite(sensed[:, 0, :1]), 0.0, np.nan)
        frequency = np.log(frequency_hz) + answered
        damping = np.log(np.maximum(ratio, LEAST_RATIO)) + answered
        level = levels(plate, modes.rows, signals, runs, driven.ringing_transforms, chain)
        level = np.log(np.maximum(level, _LEAST_LEVEL))
        closed = sensor_chain(effects, "measured_amplitude")
        if modes.rows.size and len(closed.effects) < len(chain.effects):
            # what effects without a closed form add to the modes as they are read
            reading_closed = (
                driven.read(_by_channel(closed, driven.accelerations, signals.step_s))
                if closed.effects
                else driven.reading
            )
            reading = driven.read(sensed)
            frequency = frequency + reading.frequency - reading_closed.frequency
            damping = damping + reading.damping - reading_closed.damping
            level = level + reading.level - reading_closed.level
        angle = np.angle(driven.turn[:, None] * chain.transmissibility(poles))
        count, channels = len(runs), len(signals.channels)
        omega = np.broadcast_to(2 * np.pi * frequency_hz, (count, frequency_hz.size))
        delay_s = delays_s(
            np.broadcast_to(angle, (count, channels, frequency_hz.size)), omega, modes.weight
        )
        return self.columns.table(frequency, damping, level, sensed, delay_s)

    def _compared(self, runs: Rows, upstream: Sequence[Series | None]) -> Forces:
        """True forces on the plate, of runs whose accelerations are compared."""
        compared = np.isfinite(self.signals.first_s)
        return [upstream[run] if compared[run] else None for run in runs]


def _by_channel(chain: SensorChain, accelerations: Floats, step_s: float) -> Floats:
    """(k, S, n): what the channels show of accelerations; parameters of an effect are numbers, or
    (S,)."""
    if not chain.effects:
        return accelerations
    return np.swapaxes(
        chain.measured_acceleration_m_s2(np.swapaxes(accelerations, 0, 1), step_s), 0, 1
    )
