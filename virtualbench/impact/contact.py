"""Force over indentation: elastic-plastic, of a finite tip, for many contacts at once.

Loading and unloading are Thornton's (J. Appl. Mech. 64 (1997) 383): Hertz up to the indentation at which the mean
pressure reaches the yield pressure p, then a straight line of slope pi p R, back along the Hertz curve of the larger
radius that the flattened surface has. A factor g of the indentation alone multiplies it:

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

__all__ = ["WORN_REFERENCE", "ContactLaw"]

WORN_REFERENCE = 0.1
_SMALLEST_M = 1e-12  # a negative power of zero is not finite; here the force is none


@dataclass(frozen=True)
class ContactLaw:
    """Arrays are (contacts,). A yield pressure may be infinite, and so may a tip's height."""

    modulus_pa: Floats  # E*, of the pair
    radius_m: Floats
    yield_pressure_pa: Floats
    tip_height_m: Floats
    exponent_shift: Floats

    @cached_property
    def stiffness(self) -> Floats:
        """Hertz's K = 4/3 E* sqrt(R), N / m^1.5."""
        return np.asarray(4 / 3 * self.modulus_pa * np.sqrt(self.radius_m))

    @cached_property
    def yield_m(self) -> Floats:
        """Indentation at which yield begins: there the mean pressure of Hertz is the yield pressure."""
        return np.asarray(self.radius_m * (np.pi * self.yield_pressure_pa / (2 * self.modulus_pa)) ** 2)

    @cached_property
    def plastic_slope(self) -> Floats:
        """Force over indentation (N/m) beyond yield; 0 where there is none."""
        finite = np.where(np.isfinite(self.yield_pressure_pa), self.yield_pressure_pa, 0.0)
        return np.asarray(np.pi * finite * self.radius_m)

    def force(self, indentation_m: Floats, deepest_m: Floats) -> Floats:
        """Force (N), 0 without contact, when `deepest_m` is the deepest indentation so far."""
        top = np.maximum(indentation_m, deepest_m)
        hertz = self.stiffness * top * np.sqrt(top)
        loading = np.where(top > self.yield_m, self._plastic_offset + self.plastic_slope * top, hertz)
        # Going back, the radius has grown by hertz / loading, and so has the indentation that is elastic shrunk.
        spring_back = top * loading / np.maximum(hertz, np.finfo(np.float64).tiny)
        share = np.maximum(1 - (top - indentation_m) / np.maximum(spring_back, _SMALLEST_M), 0.0)
        force = loading * share * np.sqrt(share)
        return np.asarray(force * self.correction(indentation_m) if self._corrected else force)

    @cached_property
    def _plastic_offset(self) -> Floats:
        onset = np.where(np.isfinite(self.yield_m), self.yield_m, 0.0)
        return np.asarray(self.stiffness * onset**1.5 - self.plastic_slope * onset)

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
