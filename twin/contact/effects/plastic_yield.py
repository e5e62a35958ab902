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
    """The softer body holds the pressure at a multiple of its yield strength; needs both yield
    strengths.

    1.6 is where a ball's contact begins to yield, below the surface; 2.8 is the mean pressure of
    full plasticity (Johnson, Contact Mechanics, 1985, ch. 6). Unloading is elastic, eq. 1.17.

    Beyond the indentation delta_y of the yield load F_y the force goes on as that of a material
    that hardens by r, `hardening_exponent`: F = F_y (1 + p ((delta / delta_y)^r - 1) / r), without
    a kink. 1 is its tangent, Thornton's law. p, 3/2 of a ball, is elastic, and a larger r acts as
    p. Far beyond, the force grows as delta^r, by Meyer's law as delta^(n / 2): his index n is 2 of
    what does not harden, and up to 2.5 of annealed metals (Tabor, The Hardness of Metals, 1951, ch.
    5). Less than 1 is a pressure that falls with the depth, as of a layer that is harder than what
    lies below. The largest force and indentation of the loading alone set the unloading.
    """

    id: ClassVar[str] = "contact.plastic_yield"
    law: ClassVar[str] = (
        "F = F_y (1 + p ((delta / delta_y)^r - 1) / r) beyond F_y = (pi "
        "p_y)^3 R^2 / (6 E*^2), back by eq. 1.17"
    )
    source: ClassVar[str] = (
        "Thornton, J. Appl. Mech. 64 (1997) 383, r = 1; hardening: Tabor, The Hardness of Metals "
        "(1951), on Meyer's law; thesis, eq. 1.17"
    )

    # from a tip softer than its sheet says to one that is hardened and has shaken down, and hardly
    # yields any more
    pressure_over_yield_strength: Value = parameter(
        "p_y over the lesser yield strength",
        "",
        default=1.6,
        low=0.3,
        high=1e6,
        off=1e6,
        likely=(0.3, 20),
        owner="tip",
    )
    # Meyer's law, fitted, has 1.05 to 1.2 for indices of 2.15 to 2.35. Not looked for by a
    # diagnosis: that takes a quarter more time where contacts yield, and predicts none of them
    # better.
    hardening_exponent: Value = parameter(
        "r, by which the force hardens beyond yield",
        "",
        default=1.0,
        low=0.2,
        high=1.5,
        off=1.0,
        owner="tip",
    )

    def prepare(self, impacts: Impacts) -> Impacts:
        load = yield_load(
            impacts.bodies, self._each(self.pressure_over_yield_strength, impacts), self.id
        )
        hardening = self._each(self.hardening_exponent, impacts)
        return replace(
            impacts,
            yield_load_n=np.minimum(impacts.yield_load_n, load),
            hardening_exponent=np.where(
                load < impacts.yield_load_n, hardening, impacts.hardening_exponent
            ),
        )
