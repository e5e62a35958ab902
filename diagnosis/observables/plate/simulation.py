"""A plate's accelerations and what is read from them, for runs of a campaign under effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import Effect
from ....twin.plate.effect import PlateEffect, with_effects
from ....twin.plate.modal import ModalPlate
from ....twin.plate.respond import kept_below
from ....twin.plate.response import PlateResponse
from ....twin.sensors.chain import SensorChain
from ....twin.sensors.effect import SensorEffect
from ....twin.sensors.effects.acceleration_gain import AccelerationGain
from ....twin.sensors.effects.mount_resonance import MountResonance
from ...record import Floats, Series
from ..base import changes_reading
from .columns import Columns
from .force import on_clock
from .modes import Reading, read_simulated
from .poles import Basis, Poles
from .ringing import delays_s, levels, phases

#: Modes that an effect lifts to here are dropped: above half the sampling rate there is no answer.
_MOST_OF_RATE = 0.499
#: Below these a logarithm is taken of nothing.
_LEAST_RATIO, _LEAST_LEVEL = 1e-6, 1e-12
#: What these do to a mode's amplitude has a closed form.
_CLOSED = (AccelerationGain, MountResonance)


@dataclass(frozen=True, eq=False)
class SimulatedRuns:
    """Runs to be simulated: true forces, None where there is none, impact points, and when each run's clock begins.

    `read` are the forces as they were read, and `centre_s` is about when they act: delays are counted from them.
    """

    forces: tuple[Series | None, ...]
    read: tuple[Series | None, ...]
    points: tuple[str, ...]
    first_s: Floats
    centre_s: Floats

    def at(self, rows: NDArray[np.intp]) -> SimulatedRuns:
        forces, read = (tuple(values[row] for row in rows) for values in (self.forces, self.read))
        points = tuple(self.points[row] for row in rows)
        return SimulatedRuns(forces, read, points, self.first_s[rows], self.centre_s[rows])

    def same(self, runs: SimulatedRuns) -> bool:
        """Whether the same forces act at the same points."""
        return (
            len(self.forces) == len(runs.forces)
            and all(a is b for a, b in zip(self.forces, runs.forces, strict=True))
            and self.points == runs.points
            and np.array_equal(self.first_s, runs.first_s, equal_nan=True)
        )


@dataclass(frozen=True)
class ActiveEffects:
    """Effects sorted by what they act on: the plate, and what its accelerometers show. Parameters of the latter are
    numbers, or (S,) by channel."""

    on_plate: tuple[PlateEffect, ...]
    on_channels: tuple[SensorEffect, ...]

    @classmethod
    def of(cls, effects: Sequence[Effect]) -> ActiveEffects:
        sensors = (effect for effect in effects if isinstance(effect, SensorEffect))
        on_channels = tuple(item for item in sensors if changes_reading(type(item), "measured_acceleration_m_s2"))
        return cls(tuple(effect for effect in effects if isinstance(effect, PlateEffect)), on_channels)

    def shown(self, accelerations: Floats, step_s: float) -> Floats:
        """What the channels show of accelerations (R, S, n)."""
        by_channel = np.swapaxes(accelerations, 0, 1)  # arrays of parameters go with the first axis
        return np.swapaxes(SensorChain.of(self.on_channels).measured_acceleration_m_s2(by_channel, step_s), 0, 1)


class Simulation:
    """The nominal plate, read as `columns` say."""

    def __init__(self, nominal: ModalPlate, columns: Columns) -> None:
        self.nominal, self.columns = nominal, columns
        self._responses: dict[str, PlateResponse] = {}
        # the last runs on the nominal plate, its accelerations and their reading: effects of sensors leave them as is
        self._nominal_runs: tuple[SimulatedRuns, Floats] | None = None
        self._nominal_reading: Reading | None = None

    def observed(self, runs: SimulatedRuns, effects: ActiveEffects) -> Floats:
        """(R, d): observables of the plate under effects; NaN where there is no force."""
        plate = with_effects(self.nominal, effects.on_plate)
        signals, modes = self.columns.signals, self.columns.modes.modes
        accelerations = self._accelerations(plate, runs)
        shown = effects.shown(accelerations, signals.step_s)
        at = runs.first_s + self.columns.window.start_s
        level = levels(plate, modes, runs.points, signals.channels, runs.forces, at, effects.on_channels)
        simulated = np.where(np.isfinite(shown[:, 0, :1]), 0.0, np.nan)
        frequency = np.log(plate.frequency_hz[modes]) + simulated
        damping = np.log(np.maximum(plate.damping_ratio[modes], _LEAST_RATIO)) + simulated
        level = np.log(np.maximum(level, _LEAST_LEVEL))
        if modes.size and not all(isinstance(effect, _CLOSED) for effect in effects.on_channels):
            change = self._read_changes(plate, accelerations, shown, effects)
            frequency, damping, level = frequency + change[0], damping + change[1], level + change[2]
        spectra = self.columns.spectra
        delay = self._delays(plate, runs, effects)
        return self.columns.table(frequency, damping, level, spectra.levels_db(shown), spectra.rests(shown), delay)

    def accelerations(self, runs: SimulatedRuns, effects: ActiveEffects) -> Floats:
        """(R, S, n) as the channels show them; NaN where there is no force."""
        accelerations = self._accelerations(with_effects(self.nominal, effects.on_plate), runs)
        return effects.shown(accelerations, self.columns.signals.step_s)

    def _accelerations(self, plate: ModalPlate, runs: SimulatedRuns) -> Floats:
        """(R, S, n): what the sensors feel."""
        nominal = plate is self.nominal
        if nominal and self._nominal_runs is not None and self._nominal_runs[0].same(runs):
            return self._nominal_runs[1]
        signals = self.columns.signals
        samples = signals.acceleration.shape[2]
        accelerations = np.full((len(runs.forces), len(signals.channels), samples), np.nan)
        for point in sorted(set(runs.points)):
            rows = [r for r, force in enumerate(runs.forces) if force is not None and runs.points[r] == point]
            if rows:
                driving = _driving(runs.at(np.array(rows)), signals.step_s, samples)
                accelerations[rows] = self._response(plate, point).accelerations(driving)
        if nominal:
            accelerations.flags.writeable = False
            self._nominal_runs, self._nominal_reading = (runs, accelerations), None
        return accelerations

    def _response(self, plate: ModalPlate, point: str) -> PlateResponse:
        if plate is self.nominal and point in self._responses:
            return self._responses[point]
        signals = self.columns.signals
        audible = kept_below(plate, _MOST_OF_RATE * signals.rate_hz)
        samples = signals.acceleration.shape[2]
        response = PlateResponse.of(audible, point, signals.channels, signals.step_s, samples)
        if plate is self.nominal:
            self._responses[point] = response
        return response

    def _delays(self, plate: ModalPlate, runs: SimulatedRuns, effects: ActiveEffects) -> Floats:
        """(R, S)."""
        modes, channels = self.columns.modes, len(self.columns.signals.channels)
        frequency, damping = plate.frequency_hz[modes.modes], plate.damping_ratio[modes.modes]
        angle = phases(frequency, damping, runs.forces, runs.centre_s, effects.on_channels)
        angle = angle - phases(frequency, damping, runs.read, runs.centre_s)
        omega = np.broadcast_to(2 * np.pi * frequency, (len(angle), frequency.size))
        return delays_s(np.broadcast_to(angle, (len(angle), channels, frequency.size)), omega, modes.weight)

    def _read_changes(
        self, plate: ModalPlate, accelerations: Floats, shown: Floats, effects: ActiveEffects
    ) -> list[Floats]:
        """What effects without a closed form add to frequency, damping and level of the compared modes, as read."""
        modes = self.columns.modes
        closed = ActiveEffects((), tuple(effect for effect in effects.on_channels if isinstance(effect, _CLOSED)))
        plain = closed.shown(accelerations, self.columns.signals.step_s)
        basis = self._nominal_basis if plate is self.nominal else self._basis(plate)
        after, before = self._reading(basis, shown), self._reading(basis, plain)
        lines = np.searchsorted(modes.ringing, modes.modes)
        names = ("frequency", "damping", "level")
        return [getattr(after, name)[..., lines] - getattr(before, name)[..., lines] for name in names]

    def _reading(self, basis: Basis, shown: Floats) -> Reading:
        """That of the accelerations of the nominal plate is kept with them."""
        nominal = self._nominal_runs is not None and shown is self._nominal_runs[1]
        if nominal and self._nominal_reading is not None:
            return self._nominal_reading
        reading = read_simulated(basis, self.columns.window.cut(shown))
        if nominal:
            self._nominal_reading = reading
        return reading

    def _basis(self, plate: ModalPlate) -> Basis:
        window, rows = self.columns.window, self.columns.modes.ringing
        poles = Poles.of(plate.frequency_hz[rows], np.maximum(plate.damping_ratio[rows], _LEAST_RATIO))
        return Basis.of(poles, window.samples, window.step_s)

    @cached_property
    def _nominal_basis(self) -> Basis:
        return self._basis(self.nominal)


def _driving(runs: SimulatedRuns, step_s: float, samples: int) -> Floats:
    """(R, p): the forces up to the last force of any run, all of which have one."""
    forces = [(force, first) for force, first in zip(runs.forces, runs.first_s, strict=True) if force is not None]
    last = max(force.time_s[-1] - first for force, first in forces)
    length = int(np.clip(np.ceil(last / step_s) + 2, 2, samples))
    return np.array([on_clock(force, first, step_s, length) for force, first in forces])
