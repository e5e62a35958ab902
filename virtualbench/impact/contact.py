"""Force over indentation: elastic-plastic, of a finite tip, for many contacts at once.

Loading is that of Zhao, Maietta and Chang (J. Tribol. 122 (2000) 86) for a ball whose hardness is H:

- elastic, Hertz, up to the indentation d1 at which the mean pressure of the contact is 0.4 H;
- elastic-plastic, from d1 to d2 = 54 d1: the contact's area grows from Hertz's pi R d to the plastic 2 pi R d along a
  cubic in the indentation, and the mean pressure from 0.4 H to H along a straight line in its logarithm;
- plastic beyond: 2 pi R d H.

Unloading is elastic, with the contact's radius a that the loading left (Johnson, Contact Mechanics, 1985, section 6.4):
from the force F it springs back by 3 F / (4 E* a), as 3/2 power. A factor g of the indentation alone multiplies both:

- Dimitriadis et al., Biophys. J. 82 (2002) 2798, eq. 7: a bonded elastic layer of finite height is stiffer, as a
  polymer tip is against its holder; chi = sqrt(R d) / h. The figures are for an incompressible one;
- a tip that is no paraboloid: two terms of a power series, r^2 and r^4 of a worn tip, r^2 and r of a pointed one. Their
  contacts add up: a term c r^n gives the depth k c a^n and the force 2 E* n / (n + 1) k c a^(n + 1) at the contact's
  radius a, with k = 2, 8/3 and pi/2 for n = 2, 4 and 1 (Popov, Hess and Willert, Handbook of Contact Mechanics, 2019,
  section 2.5). The shares of the terms are such that the tip has the ball's height at the radius b = 0.32 R: worn
  (1 - w) r^2 / 2R + w r^4 / (2R b^2), pointed (1 - w) r^2 / 2R + w b r / 2R. A worn tip is stiffer as long as the
  indentation is shallow, a pointed one softer.

Since g does not depend on the path, an elastic contact loses nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...array_types import Floats

__all__ = ["FULLY_PLASTIC", "ONSET_SHARE", "TIP_REFERENCE", "ContactLaw"]

#: Mean pressure at which yield begins over the hardness, and d2 / d1.
ONSET_SHARE, FULLY_PLASTIC = 0.4, 54.0
#: b^2 / R^2.
TIP_REFERENCE = 0.1
_SMALLEST_M = 1e-12  # the factor g divides by the depth; here the force is none


@dataclass(frozen=True)
class ContactLaw:
    """Arrays are (contacts,). A hardness may be infinite, and so may a tip's height."""

    modulus_pa: Floats  # E*, of the pair
    radius_m: Floats
    hardness_pa: Floats  # of the softer of the two
    tip_height_m: Floats
    tip_share: Floats  # w of a worn tip; less than 0: -w of a pointed one

    @cached_property
    def stiffness(self) -> Floats:
        """Hertz's K = 4/3 E* sqrt(R), N / m^1.5."""
        return np.asarray(4 / 3 * self.modulus_pa * np.sqrt(self.radius_m))

    @cached_property
    def yield_m(self) -> Floats:
        """Indentation d1 at which yield begins: there Hertz's mean pressure is 0.4 of the hardness."""
        return np.asarray(self.radius_m * (3 * np.pi * ONSET_SHARE * self.hardness_pa / (4 * self.modulus_pa)) ** 2)

    @cached_property
    def plastic_slope(self) -> Floats:
        """Force over indentation (N/m) of the plastic contact; 0 where none yields."""
        finite = np.where(np.isfinite(self.hardness_pa), self.hardness_pa, 0.0)
        return np.asarray(2 * np.pi * finite * self.radius_m)

    def force(self, indentation_m: Floats, deepest_m: Floats) -> Floats:
        """Force (N), 0 without contact, when `deepest_m` is the deepest indentation so far."""
        top = np.maximum(indentation_m, deepest_m)
        hertz = self.stiffness * top * np.sqrt(top)
        yielding = top > self.yield_m
        depth = np.where(yielding, top / np.where(yielding, self.yield_m, 1.0), 1.0)
        transition = np.minimum((depth - 1) / (FULLY_PLASTIC - 1), 1.0)
        wider = 1 + transition**2 * (3 - 2 * transition)
        pressure = np.minimum(1 - (1 - ONSET_SHARE) * (1 - np.log(depth) / np.log(FULLY_PLASTIC)), 1.0)
        loading = np.where(yielding, self.plastic_slope / 2 * top * wider * pressure, hertz)
        # A Hertzian contact of this radius springs back by as much as it was pressed in: by 3 F / (4 E* a).
        spring_back = top * loading / np.maximum(hertz * np.sqrt(wider), np.finfo(np.float64).tiny)
        share = np.maximum(1 - (top - indentation_m) / np.maximum(spring_back, _SMALLEST_M), 0.0)
        force = loading * share * np.sqrt(share)
        return np.asarray(force * self.correction(indentation_m) if self._corrected else force)

    @cached_property
    def _corrected(self) -> bool:
        return bool(np.any(np.isfinite(self.tip_height_m) | (self.tip_share != 0)))

    def correction(self, indentation_m: Floats) -> Floats:
        """The factor g of finite height and of the tip's shape."""
        depth = np.maximum(indentation_m, _SMALLEST_M)
        chi = np.sqrt(self.radius_m * depth) / self.tip_height_m
        finite = 1 + chi * (1.133 + chi * (1.283 + chi * (0.769 + chi * 0.0975)))
        return np.asarray(finite * self._shape(depth / (TIP_REFERENCE * self.radius_m)))

    def _shape(self, depth: Floats) -> Floats:
        """Force over the ball's at depths in units of b^2 / R.

        From the contact's area in units of pi b^2 for a worn tip, from its radius in units of b for a pointed one.
        """
        worn, pointed = np.maximum(self.tip_share, 0.0), np.maximum(-self.tip_share, 0.0)
        area = 2 * depth / (1 - worn + np.sqrt((1 - worn) ** 2 + 16 / 3 * worn * depth))
        flatter = (area / depth) ** 1.5 * (1 - worn + 8 / 5 * worn * area)
        linear = np.pi / 4 * pointed
        radius = 2 * depth / (linear + np.sqrt(linear**2 + 4 * (1 - pointed) * depth))
        sharper = (1 - pointed + 3 / 4 * linear / radius) * (radius**2 / depth) ** 1.5
        return np.asarray(np.where(self.tip_share < 0, sharper, flatter))
