"""A tip that is not a ball: worn, flat or pointed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..impacts import ContactEffect, Impacts


@dataclass(frozen=True)
class TipGeometry(ContactEffect):
    """F = k delta^(3/2) (delta / d)^(p - 3/2): another exponent, and at the indentation d the
    ball's own force.

    1 is a flat punch, 3/2 a ball, 2 a cone; a worn tip lies between 1 and 3/2. Below d an exponent
    less than 3/2 is stiffer than the ball, above softer.
    """

    id: ClassVar[str] = "contact.tip_geometry"
    law: ClassVar[str] = "F = k d^(3/2 - p) delta^p"
    source: ClassVar[str] = "Sneddon, Int. J. Eng. Sci. 3 (1965) 47; thesis, eq. 1.16"

    # from a flat punch to a little beyond a cone; d from a scratch on a metal tip to the depth of a
    # soft one
    exponent: Value = parameter(
        "p of F = k delta^p", "", default=1.2, low=1, high=3, off=1.5, likely=(1, 2.2), owner="tip"
    )
    reference_indentation_m: Value = parameter(
        "d, where the ball's force is kept",
        "m",
        default=1e-4,
        low=1e-7,
        high=0.01,
        off=1e-4,
        likely=(1e-5, 5e-3),
        owner="tip",
    )

    def prepare(self, impacts: Impacts) -> Impacts:
        exponent, reference = (
            self._each(value, impacts) for value in (self.exponent, self.reference_indentation_m)
        )
        stiffness = impacts.stiffness_n_mp * reference ** (impacts.exponent - exponent)
        return replace(impacts, exponent=exponent, stiffness_n_mp=np.asarray(stiffness))
