"""What an effect of the gun may do."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..effects import Effect
from .shot import ShotInputs


@dataclass(frozen=True, eq=False)
class Instant:
    """n shots at one instant of each, as hooks see them; pressures absolute, gas behind the projectile.

    All (n,), or (m, n) for m instants of each: hooks reckon element by element.
    """

    time_s: Floats
    position_m: Floats
    velocity_m_s: Floats  # not negative
    gas_pressure_pa: Floats
    gas_temperature_k: Floats
    gas_density_kg_m3: Floats


@dataclass(frozen=True)
class GunEffect(Effect):
    """An effect of the gun. It overrides one of the hooks; each does nothing by default.

    `prepare` fills the fields of `ShotInputs`; most effects need no more. A law that no field can express overrides
    `resistance_n` or `leak_kg_s`; shots with such an effect take longer, as a hook is no part of the compiled motion.
    """

    #: Whether the motion must be integrated, as the closed form does not know what the effect changes. True for every
    #: effect with `resistance_n` or `leak_kg_s`.
    moves: ClassVar[bool] = False

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        """The shot with other quantities. The result must not hang on the order of effects."""
        return shot

    def resistance_n(self, shot: ShotInputs, instant: Instant) -> Floats | float:  # noqa: ARG002
        """A force against the motion, not negative; 0 at rest."""
        return 0.0

    def leak_kg_s(self, shot: ShotInputs, instant: Instant) -> Floats | float:  # noqa: ARG002
        """Gas that escapes from behind the projectile; negative where it comes in."""
        return 0.0

    @classmethod
    def has_hooks(cls) -> bool:
        """Whether `resistance_n` or `leak_kg_s` is there."""
        return cls.resistance_n is not GunEffect.resistance_n or cls.leak_kg_s is not GunEffect.leak_kg_s

    def off(self, shots: int) -> NDArray[np.bool_]:
        """(n,): where every parameter has the value at which the effect does nothing."""
        result = np.ones(shots, dtype=bool)
        for item in self.parameters():
            result &= np.asarray(getattr(self, item.name)) == item.off
        return result

    def take(self, rows: NDArray[np.intp]) -> Self:
        """The effect on some of the shots."""
        values = {item.name: np.asarray(getattr(self, item.name)) for item in self.parameters()}
        return replace(self, **{name: value[rows] for name, value in values.items() if value.ndim})
