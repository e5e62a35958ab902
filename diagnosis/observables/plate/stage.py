"""The plate: from the force on it, as read, to the accelerations that the channels show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import Effect, catalogue
from ....twin.plate.effect import PlateEffect
from ....twin.plate.modal import ModalPlate
from ....twin.plate.respond import kept_below
from ....twin.sensors.effect import SensorEffect
from ...record import CampaignRecord, Floats, Series
from ..base import Observable, Stage, Upstream
from .candidate_plates import tried_plates
from .columns import Columns
from .force import acts_on_force, true_force
from .modes import measured_modes, of_table, searched_runs
from .points import impact_points
from .ringing import levels
from .signals import PlateSignals
from .simulation import Acting, Played, Simulation, acts_on_acceleration
from .spectra import Spectra
from .window import RingingWindow

#: Of a shape's usual size.
_NODE = 0.1
#: Of a plate with more modes the lowest are looked for: above, they lie closer than their own widths.
_MANY = 24
#: Modes from here on, in sampling rates, are left out: a record shows next to nothing of them.
_HIGHEST = 0.45
#: Ringing is looked for from below the lowest to above the highest mode, where mountings ring.
_BAND, _MOST_OF_RATE = (0.7, 2.0), 0.49


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
        self.signals = PlateSignals.of(record, record.plate)
        self.plate: ModalPlate = kept_below(record.plate, _HIGHEST * self.signals.rate_hz)
        if not np.any(self.plate.frequency_hz > 0):
            raise ValueError(
                f"campaign {record.name!r}: no mode of the plate lies below {_HIGHEST * self.signals.rate_hz:g} Hz, "
                "which is as high as its records reach"
            )
        points, told = impact_points(record, self.plate)
        self._reading = Played(
            self.signals.force, self.signals.force, points, self.signals.first_s, self.signals.centre_s
        )
        self.assumptions: tuple[str, ...] = (*told, *self.signals.assumptions, *self._dropped(record.plate))
        self.columns = self._columns()
        self._simulation = Simulation(self.plate, self.columns)
        self._measured = self._read()
        self._usual: tuple[NDArray[np.intp], Floats] | None = None

    @property
    def simulator(self) -> str:
        return "plate:modal"

    @property
    def observables(self) -> tuple[Observable, ...]:
        return self.columns.observables()

    @property
    def shows(self) -> tuple[str, ...]:
        return tuple(identity for identity, kind in catalogue().items() if acts_on_plate(kind))

    def measured(self) -> Floats:
        return self._measured

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        return self._simulation.observed(self._driven(effects, upstream), Acting.of(effects))

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:  # noqa: ARG002
        raise ValueError("the plate is the last stage: nothing takes what it gives")

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        rows, usual = self.usual()
        out = np.full((len(sets), len(self.record.configurations), usual.shape[1]), np.nan)
        of = self.record.configuration_of[rows]
        for k, effects in enumerate(sets):
            acting = [each for each in effects if acts_on_plate(type(each))]
            if not acting:
                out[k, of] = 0.0
                continue
            out[k, of] = self._simulation.observed(self._driven(acting).at(rows), Acting.of(acting)) - usual
        return out

    def usual(self) -> tuple[NDArray[np.intp], Floats]:
        """Runs of median peak force, one for each configuration that has any, and their nominal observables."""
        if self._usual is None:
            rows = _representative(self._reading.forces, self.record.configuration_of)
            self._usual = rows, self._simulation.observed(self._driven(()).at(rows), Acting.of(()))
        return self._usual

    def records(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:
        """(R, S, n): simulated accelerations beside `signals.acceleration`."""
        return self._simulation.accelerations(self._driven(effects, upstream), Acting.of(effects))

    def _driven(self, effects: Sequence[Effect], upstream: Upstream | None = None) -> Played:
        """The true forces on the plate."""
        if upstream is None:
            given: Sequence[Series | None] = [f and true_force(f, effects) for f in self._reading.forces]
        else:
            given = cast(Sequence[Series | None], upstream)
        known = np.isfinite(self._reading.first_s)
        forces = tuple(f if there else None for f, there in zip(given, known, strict=True))
        return replace(self._reading, forces=forces)

    def _columns(self) -> Columns:
        signals, of = self.signals, self.record.configuration_of
        samples = signals.acceleration.shape[2]
        band = searched_band(self.plate, signals.rate_hz)
        window = RingingWindow.of(signals.ringing, samples, signals.rate_hz, band[1])
        searched = self._reading.at(searched_runs(signals, of))
        at = searched.first_s + window.start_s
        every = np.flatnonzero((self.plate.frequency_hz > 0) & (self.plate.frequency_hz <= band[1]))
        tried = [
            (plate.frequency_hz[every], levels(plate, every, searched.points, signals.channels, searched.forces, at))
            for plate in tried_plates(self.plate)
        ]
        usual_damping = float(np.median(self.plate.damping_ratio[self.plate.frequency_hz > 0]))
        found = measured_modes(signals, window, of, tried, band, max(usual_damping, 1e-3))
        modes = of_table(found, every, self._nodes)
        spectra = Spectra.of(self.plate, signals.rate_hz, samples, signals.ringing)
        return Columns(signals, spectra, window, modes, self.plate.frequency_hz[modes.modes])

    @property
    def _nodes(self) -> NDArray[np.bool_]:
        """(S, m): where a sensor sits so near to a node that the table's shape there is no more than its error."""
        shapes = np.abs(self.plate.shapes[[self.plate.sensor(name) for name in self.signals.channels]])
        return np.asarray(shapes < _NODE * np.sqrt(np.mean(shapes**2, axis=1, keepdims=True)))

    def _read(self) -> Floats:
        modes, spectra, acceleration = self.columns.modes, self.columns.spectra, self.signals.acceleration
        lines_db, rests = spectra.levels_db(acceleration), spectra.rests(acceleration)
        return self.columns.laid(
            modes.frequency, modes.damping, modes.level, lines_db, rests, self.columns.told(modes.delay)
        )

    def _dropped(self, plate: ModalPlate) -> tuple[str, ...]:
        count = plate.frequency_hz.size - self.plate.frequency_hz.size
        limit = _HIGHEST * self.signals.rate_hz
        return (f"{count} modes of the plate above {limit:g} Hz are left out: records end there",) if count else ()


def searched_band(plate: ModalPlate, rate_hz: float) -> tuple[float, float]:
    """In which modes are looked for, Hz, in records of this sampling rate."""
    elastic = plate.frequency_hz[plate.frequency_hz > 0]
    highest = float(elastic.max()) * _BAND[1] if elastic.size <= _MANY else float(elastic[_MANY])
    return _BAND[0] * float(elastic.min()), min(highest, _MOST_OF_RATE * rate_hz)


def acts_on_plate(kind: type[Effect]) -> bool:
    """Whether an effect changes the accelerations that a bench shows for a force that it shows."""
    if issubclass(kind, SensorEffect):
        return acts_on_acceleration(kind) or acts_on_force(kind)
    return issubclass(kind, PlateEffect)


def _representative(forces: Sequence[Series | None], configuration: NDArray[np.intp]) -> NDArray[np.intp]:
    peak = np.array([np.nan if force is None else float(np.abs(force.values).max()) for force in forces])
    found = []
    for c in np.unique(configuration):
        mine = np.flatnonzero((configuration == c) & np.isfinite(peak))
        if mine.size:
            found.append(int(mine[np.argsort(peak[mine])[(mine.size - 1) // 2]]))
    return np.array(found, dtype=np.intp)
