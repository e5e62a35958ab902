"""The plate without its force, or without known places on it: frequencies and damping ratios of modes that ring down.

Neither depends on how hard the plate was hit, nor on where sensors stand (Ewins, Modal Testing, 2nd ed. 2000, ch. 1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ....twin.effects import Effect, catalogue
from ....twin.plate.effect import PlateEffect, with_effects
from ....twin.plate.effects.sensor_mass import SensorMass
from ....twin.plate.modal import ModalPlate
from ....twin.plate.respond import kept_below
from ....twin.plates import PlateSpread
from ...record import CampaignRecord, Configuration, Floats
from ..base import Observable, Stage, Upstream
from .candidate_plates import tried_plates
from .columns import mode_observables
from .match import Lines, matched
from .modes import best_modes
from .poles import Basis
from .records import RingdownRecords
from .runs import median, read_runs, scaled
from .search import found_poles
from .stage import acts_on_plate, searched_band
from .window import RingingWindow

#: Runs that modes are searched in, and the lines that may ring: more than modes, those of mountings and clamps.
_SEARCHED, _MORE_LINES, _MOST_LINES = 8, 10, 40
#: A mode is compared where noise moves ln damping by less than the first in the median; in a run by the second.
_CLEAR_DAMPING, _LOST = 0.15, 0.1
#: A record with fewer samples shows no modes; below this a damping ratio is none.
_FEWEST_SAMPLES, _LEAST_RATIO = 40, 1e-6
_FIXED = "fixed"
#: A table was measured; a model with handbook elasticity and assumed damping agrees within what the twin takes it for.
_SOLVED = (PlateSpread.frequency, PlateSpread.damping)

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RingdownModes:
    """Of K modes: `modes` (K,) their rows in the table; natural logarithms of frequency and damping ratio (R, K)."""

    modes: Rows
    frequency: Floats
    damping: Floats


class PlateRingdownStage(Stage):
    """The modal table, or a solved model, whose modes are recognised by their frequencies alone.

    Raises `ValueError` for a record without a plate, and where none of its modes rings in the accelerations.
    """

    name: ClassVar[str] = "plate"

    def __init__(self, record: CampaignRecord) -> None:
        super().__init__(record)
        if record.plate is None:
            raise ValueError(f"campaign {record.name!r} has no plate: its modes or its make stand in [bench.plate]")
        used = np.array([_is_modelled(record, record.configurations[run.configuration]) for run in record.runs])
        if not used.any():
            raise ValueError(f"no run strikes the plate that was solved, {_make(record)} with free edges")
        self.records = RingdownRecords.of(record, used)
        self.plate: ModalPlate = kept_below(record.plate, 0.45 * self.records.rate_hz)
        self._modes = self._read()
        if not self._modes.modes.size:
            raise ValueError("none of the plate's modes was found in the accelerations")
        self.assumptions: tuple[str, ...] = tuple(_assumed(record, used))

    @property
    def simulator(self) -> str:
        return "plate:modal"

    @property
    def observables(self) -> tuple[Observable, ...]:
        frequency, window = self.plate.frequency_hz[self._modes.modes], self.records.window_s
        if self.record.plate_points_known:
            return mode_observables(frequency, window)
        return mode_observables(frequency, window, _SOLVED)

    @property
    def shows(self) -> tuple[str, ...]:
        return tuple(identity for identity, kind in catalogue().items() if self._moves_modes(kind))

    def measured(self) -> Floats:
        return np.concatenate([self._modes.frequency, self._modes.damping], axis=1)

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:  # noqa: ARG002
        values = self._simulated(effects)
        return np.where(self._rung[:, None], values, np.nan)

    def output(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Upstream:  # noqa: ARG002
        raise ValueError("the plate is the last stage: nothing takes what it gives")

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        out = np.full((len(sets), len(self.record.configurations), 2 * self._modes.modes.size), np.nan)
        rung = np.unique(self.record.configuration_of[self._rung])
        nominal = self._simulated(())
        for k, effects in enumerate(sets):
            out[k, rung] = self._simulated(effects) - nominal
        return out

    @property
    def _rung(self) -> NDArray[np.bool_]:
        """(R,): runs whose accelerations are compared."""
        return np.asarray(self.records.good.any(axis=1))

    def _moves_modes(self, kind: type[Effect]) -> bool:
        if not (acts_on_plate(kind) and issubclass(kind, PlateEffect)):
            return False
        return self.record.plate_points_known or not issubclass(kind, SensorMass)

    def _simulated(self, effects: Sequence[Effect]) -> Floats:
        """(2 K,): logarithms of frequencies, then of damping ratios."""
        plate = with_effects(self.plate, [each for each in effects if isinstance(each, PlateEffect)])
        modes = self._modes.modes
        ratio = np.maximum(plate.damping_ratio[modes], _LEAST_RATIO)
        return np.concatenate([np.log(plate.frequency_hz[modes]), np.log(ratio)])

    def _read(self) -> RingdownModes:
        records, of = self.records, self.record.configuration_of
        runs = records.acceleration.shape[0]
        nothing = RingdownModes(np.zeros(0, dtype=np.intp), np.zeros((runs, 0)), np.zeros((runs, 0)))
        if not np.any(self.plate.frequency_hz > 0):
            return nothing
        band = searched_band(self.plate, records.rate_hz)
        window = RingingWindow.of(0, records.acceleration.shape[2], records.rate_hz, band[1])
        ringing = window.cut(records.acceleration)
        if ringing.shape[2] < _FEWEST_SAMPLES:
            return nothing
        elastic = self.plate.frequency_hz > 0
        every = np.flatnonzero(elastic & (self.plate.frequency_hz <= band[1]))
        guess = max(float(np.median(self.plate.damping_ratio[elastic])), 1e-3)
        searched = scaled(ringing[self._loudest(of)])
        poles = found_poles(searched, window.step_s, band, guess, min(_MOST_LINES, every.size + _MORE_LINES))
        if not poles.omega.size:
            return nothing
        level = np.abs(Basis.of(poles, searched.shape[0], window.step_s).amplitudes(searched))
        tried = [Lines(plate.frequency_hz[every], np.ones((every.size, 1))) for plate in tried_plates(self.plate)]
        named = matched(Lines(poles.frequency_hz, level), tried, patterns=False)
        known = np.flatnonzero(named >= 0)
        reading = read_runs(ringing, of, poles, window.step_s).of_lines(named[known])
        loud = np.max(np.nan_to_num(median(reading.level, axis=0), nan=-np.inf), axis=0)
        chosen = best_modes(np.flatnonzero(median(reading.damping_noise, axis=0) < _CLEAR_DAMPING), loud)
        picked = reading.of_lines(chosen)
        heard = picked.damping_noise < _LOST
        return RingdownModes(
            every[known[chosen]],
            np.where(heard, picked.frequency, np.nan),
            np.where(heard, picked.damping, np.nan),
        )

    def _loudest(self, configuration: Rows) -> Rows:
        """The loudest run of each of some configurations."""
        peak = np.nan_to_num(np.abs(self.records.acceleration).max(axis=2)).max(axis=1)
        best = [int(np.argmax(np.where(configuration == c, peak, -1.0))) for c in np.unique(configuration)]
        rows = np.array([row for row in best if peak[row] > 0], dtype=np.intp)
        return rows[np.linspace(0, rows.size - 1, min(_SEARCHED, rows.size)).round().astype(np.intp)]


def _is_modelled(record: CampaignRecord, configuration: Configuration) -> bool:
    """Whether a configuration strikes the plate of the record. A table is taken for whatever was struck."""
    if record.plate_points_known:
        return True
    if configuration.factors.get("boundary_conditions") == _FIXED:
        return False
    material = record.plate_material_of(configuration)
    return None in (material, record.plate_model_material) or material == record.plate_model_material


def _make(record: CampaignRecord) -> str:
    return f"{record.plate_thickness_m * 1e3:g} mm of {record.plate_model_material or 'unknown material'}"


def _assumed(record: CampaignRecord, used: NDArray[np.bool_]) -> list[str]:
    what = "modal frequencies and damping ratios are compared, amplitudes are not"
    found = []
    if not record.plate_points_known:
        found.append(
            f"plate: solved from its outline ({_make(record)}, free edges, one damping ratio for all modes), which is "
            f"taken to agree within {_SOLVED[0]:.0%} of a frequency and {_SOLVED[1]:.0%} of a damping ratio; since "
            f"nothing says where it was hit and where its sensors stand, {what}: --bench FILE gives these places"
        )
    if not any(run.force is not None and run.accelerations for run in record.runs):
        found.append(f"plate: no force was recorded beside the accelerations: {what}, and no sensor can be judged")
    left_out = int((~used).sum())
    if left_out:
        found.append(f"plate: {left_out} runs on a plate of another material or with fixed edges have no part in it")
    return found
