"""The plate: from the force on it, as read, to the accelerations that the channels show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import ClassVar, cast

import numpy as np

from ....twin.effects import Effect, catalogue
from ....twin.plate.effect import PlateEffect
from ....twin.plate.modal import ModalPlate
from ....twin.plate.respond import kept_below
from ...record import CampaignRecord, Floats, Series
from ..base import Observable, Stage, Upstream, changes_reading
from .columns import Columns
from .force import true_force
from .match import Rows, candidate_plates
from .modes import HIGHEST, ModeSearch, measured_modes, searched_runs
from .ringing import levels
from .signals import PlateSignals, impact_points
from .simulation import ActiveEffects, SimulatedRuns, Simulation
from .spectra import RingingWindow, Spectra

#: Of a shape's usual size.
_NODE = 0.1
#: With fewer compared modes there are no bands of them that could differ.
_FEWEST_IN_BANDS = 6


class PlateStage(Stage):
    """The modal table, or a solved model, driven by the measured force at the impact point of each run.

    Raises `ValueError` for a record without a plate, without a run that has a force and an acceleration at one of its
    sensors, and for an impact position that the plate has not.
    """

    name: ClassVar[str] = "plate"

    def __init__(self, record: CampaignRecord) -> None:
        super().__init__(record)
        if record.plate is None:
            raise ValueError(f"campaign {record.name!r} has no plate: its modes or its make stand in [bench.plate]")
        self.signals = signals = PlateSignals.of_record(record, record.plate)
        limit_hz = HIGHEST * signals.rate_hz
        self.plate: ModalPlate = kept_below(record.plate, limit_hz)
        if not np.any(self.plate.frequency_hz > 0):
            raise ValueError(
                f"campaign {record.name!r}: no mode of the plate lies below {limit_hz:g} Hz, "
                "which is as high as its records reach"
            )
        points, notes = impact_points(record, self.plate)
        self._runs = SimulatedRuns(signals.force, signals.force, points, signals.first_s, signals.centre_s)
        self.assumptions = (*notes, *signals.assumptions)
        if dropped := record.plate.frequency_hz.size - self.plate.frequency_hz.size:
            note = f"{dropped} modes of the plate above {limit_hz:g} Hz are left out: records end there"
            self.assumptions = (*self.assumptions, note)
        self.columns = self._columns()
        self._simulation = Simulation(self.plate, self.columns)
        self._measured = self.columns.measured()

    @property
    def simulator(self) -> str:
        return "plate:modal"

    @property
    def observables(self) -> tuple[Observable, ...]:
        return self.columns.observables()

    @property
    def shows(self) -> tuple[str, ...]:
        return tuple(identity for identity, kind in catalogue().items() if acts_on_plate(kind))

    def parts(self, kind: type[Effect]) -> dict[str, tuple[tuple[int, ...], tuple[str, ...]]]:
        """A value for each accelerometer, and of the plate itself for each band of its modes."""
        if not issubclass(kind, PlateEffect):
            channels = self.signals.channels
            shows_acceleration = changes_reading(kind, "measured_acceleration_m_s2")
            return {"channel": (tuple(range(len(channels))), channels)} if shows_acceleration else {}
        sensors = self.plate.sensors
        owners = {"channel": (tuple(range(len(sensors))), sensors)}
        compared_hz = self.columns.frequency_hz
        if compared_hz.size < _FEWEST_IN_BANDS:
            return owners
        low, high = self._band_edges_hz
        names = (f"modes up to {low:.4g} Hz", f"modes up to {high:.4g} Hz", f"modes above {high:.4g} Hz")
        levels = np.searchsorted((low, high), self.plate.frequency_hz)
        return {**owners, "mode band": (tuple(levels.tolist()), names)}

    def part_of_observables(self, owner: str, names: Sequence[str]) -> Rows:
        if owner == "channel":
            place = {name: level for level, name in enumerate(names)}
            return np.array([place.get(item.channel, -1) for item in self.observables])
        frequency = np.array([np.nan if o.frequency_hz is None else o.frequency_hz for o in self.observables])
        return np.where(np.isfinite(frequency), np.searchsorted(self._band_edges_hz, frequency), -1)

    @cached_property
    def _band_edges_hz(self) -> Floats:
        """(2,): frequencies of compared modes that part them into three bands of as many modes."""
        return np.quantile(self.columns.frequency_hz, (1 / 3, 2 / 3), method="nearest")

    def measured(self) -> Floats:
        return self._measured

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        return self._simulation.observed(self._driven(effects, upstream), ActiveEffects.of(effects))

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        rows, nominal = self.representative
        changes = np.full((len(sets), len(self.record.configurations), nominal.shape[1]), np.nan)
        configurations = self.record.configuration_of[rows]
        for k, effects in enumerate(sets):
            acting = [effect for effect in effects if acts_on_plate(type(effect))]
            changes[k, configurations] = self._observed_at(rows, acting) - nominal if acting else 0.0
        return changes

    @cached_property
    def representative(self) -> tuple[Rows, Floats]:
        """Runs of median peak force, one for each configuration that has any, and their nominal observables."""
        rows = self.median_runs(peaks(self._runs.forces))
        return rows[rows >= 0], self._observed_at(rows[rows >= 0], ())

    def _observed_at(self, rows: Rows, effects: Sequence[Effect]) -> Floats:
        return self._simulation.observed(self._driven(effects).at(rows), ActiveEffects.of(effects))

    def records(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """(R, S, n): simulated accelerations beside `signals.acceleration`."""
        return self._simulation.accelerations(self._driven(effects, upstream), ActiveEffects.of(effects))

    def _driven(self, effects: Sequence[Effect], upstream: Upstream | None = None) -> SimulatedRuns:
        """The true forces on the plate."""
        if upstream is None:
            given: Sequence[Series | None] = [f and true_force(f, effects) for f in self._runs.forces]
        else:
            given = cast(Sequence[Series | None], upstream)
        known = np.isfinite(self._runs.first_s)
        forces = tuple(force if use else None for force, use in zip(given, known, strict=True))
        return replace(self._runs, forces=forces)

    def _columns(self) -> Columns:
        signals, configuration = self.signals, self.record.configuration_of
        samples = signals.acceleration.shape[2]
        search = ModeSearch.of(self.plate, signals.rate_hz)
        window = RingingWindow.of(signals.ringing, samples, signals.rate_hz, search.band_hz[1])
        searched = searched_runs(
            np.where(signals.good.all(axis=1), np.nan_to_num(peaks(signals.force)), 0.0), configuration
        )
        runs = self._runs.at(searched)
        at = runs.first_s + window.start_s
        candidates = [
            (
                plate.frequency_hz[search.modes],
                levels(plate, search.modes, runs.points, signals.channels, runs.forces, at),
            )
            for plate in candidate_plates(self.plate)
        ]
        shapes = np.abs(self.plate.shapes[[self.plate.sensor(name) for name in signals.channels]])
        # so near to a node the table's shape is no more than its error
        nodes = np.asarray(shapes < _NODE * np.sqrt(np.mean(shapes**2, axis=1, keepdims=True)))
        modes = measured_modes(signals, window, search, searched, configuration, candidates, nodes)
        spectra = Spectra.of(self.plate, signals.rate_hz, samples, signals.ringing)
        return Columns(signals, spectra, window, modes, self.plate.frequency_hz[modes.modes])


def peaks(forces: Sequence[Series | None]) -> Floats:
    """(R,): the largest magnitude of each force; NaN without a force."""
    return np.array([np.nan if force is None else float(np.abs(force.values).max()) for force in forces])


def acts_on_plate(kind: type[Effect]) -> bool:
    """Whether an effect changes the accelerations that a bench shows for a force that it shows."""
    return issubclass(kind, PlateEffect) or changes_reading(kind, "measured_force_n", "measured_acceleration_m_s2")
