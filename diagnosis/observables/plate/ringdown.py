"""The plate without its force, or without known places on it: frequencies and damping ratios of
modes that ring down.

Neither depends on how hard the plate was hit, nor on where sensors stand (Ewins, Modal Testing, 2nd
ed. 2000, ch. 1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats, Rows
from ....twin.effects import Effect
from ....twin.plate.effects.sensor_mass import SensorMass
from ....twin.plate.modal import ModalPlate, PlateEffect, with_effects
from ....twin.plate.response import kept_below
from ....twin.plate.stage import PlateSpread
from ...record import CampaignRecord, RunConfiguration
from ..base import Observable, Stage, Upstream
from .modes import (
    CLEAR_DAMPING,
    HIGHEST,
    LEAST_RATIO,
    LOST,
    ModeLines,
    ModeSearch,
    best_modes,
    candidate_plates,
    median,
)
from .signals import ringdown_block
from .stage import mode_observables

_FIXED = "fixed"
#: A table was measured; a model with handbook elasticity and assumed damping agrees within what the
#: twin takes it for.
_SOLVED = (PlateSpread.frequency, PlateSpread.damping)


class PlateRingdownStage(Stage):
    """The modal table, or a solved model, whose modes are recognised by their frequencies alone.

    Raises `ValueError` for a record without a plate, and where none of its modes rings in the
    accelerations.
    """

    name = "plate"
    simulator = "plate:modal"

    def __init__(self, record: CampaignRecord) -> None:
        super().__init__(record)
        if record.plate is None:
            raise ValueError(
                f"campaign {record.name!r} has no plate: "
                f"its modes or its make stand in [bench.plate]"
            )
        used = np.array(
            [_is_modelled(record, record.configurations[run.configuration]) for run in record.runs]
        )
        if not used.any():
            raise ValueError(
                f"no run strikes the plate that was solved, {_make(record)} with free edges"
            )
        self.records = ringdown_block(record, used)
        self.plate: ModalPlate = kept_below(record.plate, HIGHEST * self.records.rate_hz)
        self._modes, self._measured = self._read()
        if not self._modes.size:
            raise ValueError("none of the plate's modes was found in the accelerations")
        self.assumptions = tuple(_assumed(record, used))

    @property
    def observables(self) -> tuple[Observable, ...]:
        window_s = self.records.window_s(0, self.records.samples)
        tolerance = () if self.record.plate_points_known else (_SOLVED,)
        return mode_observables(self.plate.frequency_hz[self._modes], window_s, *tolerance)

    def applies(self, kind: type[Effect]) -> bool:
        return issubclass(kind, PlateEffect) and (
            self.record.plate_points_known or not issubclass(kind, SensorMass)
        )

    def measured(self) -> Floats:
        return self._measured

    def simulated(self, effects: Sequence[Effect] = (), upstream: Upstream | None = None) -> Floats:  # noqa: ARG002
        return np.where(self._compared[:, None], self._simulated(effects), np.nan)

    def changes(self, sets: Sequence[Sequence[Effect]]) -> Floats:
        changes = np.full(
            (len(sets), len(self.record.configurations), 2 * self._modes.size), np.nan
        )
        compared = np.unique(self.record.configuration_of[self._compared])
        nominal = self._simulated(())
        for k, effects in enumerate(sets):
            changes[k, compared] = self._simulated(effects) - nominal
        return changes

    @property
    def _compared(self) -> NDArray[np.bool_]:
        """(R,): runs whose accelerations are compared."""
        return np.asarray(self.records.good.any(axis=1))

    def _simulated(self, effects: Sequence[Effect]) -> Floats:
        """(2 K,): logarithms of frequencies, then of damping ratios."""
        plate = with_effects(self.plate, self.acting(effects))
        ratio = np.maximum(plate.damping_ratio[self._modes], LEAST_RATIO)
        return np.asarray(np.log(np.concatenate([plate.frequency_hz[self._modes], ratio])))

    def _read(self) -> tuple[Rows, Floats]:
        """Rows in the table of K modes that ring clearly, and their measured observables (R, 2
        K)."""
        records, configuration = self.records, self.record.configuration_of
        if not np.any(self.plate.frequency_hz > 0):
            return np.zeros(0, dtype=np.intp), np.zeros((len(configuration), 0))
        peak = np.nan_to_num(np.abs(records.acceleration).max(axis=2)).max(axis=1)
        search = ModeSearch(self.plate, records, 0, configuration, peak)
        modes, reading = search.read(
            [ModeLines(plate.frequency_hz[search.modes]) for plate in candidate_plates(self.plate)]
        )
        loudness = np.max(np.nan_to_num(median(reading.level), nan=-np.inf), axis=0)
        best = best_modes(median(reading.damping_noise) < CLEAR_DAMPING, loudness)
        reading = reading.of_lines(best)
        values = np.concatenate([reading.frequency, reading.damping], axis=1)
        return modes[best], np.where(np.tile(reading.damping_noise < LOST, 2), values, np.nan)


def _is_modelled(record: CampaignRecord, configuration: RunConfiguration) -> bool:
    """Whether a configuration strikes the plate of the record. A table is taken for whatever was
    struck."""
    if record.plate_points_known:
        return True
    if configuration.factors.get("boundary_conditions") == _FIXED:
        return False
    material = record.plate_material_of(configuration)
    return (
        None in (material, record.plate_model_material) or material == record.plate_model_material
    )


def _make(record: CampaignRecord) -> str:
    return (
        f"{record.plate_thickness_m * 1e3:g} mm of "
        f"{record.plate_model_material or 'unknown material'}"
    )


def _assumed(record: CampaignRecord, used: NDArray[np.bool_]) -> list[str]:
    what = "modal frequencies and damping ratios are compared, amplitudes are not"
    sentences = []
    if not record.plate_points_known:
        sentences.append(
            f"plate: solved from its outline ({_make(record)}, free edges, one damping ratio for "
            f"all modes), which is taken to agree within {_SOLVED[0]:.0%} of a frequency and "
            f"{_SOLVED[1]:.0%} of a damping ratio; since nothing says where it was hit and where "
            f"its sensors stand, {what}: --bench FILE gives these places"
        )
    if not any(run.force is not None and run.accelerations for run in record.runs):
        sentences.append(
            f"plate: no force was recorded beside the accelerations: {what}, "
            f"and no sensor can be judged"
        )
    if left_out := int((~used).sum()):
        sentences.append(
            f"plate: {left_out} runs on a plate of another material or with "
            f"fixed edges have no part in it"
        )
    return sentences
