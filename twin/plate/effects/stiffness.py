"""A stiffness or thickness error: all frequencies scale."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ...effects import parameter
from ..modal import ModalPlate, PlateEffect


@dataclass(frozen=True)
class Stiffness(PlateEffect):
    """Young's modulus off by a share e gives about 1 + e / 2, a thickness at the same mass 1 + 3 e
    / 2."""

    # Handbook moduli scatter by 5 %, rolled sheet is 5 % off its thickness at worst: together below
    # 10 %.
    frequency_factor: float = parameter(
        "every frequency times this",
        "",
        default=1.02,
        low=0.5,
        high=2.0,
        off=1.0,
        likely=(0.9, 1.1),
        owner="plate",
    )

    id = "plate.stiffness"
    law = "f' = frequency_factor * f, K' = frequency_factor^2 K"
    source = "Leissa, Vibration of Plates, NASA SP-160 (1969), ch. 1: omega^2 goes with D / (rho h)"

    def changed(self, plate: ModalPlate) -> ModalPlate:
        return replace(plate, frequency_hz=self.frequency_factor * plate.frequency_hz)
