"""What a bench's sensors showed of shots: what a twin learns from, and what its predictions are
compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .contact_interface import ForcePulses
from .sensors.measured_pulses import MeasuredForce
from .setting import Setting


@dataclass(frozen=True, eq=False)
class MeasuredShots:
    """n shots; arrays are (n,), accelerations (n, sensors), spectra (n, sensors, lines), SI; NaN
    was not measured.

    `configuration` (n,) says which shots repeat each other: shots of one configuration are learned
    from, or left out, together. `settings` have a gun's tank pressure, or the velocity of a hammer
    before contact. `impact_velocity_m_s` is the measured velocity before contact, converted where
    it was obtained in another way, and `impact_velocity_u_m_s` its standard uncertainty. Spectra
    are maximax at `frequency_hz` (lines,) for quality `q`.

    A shot whose mass or velocity is not known is predicted from its measured force on.
    `given_force_n` (n, phases) is that force at equal phases of the contact, both ends 0, and NaN
    for all other shots (None: no shot has any). Such a shot has NaN as its velocity, and its
    setting has mass and velocity of the impact that Hertz' law needs for the force: they tell the
    calibration which forces are alike, and no contact is solved with them. Raises `ValueError` for
    arrays of other shapes.
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
    given_force_n: Floats | None = None

    def __post_init__(self) -> None:
        n, sensors, lines = len(self.settings), len(self.sensors), self.frequency_hz.size
        shapes = {
            "peak_acceleration_m_s2": (n, sensors),
            "spectra_m_s2": (n, sensors, lines),
            "frequency_hz": (lines,),
        }
        if self.given_force_n is not None:
            shapes["given_force_n"] = (n, *self.given_force_n.shape[1:2])
        for item in fields(self):
            values = getattr(self, item.name)
            expected = shapes.get(item.name, (n,))
            if isinstance(values, np.ndarray) and values.shape != expected:
                raise ValueError(f"{item.name} has shape {values.shape}: expected {expected}")

    def __len__(self) -> int:
        return len(self.settings)

    @property
    def force_is_given(self) -> NDArray[np.bool_]:
        """Which shots (n,) are predicted from their measured force."""
        if self.given_force_n is None:
            return np.zeros(len(self), dtype=np.bool_)
        return np.asarray(np.isfinite(self.given_force_n).all(axis=1))

    def given_force(self, row: int) -> MeasuredForce | None:
        """The measured force that a shot is predicted from; None where it is predicted from its
        setting."""
        if self.given_force_n is None or not self.force_is_given[row]:
            return None
        force = self.given_force_n[row]
        return MeasuredForce(force[1:-1], (force.size - 1) / float(self.contact_time_s[row]))

    def given_pulses(self, rows: NDArray[np.intp]) -> ForcePulses:
        """The measured forces of shots that are predicted from them, (rows,). Raises `ValueError`
        for others."""
        forces = [force for row in rows.tolist() if (force := self.given_force(row)) is not None]
        if len(forces) != len(rows):
            raise ValueError(
                f"{len(rows) - len(forces)} of {len(rows)} shots are not predicted from their force"
            )
        pulses = [force.repeated(1) for force in forces]
        return ForcePulses(
            *(
                np.concatenate([getattr(pulse, item.name) for pulse in pulses])
                for item in fields(ForcePulses)
            )
        )

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
        return self.take(
            np.linspace(0, len(self) - 1, min(len(self), most)).round().astype(np.intp)
        )

    def without(self, configurations: Sequence[int] | NDArray[np.intp]) -> Self:
        """The shots of all other configurations."""
        return self.take(np.flatnonzero(~np.isin(self.configuration, configurations)))
