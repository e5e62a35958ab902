"""What an operator can set at the bench, as data."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ...array_types import Floats
from ..setting import INSULATORS, ElasticMaterial, Setting


class Amount(Protocol):
    """A number that the operator sets, SI, above zero."""

    def grid(self, count: int) -> Floats:
        """Values (at most count,) that cover the amount's range, rising.

        Parameters:
            count: How many values are wanted.
        """
        ...

    def near(self, value: float, ratio: float) -> Floats:
        """Values about one of them, itself among them, rising.

        Parameters:
            value: The value in the middle, SI, above zero.
            ratio: How many times larger or smaller the others are at most.
        """
        ...

    @property
    def ends(self) -> tuple[float, float]:
        """The least and the largest value."""
        ...


@dataclass(frozen=True)
class Levels:
    """What the lab owns, and nothing between: three bullets. Raises `ValueError` for values not
    positive."""

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.values or not all(math.isfinite(value) and value > 0 for value in self.values):
            raise ValueError(f"levels are {self.values}: expected at least one, positive")

    def grid(self, count: int) -> Floats:
        """Levels evenly picked by their order, rising; all of them where they are no more than
        wanted.

        Parameters:
            count: How many levels are wanted.
        """
        owned = np.array(sorted(self.values))
        return np.asarray(
            owned[
                np.unique(
                    np.linspace(0, owned.size - 1, min(count, owned.size)).round().astype(int)
                )
            ]
        )

    def near(self, value: float, ratio: float) -> Floats:
        """The levels about a value, and the value itself, rising.

        Parameters:
            value: The value in the middle, SI, above zero.
            ratio: How many times larger or smaller the others are at most.
        """
        owned = np.array(sorted({*self.values, value}))
        return np.asarray(owned[np.abs(np.log(owned / value)) <= np.log(ratio) + 1e-12])

    @property
    def ends(self) -> tuple[float, float]:
        return min(self.values), max(self.values)


@dataclass(frozen=True)
class ContinuousRange:
    """Anything from `low` to `high`. Raises `ValueError` for ends that are not positive and
    rising."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.high) and 0 < self.low < self.high):
            raise ValueError(
                f"range from {self.low!r} to {self.high!r}: expected positive and rising ends"
            )

    def grid(self, count: int) -> Floats:
        """Values in equal ratios: a spectrum's level follows the logarithm.

        Parameters:
            count: How many values are wanted.
        """
        return np.geomspace(self.low, self.high, count)

    def near(self, value: float, ratio: float) -> Floats:
        """Values about a value in equal ratios, none beyond the ends, and the value itself, rising.

        Parameters:
            value: The value in the middle, SI, above zero.
            ratio: How many times larger or smaller the others are at most.
        """
        steps = value * ratio ** np.linspace(-1, 1, 5)
        return np.unique(np.append(np.clip(steps, self.low, self.high), value))

    @property
    def ends(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True)
class Mount:
    """What is screwed on and bolted down: all of a setting but pressure and mass."""

    tip: ElasticMaterial
    tip_radius_m: float
    anvil: ElasticMaterial | None
    insulator: str
    impact_position: str


@dataclass(frozen=True)
class TuningSpace:
    """The settings that there are on one plate. Raises `ValueError` naming a field without any
    value."""

    plate: ElasticMaterial
    plate_thickness_m: float
    plate_mass_kg: float
    tips: tuple[ElasticMaterial, ...]
    tip_radii_m: tuple[float, ...]
    anvils: tuple[ElasticMaterial | None, ...]
    insulators: tuple[str, ...]
    impact_positions: tuple[str, ...]
    tank_pressure_pa: Amount
    impactor_mass_kg: Amount

    def __post_init__(self) -> None:
        for name in ("tips", "tip_radii_m", "anvils", "insulators", "impact_positions"):
            if not getattr(self, name):
                raise ValueError(f"{name} is empty: expected at least one")
        if unknown := set(self.insulators).difference(INSULATORS):
            raise ValueError(f"insulators: {min(unknown)!r}; expected of {', '.join(INSULATORS)}")

    def mounts(self) -> Iterator[Mount]:
        """Every one; an insulator lies on an anvil only."""
        parts = (self.tips, self.tip_radii_m, self.anvils, self.insulators, self.impact_positions)
        for tip, radius, anvil, insulator, position in itertools.product(*parts):
            if anvil is not None or insulator == "none":
                yield Mount(tip, radius, anvil, insulator, position)

    def setting(self, mount: Mount, tank_pressure_pa: float, impactor_mass_kg: float) -> Setting:
        """A mount fired with a pressure and a bullet.

        Parameters:
            mount: What is screwed on and bolted down.
            tank_pressure_pa: Gauge pressure of the tank.
            impactor_mass_kg: Mass of the bullet.

        Raises:
            ValueError: As `Setting`.
        """
        return Setting(
            impactor_mass_kg=float(impactor_mass_kg),
            tip=mount.tip,
            tip_radius_m=mount.tip_radius_m,
            plate=self.plate,
            plate_thickness_m=self.plate_thickness_m,
            plate_mass_kg=self.plate_mass_kg,
            tank_pressure_pa=float(tank_pressure_pa),
            anvil=mount.anvil,
            insulator=mount.insulator,
            impact_position=mount.impact_position,
        )

    def grid(self, pressures: int, masses: int) -> list[Setting]:
        """Every mount with every pair of a pressure and a mass.

        Parameters:
            pressures: How many tank pressures, at most.
            masses: How many masses, at most.
        """
        amounts = list(
            itertools.product(
                self.tank_pressure_pa.grid(pressures), self.impactor_mass_kg.grid(masses)
            )
        )
        return [self.setting(mount, *amount) for mount in self.mounts() for amount in amounts]

    def around(self, setting: Setting, ratio: float) -> list[Setting]:
        """The same mount with pressures and masses about those of a setting, itself among them.

        Parameters:
            setting: The setting in the middle, which has a tank pressure.
            ratio: How many times larger or smaller pressure and mass are at most.
        """
        assert setting.tank_pressure_pa is not None  # the space's settings have a pressure
        pressures = self.tank_pressure_pa.near(setting.tank_pressure_pa, ratio)
        masses = self.impactor_mass_kg.near(setting.impactor_mass_kg, ratio)
        return [
            self.setting(mount_of(setting), p, m) for p, m in itertools.product(pressures, masses)
        ]


def mount_of(setting: Setting) -> Mount:
    """A setting without its pressure and mass.

    Parameters:
        setting: A setting of the bench.
    """
    return Mount(
        setting.tip, setting.tip_radius_m, setting.anvil, setting.insulator, setting.impact_position
    )


def setting_text(setting: Setting) -> str:
    """A setting in a few words and the units of the bench.

    Parameters:
        setting: A setting of the bench.
    """
    anvil = f", anvil of {setting.anvil.name}" if setting.anvil else ""
    layer = f", {setting.insulator} insulator" if setting.insulator != "none" else ""
    return (
        f"{(setting.tank_pressure_pa or 0.0) / 1e5:.3g} bar, {setting.impactor_mass_kg:.3g} kg, "
        f"tip of {setting.tip.name} of {setting.tip_radius_m * 1e3:.3g} mm{anvil}{layer}, position "
        f"{setting.impact_position}"
    )


def unlike(first: Setting, second: Setting) -> int:
    """How many parts of the mount differ: what changing from one setting to the other takes.

    Parameters:
        first: One setting.
        second: The other setting.
    """
    pairs = zip(vars(mount_of(first)).values(), vars(mount_of(second)).values(), strict=True)
    return sum(first_part != second_part for first_part, second_part in pairs)


#: What the regulator is set to, what a bullet is weighed to, and what a tip is turned to.
PRESSURE_STEP_PA, MASS_STEP_KG, RADIUS_STEP_M = 5e3, 0.01, 5e-4


def set_alike(first: Setting, second: Setting) -> bool:
    """Whether the same parts are mounted, and pressure, mass and radius differ by a step of the
    bench at most.

    Parameters:
        first: One setting.
        second: The other setting.
    """
    parts = [
        (s.tip, s.anvil, s.plate, s.insulator, s.impact_position, s.boundary_conditions)
        for s in (first, second)
    ]
    numbers = np.array(
        [(s.tank_pressure_pa or 0.0, s.impactor_mass_kg, s.tip_radius_m) for s in (first, second)]
    )
    steps = np.array([PRESSURE_STEP_PA, MASS_STEP_KG, RADIUS_STEP_M])
    # Rounding must not set apart what lies one step apart.
    return parts[0] == parts[1] and bool(
        np.all(np.abs(numbers[0] - numbers[1]) <= steps * (1 + 1e-9))
    )


def amounts(settings: Sequence[Setting]) -> Floats:
    """Pressure (Pa; 0 where a velocity is set) and mass (kg), (n, 2).

    Parameters:
        settings: n settings of the bench.
    """
    return np.array(
        [(s.tank_pressure_pa or 0.0, s.impactor_mass_kg) for s in settings], dtype=np.float64
    )
