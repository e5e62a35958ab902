"""What an impact is made of: the quantities through which effects of the contact meet.

Effects of the contact: each changes the quantities of an impact before it is solved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..contact_interface import ImpactBatch
from ..effects import Effect, Value
from ..setting import Setting
from .bodies import Bodies

_LAW = "an impact"


@dataclass(frozen=True, eq=False)
class Impacts:
    """n impacts of a mass on F = k delta^p (1 + chi x'), arrays (n,); `of` gives the nominal ones,
    which are Hertz'.

    x is the approach of impactor and plate: the indentation delta and the layer's own. What is
    known of the impact and changes nothing by itself: `bodies`, `insulated`,
    `plate_impedance_n_s_m`.
    """

    bodies: Bodies
    insulated: NDArray[np.bool_]  # whether an insulating layer lies on the target
    plate_impedance_n_s_m: (
        Floats | None
    )  # force over velocity at a point of the plate without edges
    mass_kg: Floats
    stiffness_n_mp: Floats  # k (N / m^p)
    exponent: Floats  # p
    rate_loss_s_m: Floats  # chi; 0 loses nothing
    yield_load_n: (
        Floats  # beyond it the load goes on along the tangent (Thornton); inf never yields
    )
    hardening_exponent: (
        Floats  # r; not along the tangent but as F_y (1 + p ((delta / delta_y)^r - 1) / r); 1 is it
    )
    layer_compliance_m_n: Floats  # of a spring in series; 0 is none
    layer_stiffening_1_n: (
        Floats  # by which it grows stiffer with force, as a share of its stiffness; 0 is linear
    )
    plate_mobility_m_n_s: Floats  # velocity of the plate's surface over force; 0 is a rigid plate

    @classmethod
    def of(
        cls,
        bodies: Bodies,
        insulated: NDArray[np.bool_] | None = None,
        plate_impedance_n_s_m: Floats | None = None,
    ) -> Self:
        """Hertz' impacts on a rigid target.

        Parameters:
            bodies: n impacts.
            insulated: Where an insulating layer lies on the target (n,); by default None, nowhere.
            plate_impedance_n_s_m: Force over velocity at a point of the plate without edges (n,), N
                s/m; by default None, that of a plate of the target's material, as in Zener's eq.
                1.14, where its thickness is known.

        Raises:
            MissingQuantityError: Where `impactor_mass_kg` is unknown.
            ValueError: For unlike lengths.
        """
        n = len(bodies)
        insulated = np.zeros(n, dtype=np.bool_) if insulated is None else insulated
        impedance = _impedance(bodies) if plate_impedance_n_s_m is None else plate_impedance_n_s_m
        for name, values in (("insulated", insulated), ("plate_impedance_n_s_m", impedance)):
            if values is not None and values.shape != (n,):
                raise ValueError(
                    f"{name} has shape {values.shape}: expected ({n},), one for each impact"
                )
        return cls(
            bodies=bodies,
            insulated=insulated,
            plate_impedance_n_s_m=impedance,
            mass_kg=bodies.needed("impactor_mass_kg", _LAW),
            stiffness_n_mp=bodies.hertz_stiffness_n_m15,
            exponent=np.full(n, 1.5),
            rate_loss_s_m=np.zeros(n),
            yield_load_n=np.full(n, np.inf),
            hardening_exponent=np.ones(n),
            layer_compliance_m_n=np.zeros(n),
            layer_stiffening_1_n=np.zeros(n),
            plate_mobility_m_n_s=np.zeros(n),
        )

    @property
    def hardening_up_to_elastic(self) -> Floats:
        """r (n,), at most p: with r = p the loading is elastic, and yield makes none stiffer than
        that."""
        return np.minimum(self.hardening_exponent, self.exponent)

    def take(self, rows: NDArray[np.intp]) -> Self:
        """Some of the impacts.

        Parameters:
            rows: Their row numbers.
        """
        arrays = {
            name: values[rows]
            for name, values in vars(self).items()
            if isinstance(values, np.ndarray)
        }
        return replace(self, bodies=self.bodies.take(rows), **arrays)


def plate_impedance(
    youngs_modulus_pa: Floats, poisson_ratio: Floats, density_kg_m3: Floats, thickness_m: Floats
) -> Floats:
    """Z = 8 sqrt(D rho h) (N s/m) of a thin plate without edges, D = E h^3 / (12 (1 - nu^2)).

    Parameters:
        youngs_modulus_pa: E of the plate's material (n,).
        poisson_ratio: nu of the plate's material (n,).
        density_kg_m3: rho of the plate's material (n,).
        thickness_m: h (n,).

    Source:
        Cremer, Heckl and Petersson, Structure-Borne Sound (2005), ch. 4; Zener, Phys. Rev. 59
        (1941) 669.
    """
    rigidity = youngs_modulus_pa * thickness_m**3 / (12 * (1 - poisson_ratio**2))
    return np.asarray(8 * np.sqrt(rigidity * density_kg_m3 * thickness_m))


def _impedance(bodies: Bodies) -> Floats | None:
    if bodies.plate_thickness_m is None:
        return None
    of_target = (
        bodies.target_youngs_modulus_pa,
        bodies.target_poisson_ratio,
        bodies.target_density_kg_m3,
    )
    return plate_impedance(*of_target, bodies.plate_thickness_m)


@dataclass(frozen=True)
class ContactEffect(Effect):
    """What Hertz' impact leaves out. Several effects act in the order in which they are given.

    Parameters are numbers for all impacts, or arrays (n,).
    """

    def prepare(self, impacts: Impacts) -> Impacts:
        """The same impacts with the quantities that this effect changes.

        Parameters:
            impacts: n impacts, as effects before this one have changed them.

        Raises:
            MissingQuantityError: For what these bodies do not tell.
            ValueError: For parameters of another number of impacts.
        """
        return impacts

    def _each(self, parameter: Value, impacts: Impacts) -> Floats:
        """A parameter as (n,)."""
        values, n = np.asarray(parameter, dtype=np.float64), len(impacts.bodies)
        if values.shape not in ((), (n,)):
            raise ValueError(
                f"{self.id}: parameter of shape "
                f"{values.shape} for {n} impacts; expected () or ({n},)"
            )
        return np.broadcast_to(values, (n,))


def bodies_of(strikes: ImpactBatch) -> Bodies:
    """Tip, first layer hit, impactor's mass, plate's thickness; yield strengths where they are
    known for all materials.

    Parameters:
        strikes: n impacts.
    """

    def each(value: Callable[[Setting], float | None]) -> Floats | None:
        values = [value(setting) for setting in strikes.settings]
        return None if None in values else np.array(values, dtype=np.float64)

    return Bodies.of(
        impactor_radius_m=each(lambda s: s.tip_radius_m),
        impactor_youngs_modulus_pa=each(lambda s: s.tip.youngs_modulus_pa),
        impactor_poisson_ratio=each(lambda s: s.tip.poisson_ratio),
        impactor_density_kg_m3=each(lambda s: s.tip.density_kg_m3),
        impactor_mass_kg=each(lambda s: s.impactor_mass_kg),
        impactor_yield_strength_pa=each(lambda s: s.tip.yield_strength_pa),
        target_youngs_modulus_pa=each(lambda s: s.target.youngs_modulus_pa),
        target_poisson_ratio=each(lambda s: s.target.poisson_ratio),
        target_density_kg_m3=each(lambda s: s.target.density_kg_m3),
        target_yield_strength_pa=each(lambda s: s.target.yield_strength_pa),
        plate_thickness_m=each(lambda s: s.plate_thickness_m),
        impact_velocity_m_s=strikes.impact_velocity_m_s,
    )


def insulated(strikes: ImpactBatch) -> NDArray[np.bool_]:
    """Where an insulating layer lies on the target, (n,).

    Parameters:
        strikes: n impacts.
    """
    return np.array([setting.insulator != "none" for setting in strikes.settings])


def impedance(strikes: ImpactBatch) -> Floats:
    """Point impedance (N s/m, (n,)) of the plate's own material, whatever lies on it.

    Parameters:
        strikes: n impacts.
    """
    plates = [
        (
            s.plate.youngs_modulus_pa,
            s.plate.poisson_ratio,
            s.plate.density_kg_m3,
            s.plate_thickness_m,
        )
        for s in strikes.settings
    ]
    return plate_impedance(*np.array(plates).reshape(-1, 4).T)
