"""The valve between tank and barrel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class ValveFlow(GunEffect):
    """A ball valve of the bore's size with a loss coefficient, which opens evenly; tank and barrel
    are two gases.

    The loss coefficient K counts dynamic heads of the flow in the bore, those of the way from the
    tank included: area of flow A / sqrt(K). A smaller valve of diameter d has K (D / d)^4.

    Where little pressure is lost, valves and lines are reckoned with the density of the outside air
    instead: a drop that grows with the projectile's speed alone, whatever the tank holds
    (`steady_loss_coefficient`).
    """

    id = "gun.valve_flow"
    law = (
        "mdot = a(t / t_open) A / sqrt(K) c* p1 / sqrt(R T1) phi(p2 / p1); F = A "
        "K_s rho_atm v^2 / 2"
    )
    source = (
        "ISO 6358-1:2013; loss coefficients: Idelchik, Handbook of Hydraulic "
        "Resistance, ch. 3 and 9"
    )

    # Likely: a full-bore ball valve alone, to a solenoid valve of a sixth of the bore, (D / d)^4;
    # scales, so its logarithm is even.
    loss_coefficient: Value = parameter(
        "dynamic heads lost in the open valve and on the way to it",
        "",
        default=1.0,
        low=0.0,
        high=1e4,
        off=0.0,
        likely=(0.02, 1e3),
    )
    # Likely: solenoids take 5 to 50 ms, ball valves by hand or by air 0.1 to 0.3 s.
    opening_time_s: Value = parameter(
        "until the valve is wide open",
        "s",
        default=0.1,
        low=0.0,
        high=2.0,
        off=0.0,
        likely=(0.0, 0.3),
    )

    # Likely: as the other, up to a valve of a quarter of the bore.
    steady_loss_coefficient: Value = parameter(
        "dynamic heads of outside air lost at the projectile's speed",
        "",
        default=0.0,
        low=0.0,
        high=1e4,
        off=0.0,
        likely=(0.1, 300.0),
    )
    moves: ClassVar[bool] = True
    # Every gun has a valve; only one as wide as the bore that opens at once does nothing.
    prior_odds: ClassVar[float] = 2.0
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (
        ("loss_coefficient", "opening_time_s"),
        ("steady_loss_coefficient",),
    )

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        loss = np.asarray(self.loss_coefficient, dtype=np.float64)
        with np.errstate(divide="ignore"):
            area = np.pi / 4 * shot.bore_diameter_m**2 / np.sqrt(loss)
        return shot.but(
            valve_area_m2=area,
            opening_time_s=self.opening_time_s,
            air_heads=shot.air_heads + self.steady_loss_coefficient,
            valve_air_heads=shot.valve_air_heads + self.steady_loss_coefficient,
        )
