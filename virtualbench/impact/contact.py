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
- a worn tip has a smaller exponent, g = (d / d0)^(n - 3/2), with d0 a tenth of the radius: stiffer as long as the
  indentation is shallow.

Since g does not depend on the path, an elastic contact loses nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

__all__ = ["FULLY_PLASTIC", "ONSET_SHARE", "WORN_REFERENCE", "ContactLaw"]

#: Mean pressure at which yield begins over the hardness, and d2 / d1.
ONSET_SHARE, FULLY_PLASTIC = 0.4, 54.0
WORN_REFERENCE = 0.1
_SMALLEST_M = 1e-12  # a negative power of zero is not finite; here the force is none


@dataclass(frozen=True)
class ContactLaw:
    """Arrays are (contacts,). A hardness may be infinite, and so may a tip's height."""

    modulus_pa: Floats  # E*, of the pair
    radius_m: Floats
    hardness_pa: Floats  # of the softer of the two
    tip_height_m: Floats
    exponent_shift: Floats

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
        way = np.minimum((depth - 1) / (FULLY_PLASTIC - 1), 1.0)
        wider = 1 + way**2 * (3 - 2 * way)
        pressure = np.minimum(1 - (1 - ONSET_SHARE) * (1 - np.log(depth) / np.log(FULLY_PLASTIC)), 1.0)
        loading = np.where(yielding, self.plastic_slope / 2 * top * wider * pressure, hertz)
        # A Hertzian contact of this radius springs back by as much as it was pressed in: by 3 F / (4 E* a).
        spring_back = top * loading / np.maximum(hertz * np.sqrt(wider), np.finfo(np.float64).tiny)
        share = np.maximum(1 - (top - indentation_m) / np.maximum(spring_back, _SMALLEST_M), 0.0)
        force = loading * share * np.sqrt(share)
        return np.asarray(force * self.correction(indentation_m) if self._corrected else force)

    @cached_property
    def _corrected(self) -> bool:
        return bool(np.any(np.isfinite(self.tip_height_m) | (self.exponent_shift != 0)))

    def correction(self, indentation_m: Floats) -> Floats:
        """The factor g of finite height and worn shape."""
        depth = np.maximum(indentation_m, _SMALLEST_M)
        chi = np.sqrt(self.radius_m * depth) / self.tip_height_m
        finite = 1 + chi * (1.133 + chi * (1.283 + chi * (0.769 + chi * 0.0975)))
        worn = (depth / (WORN_REFERENCE * self.radius_m)) ** self.exponent_shift
        return np.asarray(finite * worn)
