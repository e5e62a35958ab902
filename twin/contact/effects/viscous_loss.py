"""Hysteresis of tip or target: a force that grows with the rate of indentation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from ...effects import Value, parameter
from ..bodies import Floats
from ..damping import matched_damping, restitution_of
from ..effect import ContactEffect
from ..impacts import Impacts


@dataclass(frozen=True)
class ViscousLoss(ContactEffect):
    """chi is the material's: faster impacts lose more, e = 1 - (2/3) chi u for small losses (eq. 1.19)."""

    id: ClassVar[str] = "contact.viscous_loss"
    law: ClassVar[str] = "F = k delta^p (1 + chi x')"
    source: ClassVar[str] = "Hunt and Crossley, J. Appl. Mech. 42 (1975) 440; thesis, eq. 1.18 to 1.21"

    loss_s_m: Value = parameter("chi, loss for the rate of indentation", "s/m", default=0.1, low=0, high=50, off=0)

    @classmethod
    def of_restitution(cls, restitution: Value, impact_velocity_m_s: Value) -> Self:
        """The loss with which impacts of this velocity end with this restitution, in [0.01, 1]."""
        e, velocity = np.broadcast_arrays(np.atleast_1d(restitution), impact_velocity_m_s)
        return cls(matched_damping(np.asarray(e, dtype=np.float64)) / velocity)

    def restitution(self, impact_velocity_m_s: Floats) -> Floats:
        """With which impacts (n,) end where nothing else loses energy, whatever the exponent and the layer."""
        return restitution_of(np.asarray(self.loss_s_m * impact_velocity_m_s, dtype=np.float64))

    def prepare(self, impacts: Impacts) -> Impacts:
        return replace(impacts, rate_loss_s_m=impacts.rate_loss_s_m + self._each(self.loss_s_m, impacts))
