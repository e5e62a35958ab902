"""Expansion that is not adiabatic."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...effects import Value, parameter
from ..shot import GunEffect, ShotInputs


@dataclass(frozen=True)
class HeatExchange(GunEffect):
    """Walls give the gas a share of the heat that would keep it at its temperature; a negative
    share takes heat away.

    The index is n = gamma - share (gamma - 1): gamma with 0, isothermal with 1. Heat takes time:
    with a rate r shots that take T = sqrt(2 L m / (p A)) get a share 1 - exp(-r T), slow ones more
    than fast ones.
    """

    id = "gun.heat_exchange"
    law = "p V^n = const, n = gamma - s (gamma - 1), s + 1 - exp(-r sqrt(2 L m / (p A))) for s"
    source = (
        "polytropic change of state: Moran and Shapiro, Fundamentals of "
        "Engineering Thermodynamics, section 6.11"
    )

    # Likely: gas that expands is colder than its walls, so heat flows in; a colder wall is no
    # gun's.
    share: Value = parameter(
        "of the heat of an isothermal expansion that reaches the gas",
        "",
        default=0.3,
        low=-0.5,
        high=1.0,
        off=0.0,
        likely=(0.0, 1.0),
    )

    # Likely: h A / (m cv) of air in vessels and bores, with 10 to 1000 W/(m2 K) (Incropera, ch. 8)
    rate_1_s: Value = parameter(
        "r, rate at which heat reaches the gas",
        "1/s",
        default=0.0,
        low=0.0,
        high=1e3,
        off=0.0,
        likely=(0.05, 50.0),
    )
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = (("share",), ("rate_1_s",))

    def prepare(self, shot: ShotInputs) -> ShotInputs:
        gamma = shot.heat_capacity_ratio
        push = np.maximum(shot.tank_pressure_pa, 1.0) * shot.area_m2
        time = np.sqrt(2 * shot.travel_m * shot.bullet_mass_kg / push)
        share = np.asarray(self.share) - np.expm1(-np.asarray(self.rate_1_s) * time)
        return shot.but(polytropic_index=gamma - np.minimum(share, 1.0) * (gamma - 1))
