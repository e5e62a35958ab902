"""The plate: from the force on it, as read, to the accelerations that the channels show."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import ClassVar, cast

import numpy as np

from ....twin.effects import Effect
from ....twin.plate.effect import PlateEffect
from ....twin.plate.modal import ModalPlate
from ....twin.plate.respond import kept_below
from ...record import CampaignRecord, Floats, Series
from ..base import Observable, Stage, Upstream
from .columns import Columns
from .force import true_force
from .match import Rows
from .modes import HIGHEST, measured_modes
from .ringing import Forces
from .signals import PlateSignals
from .simulation import Simulation
from .spectra import Spectra


class PlateStage(Stage):
    """The modal table, or a solved model, driven by the measured force at the impact point of each run.

    Raises `ValueError` for a record without a plate, without a run that has a force and an acceleration at one of its
    sensors, and for an impact position that the plate has not.
    """

    name: ClassVar[str] = "plate"
    effect_kind = PlateEffect
    sensor_hooks = ("measured_force_n", "measured_acceleration_m_s2")

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
        self.assumptions = signals.assumptions
        if dropped := record.plate.frequency_hz.size - self.plate.frequency_hz.size:
            note = f"{dropped} modes of the plate above {limit_hz:g} Hz are left out: records end there"
            self.assumptions = (*self.assumptions, note)
        modes = measured_modes(self.plate, signals, record.configuration_of)
        self.columns = Columns(signals, Spectra.of(self.plate, signals), modes)
        self._simulation = Simulation(self.plate, self.columns)
        self._measured = self.columns.measured()

    @property
    def simulator(self) -> str:
        return "plate:modal"

    @property
    def observables(self) -> tuple[Observable, ...]:
        return self.columns.observables()

    def measured(self) -> Floats:
        return self._measured

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        return self._observed(np.arange(len(self.record.runs)), effects, upstream)

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        runs, nominal = self.representative
        changes = np.full((len(sets), len(self.record.configurations), nominal.shape[1]), np.nan)
        configurations = self.record.configuration_of[runs]
        for k, effects in enumerate(sets):
            acting = self.acting(effects)
            changes[k, configurations] = self._observed(runs, acting) - nominal if acting else 0.0
        return changes

    @cached_property
    def representative(self) -> tuple[Rows, Floats]:
        """Runs of median peak force, one for each configuration that has any, and their nominal observables."""
        rows = self.median_runs(self.signals.peak_n)
        return rows[rows >= 0], self._observed(rows[rows >= 0], ())

    def _observed(self, runs: Rows, effects: Sequence[Effect], upstream: Upstream | None = None) -> Floats:
        return self._simulation.observed(runs, self._forces(runs, effects, upstream), effects)

    def records(self, effects: Sequence[Effect] = ()) -> Floats:
        """(R, S, n): simulated accelerations beside `signals.acceleration`."""
        runs = np.arange(len(self.record.runs))
        return self._simulation.accelerations(runs, self._forces(runs, effects), effects)

    def _forces(self, runs: Rows, effects: Sequence[Effect], upstream: Upstream | None = None) -> Forces:
        """The true forces (k,) on the plate in the runs (k,), None where there is no acceleration."""
        if upstream is not None:
            given, known = cast(Sequence[Series | None], upstream), np.isfinite(self.signals.first_s)
            return [given[run] if known[run] else None for run in runs]
        read = [self.signals.force[run] for run in runs]
        return [force and true_force(force, effects) for force in read]
