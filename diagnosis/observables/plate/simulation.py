"""A plate's accelerations and what is read from them, for runs of a campaign under effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
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
from .columns import Columns
from .delay import delays_s
from .force import on_clock
from .poles import Basis, Poles
from .ringing import levels, phases
from .runs import Reading, read_simulated

#: Modes that an effect lifts to here are dropped: above half the sampling rate there is no answer.
_MOST_OF_RATE = 0.499
#: Below these a logarithm is taken of nothing.
_LEAST_RATIO, _LEAST_LEVEL = 1e-6, 1e-12
#: What these do to a mode's amplitude has a closed form.
_CLOSED = (AccelerationGain, MountResonance)


@dataclass(frozen=True, eq=False)
class Played:
    """Runs to be played: true forces, None where there is none, the impact points, and when each run's clock begins.

    `read` are the forces as they were read, and `centre_s` is about when they act: delays are counted from them.
    """

    forces: tuple[Series | None, ...]
    read: tuple[Series | None, ...]
    points: tuple[str, ...]
    first_s: Floats
    centre_s: Floats

    def at(self, rows: NDArray[np.intp]) -> Played:
        picked = [int(row) for row in rows]
        forces, read = (tuple(each[row] for row in picked) for each in (self.forces, self.read))
        points = tuple(self.points[row] for row in picked)
        return Played(forces, read, points, self.first_s[picked], self.centre_s[picked])

    def same(self, other: Played) -> bool:
        """Whether the same forces act at the same points."""
        return (
            len(self.forces) == len(other.forces)
            and all(one is two for one, two in zip(self.forces, other.forces, strict=True))
            and self.points == other.points
            and np.array_equal(self.first_s, other.first_s, equal_nan=True)
        )


@dataclass(frozen=True)
class Acting:
    """Effects sorted by what they act on: the plate, and what its accelerometers show."""

    on_plate: tuple[PlateEffect, ...]
    on_channels: tuple[SensorEffect, ...]

    @classmethod
    def of(cls, effects: Sequence[Effect]) -> Acting:
        return cls(
            tuple(each for each in effects if isinstance(each, PlateEffect)),
            tuple(each for each in effects if isinstance(each, SensorEffect) and acts_on_acceleration(type(each))),
        )

    @property
    def open(self) -> bool:
        """Whether a mode's amplitude has to be read from the simulated record."""
        return any(not isinstance(each, _CLOSED) for each in self.on_channels)


@dataclass(frozen=True, eq=False)
class Simulation:
    """The nominal plate, read as `columns` say."""

    nominal: ModalPlate
    columns: Columns
    _responses: dict[str, PlateResponse] = field(default_factory=dict, init=False, repr=False)
    # of the last runs that the nominal plate was asked for: effects of sensors leave what it feels as it is
    _felt_before: dict[str, tuple[Played, Floats]] = field(default_factory=dict, init=False, repr=False)
    _plain: dict[str, tuple[Floats, Reading]] = field(default_factory=dict, init=False, repr=False)

    def observed(self, played: Played, acting: Acting) -> Floats:
        """(R, d): observables of the plate under effects; NaN where there is no force."""
        plate = with_effects(self.nominal, acting.on_plate)
        signals, modes = self.columns.signals, self.columns.modes.modes
        felt = self._felt(plate, played)
        shown = SensorChain.of(acting.on_channels).measured_acceleration_m_s2(felt, signals.step_s)
        at = played.first_s + self.columns.window.start_s
        level = levels(plate, modes, played.points, signals.channels, played.forces, at, acting.on_channels)
        there = np.where(np.isfinite(shown[:, 0, :1]), 0.0, np.nan)
        frequency = np.log(plate.frequency_hz[modes]) + there
        damping = np.log(np.maximum(plate.damping_ratio[modes], _LEAST_RATIO)) + there
        level = np.log(np.maximum(level, _LEAST_LEVEL))
        if acting.open and modes.size:
            more = self._read_off(plate, felt, shown, acting)
            frequency, damping, level = frequency + more[0], damping + more[1], level + more[2]
        spectra = self.columns.spectra
        delay = self._delays(plate, played, acting)
        return self.columns.laid(frequency, damping, level, spectra.levels_db(shown), spectra.rests(shown), delay)

    def accelerations(self, played: Played, acting: Acting) -> Floats:
        """(R, S, n) as the channels show them; NaN where there is no force."""
        felt = self._felt(with_effects(self.nominal, acting.on_plate), played)
        return SensorChain.of(acting.on_channels).measured_acceleration_m_s2(felt, self.columns.signals.step_s)

    def _felt(self, plate: ModalPlate, played: Played) -> Floats:
        known = self._felt_before.get("felt") if plate is self.nominal else None
        if known is not None and known[0].same(played):
            return known[1]
        signals = self.columns.signals
        samples = signals.acceleration.shape[2]
        out = np.full((len(played.forces), len(signals.channels), samples), np.nan)
        for point in sorted(set(played.points)):
            rows = [r for r, force in enumerate(played.forces) if force is not None and played.points[r] == point]
            if rows:
                response = self._response(plate, point)
                out[rows] = response.accelerations(_driving(played.at(np.array(rows)), signals.step_s, samples))
        if plate is self.nominal:
            out.flags.writeable = False
            self._felt_before["felt"] = played, out
        return out

    def _response(self, plate: ModalPlate, point: str) -> PlateResponse:
        signals = self.columns.signals
        if plate is self.nominal and point in self._responses:
            return self._responses[point]
        kept = kept_below(plate, _MOST_OF_RATE * signals.rate_hz)
        samples = signals.acceleration.shape[2]
        found = PlateResponse.of(kept, point, signals.channels, signals.step_s, samples)
        if plate is self.nominal:
            self._responses[point] = found
        return found

    def _delays(self, plate: ModalPlate, played: Played, acting: Acting) -> Floats:
        """(R, S)."""
        modes, channels = self.columns.modes, len(self.columns.signals.channels)
        frequency, damping = plate.frequency_hz[modes.modes], plate.damping_ratio[modes.modes]
        angle = phases(frequency, damping, played.forces, played.centre_s, acting.on_channels)
        angle = angle - phases(frequency, damping, played.read, played.centre_s)
        omega = np.broadcast_to(2 * np.pi * frequency, angle.shape)
        return delays_s(np.repeat(angle[:, None], channels, axis=1), omega, modes.weight)

    def _read_off(
        self, plate: ModalPlate, felt: Floats, shown: Floats, acting: Acting
    ) -> tuple[Floats, Floats, Floats]:
        """What effects without a closed form add to the readings of the compared modes."""
        signals, modes = self.columns.signals, self.columns.modes
        closed = SensorChain.of(each for each in acting.on_channels if isinstance(each, _CLOSED))
        plain = closed.measured_acceleration_m_s2(felt, signals.step_s)
        basis = self._nominal_basis if plate is self.nominal else self._basis(plate)
        after, before = self._reading(basis, shown), self._plain_reading(basis, plain)
        at = np.searchsorted(modes.ringing, modes.modes)
        pairs = zip((after.frequency, after.damping, after.level), (before.frequency, before.damping, before.level),
                    strict=True)  # fmt: skip
        frequency, damping, level = (one[..., at] - other[..., at] for one, other in pairs)
        return frequency, damping, level

    def _reading(self, basis: Basis, shown: Floats) -> Reading:
        return read_simulated(basis, self.columns.window.cut(shown))

    def _plain_reading(self, basis: Basis, plain: Floats) -> Reading:
        """Kept for accelerations that are kept themselves."""
        known = self._plain.get("felt")
        if known is not None and known[0] is plain:
            return known[1]
        found = self._reading(basis, plain)
        if "felt" in self._felt_before and self._felt_before["felt"][1] is plain:
            self._plain["felt"] = plain, found
        return found

    def _basis(self, plate: ModalPlate) -> Basis:
        window, rows = self.columns.window, self.columns.modes.ringing
        poles = Poles.of(plate.frequency_hz[rows], np.maximum(plate.damping_ratio[rows], _LEAST_RATIO))
        return Basis.of(poles, window.samples, window.step_s)

    @cached_property
    def _nominal_basis(self) -> Basis:
        return self._basis(self.nominal)


def acts_on_acceleration(kind: type[Effect]) -> bool:
    """Whether an effect changes what an accelerometer's channel shows."""
    if not issubclass(kind, SensorEffect):
        return False
    return kind.measured_acceleration_m_s2 is not SensorEffect.measured_acceleration_m_s2


def _driving(played: Played, step_s: float, samples: int) -> Floats:
    """(R, p) up to the last force of any run."""
    given = [force for force in played.forces if force is not None]
    ends = [f.time_s[-1] - first for f, first in zip(given, played.first_s, strict=True)]
    room = int(np.clip(np.ceil(max(ends) / step_s) + 2, 2, samples))
    return np.array([on_clock(f, first, step_s, room) for f, first in zip(given, played.first_s, strict=True)])
