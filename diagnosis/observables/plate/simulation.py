"""A plate's accelerations and what is read from them, for runs of a campaign under effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ....twin.effects import Effect
from ....twin.plate.effect import PlateEffect, with_effects
from ....twin.plate.modal import ModalPlate
from ....twin.plate.respond import kept_below
from ....twin.plate.response import PlateResponse
from ....twin.sensors.effects.acceleration_gain import AccelerationGain
from ....twin.sensors.effects.mount_resonance import MountResonance
from ...record import Floats
from ..base import sensor_chain
from .columns import Columns
from .force import on_clock
from .match import Rows
from .modes import Reading
from .poles import Basis, poles_of
from .ringing import Forces, delays_s, levels, phases

#: Modes that an effect lifts to here are dropped: above half the sampling rate there is no answer.
_MOST_OF_RATE = 0.499
#: Below these a logarithm is taken of nothing.
LEAST_RATIO, _LEAST_LEVEL = 1e-6, 1e-12
#: What these do to a mode's amplitude has a closed form.
_CLOSED = (AccelerationGain, MountResonance)


@dataclass(eq=False)
class _NominalRuns:
    """Accelerations of the nominal plate, which effects of sensors leave as they are, and their reading."""

    runs: Rows
    forces: Forces
    accelerations: Floats  # (k, S, n)
    reading: Reading | None = None

    def of(self, runs: Rows, forces: Forces) -> bool:
        return np.array_equal(self.runs, runs) and all(a is b for a, b in zip(self.forces, forces, strict=True))


class Simulation:
    """The nominal plate, read as `columns` say.

    Under true `forces` (k,), None where there is none, in the place of those of the `runs` (k,) of the record.
    """

    def __init__(self, nominal: ModalPlate, columns: Columns) -> None:
        self.nominal, self.columns, self._signals = nominal, columns, columns.signals
        self._responses: dict[str, PlateResponse] = {}
        self._latest: _NominalRuns | None = None

    def observed(self, runs: Rows, forces: Forces, effects: Sequence[Effect]) -> Floats:
        """(k, d): observables of the plate under effects; NaN where there is no force."""
        modes, signals = self.columns.modes, self._signals
        plate = plate_under(self.nominal, effects)
        chain = sensor_chain(effects, "measured_acceleration_m_s2")
        felt = self._accelerations(plate, runs, forces)
        shown = chain.measured_acceleration_m_s2(felt, signals.step_s)
        answered = np.where(np.isfinite(shown[:, 0, :1]), 0.0, np.nan)
        level = levels(plate, modes.rows, signals, runs, forces, modes.window.start_s, chain.effects)
        reading = [
            np.log(plate.frequency_hz[modes.rows]) + answered,
            np.log(np.maximum(plate.damping_ratio[modes.rows], LEAST_RATIO)) + answered,
            np.log(np.maximum(level, _LEAST_LEVEL)),
        ]
        if modes.rows.size and not all(isinstance(effect, _CLOSED) for effect in chain.effects):
            # what effects without a closed form add to the modes as they are read
            closed = sensor_chain(effect for effect in chain.effects if isinstance(effect, _CLOSED))
            basis = self._nominal_basis if plate is self.nominal else self._basis(plate)
            before = self._read(basis, closed.measured_acceleration_m_s2(felt, signals.step_s))
            after = self._read(basis, shown)
            reading = [value + b - a for value, a, b in zip(reading, before, after, strict=True)]
        poles = poles_of(plate.frequency_hz[modes.rows], plate.damping_ratio[modes.rows])
        centre_s = signals.centre_s[runs]
        angle = phases(poles, forces, centre_s, chain.effects)
        angle = angle - phases(poles, [signals.force[run] for run in runs], centre_s)
        omega = np.broadcast_to(2 * np.pi * plate.frequency_hz[modes.rows], angle.shape)
        delay_s = delays_s(np.repeat(angle[:, None], len(signals.channels), axis=1), omega, modes.weight)
        return self.columns.table(*reading, shown, delay_s)

    def accelerations(self, runs: Rows, forces: Forces, effects: Sequence[Effect]) -> Floats:
        """(k, S, n) as the channels show them; NaN where there is no force."""
        felt = self._accelerations(plate_under(self.nominal, effects), runs, forces)
        return sensor_chain(effects).measured_acceleration_m_s2(felt, self._signals.step_s)

    def _accelerations(self, plate: ModalPlate, runs: Rows, forces: Forces) -> Floats:
        """(k, S, n): what the sensors feel."""
        if plate is self.nominal and self._latest is not None and self._latest.of(runs, forces):
            return self._latest.accelerations
        signals = self._signals
        accelerations = np.full((len(forces), len(signals.channels), signals.samples), np.nan)
        for point in sorted(set(signals.points)):
            driven = [
                (row, force, float(signals.first_s[run]))
                for row, (run, force) in enumerate(zip(runs, forces, strict=True))
                if force is not None and signals.points[run] == point
            ]
            if driven:
                last_s = max(force.time_s[-1] - first_s for _, force, first_s in driven)
                length = int(np.clip(np.ceil(last_s / signals.step_s) + 2, 2, signals.samples))
                driving = [on_clock(force, first_s, signals.step_s, length) for _, force, first_s in driven]
                rows = [row for row, _, _ in driven]
                accelerations[rows] = self._response(plate, point).accelerations(np.array(driving))
        if plate is self.nominal:
            accelerations.flags.writeable = False
            self._latest = _NominalRuns(runs, forces, accelerations)
        return accelerations

    def _response(self, plate: ModalPlate, point: str) -> PlateResponse:
        if plate is self.nominal and point in self._responses:
            return self._responses[point]
        signals = self._signals
        audible = kept_below(plate, _MOST_OF_RATE * signals.rate_hz)
        response = PlateResponse.of(audible, point, signals.channels, signals.step_s, signals.samples)
        if plate is self.nominal:
            self._responses[point] = response
        return response

    def _read(self, basis: Basis, shown: Floats) -> tuple[Floats, Floats, Floats]:
        """ln frequency, damping and level of the compared modes as they are read; those of nominal runs are kept."""
        latest = self._latest if self._latest is not None and shown is self._latest.accelerations else None
        reading = latest and latest.reading
        if reading is None:
            modes, ringing = self.columns.modes, self.columns.modes.window.cut(shown)
            runs = np.flatnonzero(np.isfinite(ringing[:, 0, 0]))
            reading = Reading.empty(*ringing.shape[:2], basis.poles.size).enter(runs, ringing, basis, noisy=False)
            reading = reading.of_lines(np.searchsorted(modes.ringing, modes.rows))
            if latest is not None:
                latest.reading = reading
        return reading.frequency, reading.damping, reading.level

    def _basis(self, plate: ModalPlate) -> Basis:
        window, rows = self.columns.modes.window, self.columns.modes.ringing
        poles = poles_of(plate.frequency_hz[rows], np.maximum(plate.damping_ratio[rows], LEAST_RATIO))
        return Basis.of(poles, window.samples, window.step_s)

    @cached_property
    def _nominal_basis(self) -> Basis:
        return self._basis(self.nominal)


def plate_under(nominal: ModalPlate, effects: Sequence[Effect]) -> ModalPlate:
    """The plate as those of the effects that are its own change it."""
    return with_effects(nominal, [effect for effect in effects if isinstance(effect, PlateEffect)])
