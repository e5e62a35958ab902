"""The plate under the forces of some runs, up to what its sensors feel; what was asked for last is
kept.

Effects of accelerometers leave all of this as it is: sets of effects that differ in them alone
share it.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ....array_types import Complexes, Floats, Rows
from ....twin.effects import Effect
from ....twin.plate.modal import ModalPlate, PlateEffect, with_effects
from ....twin.plate.poles import Basis, poles_of
from ....twin.plate.response import PlateResponse, kept_below
from ..base import changes_reading
from .modes import LEAST_RATIO, MeasuredModes, Reading
from .signals import PlateSignals, on_clock, true_force
from .spectra import Forces, force_transforms

#: Modes that an effect lifts to here are dropped: above half the sampling rate there is no answer.
_MOST_OF_RATE = 0.499
#: Driven plates that are kept, some megabytes each, and answers to unit forces.
_MOST_KEPT, _MOST_RESPONSES = 8, 16


@dataclass(eq=False)
class DrivenPlate:
    """The `plate` in the `runs` (k,) of the record under the true `forces` (k,), None where there
    is none; and what its sensors feel, `accelerations` (k, S, n)."""

    signals: PlateSignals
    modes: MeasuredModes
    plate: ModalPlate
    runs: Rows
    forces: Forces
    accelerations: Floats

    @cached_property
    def poles(self) -> Complexes:
        """(K,): of the compared modes."""
        return poles_of(
            self.plate.frequency_hz[self.modes.rows], self.plate.damping_ratio[self.modes.rows]
        )

    @cached_property
    def transforms(self) -> Complexes:
        """(k, K): how much of each force acts on a mode, about the time when the force that was
        read acts."""
        return force_transforms(self.forces, self.poles, self.signals.centre_s[self.runs])

    @cached_property
    def ringing_transforms(self) -> Complexes:
        """(k, K): the same when ringing begins."""
        since_s = (
            self.signals.first_s[self.runs]
            + self.modes.window.start_s
            - self.signals.centre_s[self.runs]
        )
        return np.asarray(self.transforms * np.exp(np.outer(since_s, self.poles)))

    @cached_property
    def turn(self) -> Complexes:
        """(k, K): a number whose angle is by how much the phase of a mode differs from that under
        the force as read."""
        as_read = [self.signals.force[run] for run in self.runs]
        if all(force is reading for force, reading in zip(self.forces, as_read, strict=True)):
            return np.asarray(self.transforms * self.transforms.conj())
        read_transforms = force_transforms(as_read, self.poles, self.signals.centre_s[self.runs])
        return np.asarray(self.transforms * read_transforms.conj())

    @cached_property
    def reading(self) -> Reading:
        """The compared modes as they are read from what the sensors feel."""
        return self.read(self.accelerations)

    def read(self, shown: Floats) -> Reading:
        """The compared modes as they are read from what channels show (k, S, n)."""
        ringing = self.modes.window.cut(shown)
        rows = np.flatnonzero(np.isfinite(ringing[:, 0, 0]))
        reading = Reading.empty(len(shown), len(self.signals.channels), self._basis.poles.size)
        reading = reading.enter(rows, ringing, self._basis, noisy=False)
        return reading.of_lines(np.searchsorted(self.modes.ringing, self.modes.rows))

    @cached_property
    def _basis(self) -> Basis:
        window, rows = self.modes.window, self.modes.ringing
        poles = poles_of(
            self.plate.frequency_hz[rows], np.maximum(self.plate.damping_ratio[rows], LEAST_RATIO)
        )
        return Basis.of(poles, window.samples, window.step_s)


@dataclass(eq=False)
class DrivenPlates:
    """The nominal `plate` of a campaign as effects change it, and the forces that effects of their
    channel let through. What is kept goes by these effects alone."""

    signals: PlateSignals
    modes: MeasuredModes
    plate: ModalPlate
    _kept: dict[Hashable, DrivenPlate] = field(default_factory=dict)
    _responses: dict[Hashable, PlateResponse] = field(default_factory=dict)

    def under(
        self, effects: Sequence[Effect], runs: Rows, forces: Forces | None = None
    ) -> DrivenPlate:
        """In the `runs` (k,) of the record, under the forces that were read there, or under other
        true ones."""
        plate_effects = [effect for effect in effects if isinstance(effect, PlateEffect)]
        if forces is not None:
            return self._driven(plate_effects, runs, forces)
        channel = [
            effect for effect in effects if changes_reading(type(effect), "measured_force_n")
        ]
        key = runs.tobytes(), _key(plate_effects), _key(channel)
        driven = self._kept.pop(key, None)
        if driven is None:
            readings = (self.signals.force[run] for run in runs)
            true_forces = [reading and true_force(reading, channel) for reading in readings]
            driven = self._driven(plate_effects, runs, true_forces)
            driven.accelerations.flags.writeable = False
        self._kept[key] = driven  # the latest is the last
        if len(self._kept) > _MOST_KEPT:
            self._kept.pop(next(iter(self._kept)))
        return driven

    def _driven(self, effects: Sequence[PlateEffect], runs: Rows, forces: Forces) -> DrivenPlate:
        plate, signals = with_effects(self.plate, effects), self.signals
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
                driving = [
                    on_clock(force, first_s, signals.step_s, length) for _, force, first_s in driven
                ]
                rows = [row for row, _, _ in driven]
                accelerations[rows] = self._response(plate, effects, point).accelerations(
                    np.array(driving), workers=1
                )
        return DrivenPlate(signals, self.modes, plate, runs, forces, accelerations)

    def _response(
        self, plate: ModalPlate, effects: Sequence[PlateEffect], point: str
    ) -> PlateResponse:
        key, signals = (point, _key(effects)), self.signals
        response = self._responses.pop(key, None)
        if response is None:
            audible = kept_below(plate, _MOST_OF_RATE * signals.rate_hz)
            response = PlateResponse.of(
                audible, point, signals.channels, signals.step_s, signals.samples
            )
        self._responses[key] = response  # the latest is the last
        if len(self._responses) > _MOST_RESPONSES:
            self._responses.pop(next(iter(self._responses)))
        return response


def _key(effects: Sequence[Effect]) -> Hashable:
    """What tells effects and their parameters from others."""
    parameters = (
        [getattr(effect, item.name) for item in effect.parameters()] for effect in effects
    )
    contents = (
        tuple(np.asarray(value, dtype=np.float64).tobytes() for value in row) for row in parameters
    )
    return tuple(zip((effect.id for effect in effects), contents, strict=True))
