"""What a bench's sensors showed of shots: what a twin learns from, and what its predictions are compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .setting import Setting
from .strikes import Floats


@dataclass(frozen=True, eq=False)
class MeasuredShots:
    """n shots; arrays are (n,), accelerations (n, sensors), spectra (n, sensors, lines), SI; NaN was not measured.

    `configuration` (n,) says which shots repeat each other: shots of one configuration are learned from, or left out,
    together. `settings` have a gun's tank pressure, or the velocity of a hammer before contact. `impact_velocity_m_s`
    is the measured velocity before contact, converted where it was obtained in another way, and
    `impact_velocity_u_m_s` its standard uncertainty. Spectra are maximax at `frequency_hz` (lines,) for quality `q`.
    Raises `ValueError` for arrays of other shapes.
    """

    settings: tuple[Setting, ...]
    configuration: NDArray[np.intp]
    impact_velocity_m_s: Floats
    impact_velocity_u_m_s: Floats
    contact_time_s: Floats
    peak_force_n: Floats
    impulse_n_s: Floats
    sensors: tuple[str, ...]
    peak_acceleration_m_s2: Floats
    frequency_hz: Floats
    q: float
    spectra_m_s2: Floats

    def __post_init__(self) -> None:
        n, sensors, lines = len(self.settings), len(self.sensors), self.frequency_hz.size
        shapes = {"peak_acceleration_m_s2": (n, sensors), "spectra_m_s2": (n, sensors, lines), "frequency_hz": (lines,)}
        for item in fields(self):
            values = getattr(self, item.name)
            expected = shapes.get(item.name, (n,))
            if isinstance(values, np.ndarray) and values.shape != expected:
                raise ValueError(f"{item.name} has shape {values.shape}: expected {expected}")

    def __len__(self) -> int:
        return len(self.settings)

    def take(self, rows: Sequence[int] | NDArray[np.intp]) -> Self:
        """Some of the shots, by their rows."""
        chosen = np.asarray(rows, dtype=np.intp)
        arrays = {
            item.name: getattr(self, item.name)[chosen]
            for item in fields(self)
            if isinstance(getattr(self, item.name), np.ndarray) and item.name != "frequency_hz"
        }
        return replace(self, settings=tuple(self.settings[row] for row in chosen), **arrays)

    def evenly(self, most: int) -> Self:
        """At most so many of the shots, evenly picked by their order."""
        return self.take(np.linspace(0, len(self) - 1, min(len(self), most)).round().astype(np.intp))

    def without(self, configurations: Sequence[int] | NDArray[np.intp]) -> Self:
        """The shots of all other configurations."""
        return self.take(np.flatnonzero(~np.isin(self.configuration, configurations)))
