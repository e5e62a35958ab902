"""The stage of the contact where it meets the plate's: strikes to pulses, contact law and modes
solved together."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ..array_types import Floats
from .contact.coupled import COUPLED_PHASES, ImpactSolver, PlatePoint, coupled_impact
from .contact.impact import trimmed
from .contact.impacts import Impacts, impedance
from .contact_interface import (
    AboveAnvil,
    Extrapolation,
    ExtrapolationPolicy,
    ForcePulses,
    ImpactBatch,
    OutOfDomain,
)
from .plate.modal import ModalPlate
from .plate.stage import PlateStage
from .setting import Setting

#: Steps of each contact's own time, and cycles in it above which a mode follows at once: errors of
#: 1e-4.
_STEPS, _CYCLES = 24, 4.0


class SolvableContact(Protocol):
    """A contact stage that is solved from the quantities of its impacts."""

    @property
    def label(self) -> str: ...

    @property
    def normals(self) -> int: ...

    def pulses_on_plate(
        self, solver: ImpactSolver, strikes: ImpactBatch, z: Floats | None = None
    ) -> ForcePulses:
        """As `pulses`, by `solver` in place of the motion on a rigid target and without the plate's
        own compliance."""
        ...

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]: ...


@dataclass(frozen=True, eq=False)
class CoupledContact:
    """A `ContactStage` that solves the law of `base` against the modes of each setting's plate at
    its impact position.

    The plate's modes stand in place of the effect `contact.plate_compliance`, which would count the
    plate twice; beyond the last mode the plate is that without edges, of the plate's material and
    thickness. A free plate whose table lists no rigid mode moves as a rigid body of its mass. Of an
    ensemble of plates the nominal one acts on the force: modes that are wrong by 1 % change it by
    less than they change the accelerations. The prior's impacts on an anvil are solved as without
    the plate's modes: there the anvil on its joint stands between contact and plate.
    """

    base: SolvableContact
    plate: PlateStage
    _points: dict[tuple[object, ...], PlatePoint] = field(
        default_factory=dict, init=False, repr=False
    )

    @property
    def label(self) -> str:
        return f"{self.base.label} + modes of the plate"

    @property
    def normals(self) -> int:
        return self.base.normals

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        """Force at 129 phases, from the first touch to the last parting.

        Raises `LookupError` for a plate or an impact position there is none of, and as `base`.
        """
        points = list(map(self._point, strikes.settings, impedance(strikes).tolist()))
        return self.base.pulses_on_plate(
            lambda impacts, rows: _pulses(impacts, [points[row] for row in rows]), strikes, z
        )

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        """What lies outside of the base's domain."""
        return self.base.outside(strikes)

    def plate_pulses(
        self, strikes: ImpactBatch, z: Floats | None, pulses: ForcePulses
    ) -> ForcePulses:
        """What of `pulses` acts on the plate, where the base tells it apart."""
        return (
            self.base.plate_pulses(strikes, z, pulses)
            if isinstance(self.base, AboveAnvil)
            else pulses
        )

    def extrapolation(self, strikes: ImpactBatch) -> list[tuple[Extrapolation, ...]]:
        """What lies beyond the shots that the base has learned from."""
        if isinstance(self.base, ExtrapolationPolicy):
            return self.base.extrapolation(strikes)
        return [() for _ in range(len(strikes))]

    def _point(self, setting: Setting, impedance_n_s_m: float) -> PlatePoint:
        free = setting.boundary_conditions == "free"
        key = (
            setting.plate.name,
            setting.impact_position,
            impedance_n_s_m,
            setting.plate_mass_kg if free else None,
        )
        if key not in self._points:
            plate = self.plate.ensemble(setting.plate.name)[0]
            mass = setting.plate_mass_kg if free else math.inf
            self._points[key] = point_of_plate(
                plate, setting.impact_position, impedance_n_s_m, mass
            )
        return self._points[key]


def point_of_plate(
    plate: ModalPlate, name: str, impedance_n_s_m: float, free_mass_kg: float = math.inf
) -> PlatePoint:
    """An impact point of a plate, whose point impedance without edges is given.

    `free_mass_kg` is the mass of a plate that nothing holds, infinite for a plate that is held.
    Where no mode of it is slower than Z / (4 M) a rigid one is added: the lowest elastic mode of a
    free plate of area A is faster than 2 sqrt(D / (rho h)) / A = Z / (4 M) unless the plate is ten
    times as long as wide. Raises `LookupError` as `point`.
    """
    frequency, damping = plate.frequency_hz, plate.damping_ratio
    shape = plate.shape_impact[plate.point(name)]
    slowest = 2 * np.pi * float(frequency.min(initial=math.inf))
    if free_mass_kg < math.inf and slowest > impedance_n_s_m / (4 * free_mass_kg):
        frequency, damping = np.append(0.0, frequency), np.append(0.0, damping)
        shape = np.append(1 / math.sqrt(free_mass_kg), shape)
    return PlatePoint(frequency, damping, shape, impedance_n_s_m)


def _pulses(impacts: Impacts, points: list[PlatePoint]) -> ForcePulses:
    """With the impulse of the motion, to rounding."""
    solved = coupled_impact(impacts, points, steps=_STEPS, cycles=_CYCLES)
    pulses = trimmed(solved, COUPLED_PHASES)
    share = solved.impulse_n_s / pulses.impulse_n_s
    return ForcePulses(
        pulses.contact_time_s, pulses.force_n * share[:, None], pulses.compression_time_s
    )
