"""What an impact is made of: the quantities through which effects of the contact meet."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .bodies import Bodies

_LAW = "an impact"


@dataclass(frozen=True, eq=False)
class Impacts:
    """n impacts of a mass on F = k delta^p (1 + chi x'), arrays (n,); `of` gives the nominal ones, which are Hertz'.

    x is the approach of impactor and plate: the indentation delta and the layer's own. What is known of the impact
    and changes nothing by itself: `bodies`, `insulated`, `plate_impedance_n_s_m`.
    """

    bodies: Bodies
    insulated: NDArray[np.bool_]  # whether an insulating layer lies on the target
    plate_impedance_n_s_m: Floats | None  # force over velocity at a point of the plate without edges
    mass_kg: Floats
    stiffness_n_mp: Floats  # k (N / m^p)
    exponent: Floats  # p
    rate_loss_s_m: Floats  # chi; 0 loses nothing
    yield_load_n: Floats  # beyond it the load goes on along the tangent (Thornton); inf never yields
    layer_compliance_m_n: Floats  # of a spring in series; 0 is none
    layer_stiffening_1_n: Floats  # by which it grows stiffer with force, as a share of its stiffness; 0 is linear
    plate_mobility_m_n_s: Floats  # velocity of the plate's surface over force; 0 is a rigid plate

    @classmethod
    def of(
        cls, bodies: Bodies, insulated: NDArray[np.bool_] | None = None, plate_impedance_n_s_m: Floats | None = None
    ) -> Self:
        """Hertz' impacts on a rigid target. Needs `impactor_mass_kg`. Raises `ValueError` for unlike lengths.

        The plate is of the target's material where its impedance is not given, as in Zener's eq. 1.14.
        """
        n = len(bodies)
        insulated = np.zeros(n, dtype=np.bool_) if insulated is None else insulated
        impedance = _impedance(bodies) if plate_impedance_n_s_m is None else plate_impedance_n_s_m
        for name, values in (("insulated", insulated), ("plate_impedance_n_s_m", impedance)):
            if values is not None and values.shape != (n,):
                raise ValueError(f"{name} has shape {values.shape}: expected ({n},), one for each impact")
        return cls(
            bodies=bodies,
            insulated=insulated,
            plate_impedance_n_s_m=impedance,
            mass_kg=bodies.needed("impactor_mass_kg", _LAW),
            stiffness_n_mp=bodies.hertz_stiffness_n_m15,
            exponent=np.full(n, 1.5),
            rate_loss_s_m=np.zeros(n),
            yield_load_n=np.full(n, np.inf),
            layer_compliance_m_n=np.zeros(n),
            layer_stiffening_1_n=np.zeros(n),
            plate_mobility_m_n_s=np.zeros(n),
        )

    def take(self, rows: NDArray[np.intp]) -> Self:
        """Some of the impacts, by their rows."""
        arrays = {name: values[rows] for name, values in vars(self).items() if isinstance(values, np.ndarray)}
        return replace(self, bodies=self.bodies.take(rows), **arrays)


def plate_impedance(
    youngs_modulus_pa: Floats, poisson_ratio: Floats, density_kg_m3: Floats, thickness_m: Floats
) -> Floats:
    """Z = 8 sqrt(D rho h) (N s/m) of a thin plate without edges, D = E h^3 / (12 (1 - nu^2)).

    Source: Cremer, Heckl and Petersson, Structure-Borne Sound (2005), ch. 4; Zener, Phys. Rev. 59 (1941) 669.
    """
    rigidity = youngs_modulus_pa * thickness_m**3 / (12 * (1 - poisson_ratio**2))
    return np.asarray(8 * np.sqrt(rigidity * density_kg_m3 * thickness_m))


def _impedance(bodies: Bodies) -> Floats | None:
    if bodies.plate_thickness_m is None:
        return None
    of_target = (bodies.target_youngs_modulus_pa, bodies.target_poisson_ratio, bodies.target_density_kg_m3)
    return plate_impedance(*of_target, bodies.plate_thickness_m)
