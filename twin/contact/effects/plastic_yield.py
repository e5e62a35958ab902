"""Permanent indentation above a yield load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..hertz import yield_load
from ..impacts import ContactEffect, Impacts


@dataclass(frozen=True)
class PlasticYield(ContactEffect):
    """The softer body holds the pressure at a multiple of its yield strength; needs both yield strengths.

    1.6 is where a ball's contact begins to yield, below the surface; 2.8 is the mean pressure of full plasticity
    (Johnson, Contact Mechanics, 1985, ch. 6). Unloading is elastic, eq. 1.17.
    """

    id: ClassVar[str] = "contact.plastic_yield"
    law: ClassVar[str] = "dF/d delta constant beyond F_y = (pi p_y)^3 R^2 / (6 E*^2), back by eq. 1.17"
    source: ClassVar[str] = "Thornton, J. Appl. Mech. 64 (1997) 383; thesis, eq. 1.17"

    # from a tip softer than its sheet says to one that is hardened and has shaken down, and hardly yields any more
    pressure_over_yield_strength: Value = parameter(
        "p_y over the lesser yield strength", "", default=1.6, low=0.3, high=1e6, off=1e6, likely=(0.3, 20), owner="tip"
    )

    def prepare(self, impacts: Impacts) -> Impacts:
        load = yield_load(impacts.bodies, self._each(self.pressure_over_yield_strength, impacts), self.id)
        return replace(impacts, yield_load_n=np.minimum(impacts.yield_load_n, load))
