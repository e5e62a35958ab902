"""The plans of withheld campaigns: a few of each kind, so that what an effect does to a plan is
worked out once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np

#: Plans of each kind.
DESIGNS = 6
#: Nominal speeds (m/s) of a hand.
HAND_SPEEDS_M_S = {"low": 0.85, "high": 1.85}
_TIP_RADIUS_MM = {"aluminum": 30.0, "steel": 30.0, "delrin": 30.0, "polyurethane": 15.0}


@dataclass(frozen=True)
class CaseSetting:
    """One configuration; SI but for the names that say otherwise. Without a gun,
    `tank_pressure_bar` is 0."""

    tip_material: str = "steel"
    tip_radius_mm: float = 45.0
    plate_material: str = "steel"
    anvil_material: str = "none"
    insulator: str = "none"
    tank_pressure_bar: float = 0.0
    mass_kg: float = 0.32
    hammer_speed: str = ""
    pulse_s: float = 0.0

    @property
    def face_material(self) -> str:
        """What the tip meets."""
        return self.plate_material if self.anvil_material == "none" else self.anvil_material

    @property
    def speed_m_s(self) -> float:
        """Nominal speed of a hand."""
        return HAND_SPEEDS_M_S[self.hammer_speed]

    def factors(self) -> dict[str, Any]:
        """As runs.csv names them."""
        cells: dict[str, Any] = {
            "tip_material": self.tip_material,
            "tip_radius_mm": self.tip_radius_mm,
            "plate_material": self.plate_material,
            "anvil_material": self.anvil_material,
            "insulator": self.insulator,
        }
        if self.tank_pressure_bar:
            return {
                "tank_pressure_bar": self.tank_pressure_bar,
                "bullet_mass_kg": self.mass_kg,
                **cells,
            }
        cells |= {"hammer_speed": self.hammer_speed, "boundary_conditions": "free"}
        return cells | (
            {"impact_position": "#1", "pulse_setting": f"{self.pulse_s * 1e3:g}ms"}
            if self.pulse_s
            else {}
        )


@lru_cache(maxsize=64)
def design(kind: str, number: int) -> tuple[CaseSetting, ...]:
    """The configurations of one plan. Raises `ValueError` for an unknown kind or number."""
    if kind not in _PLANS or number not in range(DESIGNS):
        raise ValueError(
            f"design {number!r} of {kind!r}: expected 0 to {DESIGNS - 1} of {', '.join(_PLANS)}"
        )
    return _PLANS[kind](np.random.default_rng([number, *kind.encode()]))


def _gun(rng: np.random.Generator) -> tuple[CaseSetting, ...]:
    count = int(rng.integers(4, 7))
    pressures = np.geomspace(rng.uniform(0.3, 0.5), rng.uniform(2.0, 4.0), count).round(2)
    masses = np.sort(
        rng.choice([0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.0], 3 if count > 4 else 4, replace=False)
    )
    rows = (
        CaseSetting(tank_pressure_bar=p, mass_kg=m)
        for p, m in product(pressures.tolist(), masses.tolist())
    )
    return tuple(rows)


def _hammer(rng: np.random.Generator) -> tuple[CaseSetting, ...]:
    tips = rng.choice(list(_TIP_RADIUS_MM), int(rng.integers(2, 4)), replace=False).tolist()
    anvils = [["none", "steel"], ["none", "aluminum"], ["steel", "aluminum"]][int(rng.integers(3))]
    plate = str(rng.choice(["aluminum", "steel"]))
    scale = float(rng.choice([0.5, 1.0, 1.5]))
    return tuple(
        CaseSetting(tip, _TIP_RADIUS_MM[tip] * scale, plate, anvil, insulator, hammer_speed=speed)
        for tip, anvil, insulator, speed in product(
            tips, anvils, ("none", "polymeric"), HAND_SPEEDS_M_S
        )
    )


def _plate(rng: np.random.Generator) -> tuple[CaseSetting, ...]:
    pulses = rng.choice(
        [0.12e-3, 0.18e-3, 0.25e-3, 0.35e-3, 0.5e-3, 0.8e-3], int(rng.integers(3, 7)), replace=False
    )
    rows = product(np.sort(pulses).tolist(), HAND_SPEEDS_M_S)
    return tuple(
        CaseSetting("aluminum", 30.0, "aluminum", hammer_speed=speed, pulse_s=pulse)
        for pulse, speed in rows
    )


def _chain(rng: np.random.Generator) -> tuple[CaseSetting, ...]:
    pressures = np.geomspace(rng.uniform(0.3, 0.5), rng.uniform(1.2, 2.5), 3).round(2).tolist()
    masses = rng.choice([0.15, 0.2, 0.3, 0.5, 0.8], 2, replace=False).tolist()
    tips = rng.choice(["steel", "aluminum", "delrin"], 2, replace=False).tolist()
    radius, insulators = float(rng.choice([20.0, 30.0, 45.0])), ("none", "polymeric")
    rows = list(product(pressures, masses, tips))
    return tuple(
        CaseSetting(
            tip,
            radius,
            "steel",
            "steel",
            insulators[row % 2 if row // 4 % 2 else 1 - row % 2],
            pressure,
            mass,
        )
        for row, (pressure, mass, tip) in enumerate(rows)
    )


_PLANS = {"gun": _gun, "hammer": _hammer, "plate": _plate, "chain": _chain, "gun-contact": _chain}
