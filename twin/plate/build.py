"""What a plate is made of: outline, thickness, material, what is bolted to it and what holds it.

Laws of modal damping, for a plate whose modes have not been measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ...array_types import Floats
from ..setting import ElasticMaterial
from .outline import Edge, Point, area, checked_outline


class DampingLaw(Protocol):
    """Ratio as a function of frequency; a frozen record, so that a plate that has one is
    hashable."""

    def ratios(self, frequency_hz: Floats) -> Floats:
        """Damping ratios (m,), 1 being critical.

        Parameters:
            frequency_hz: Frequencies of modes (m,), rigid ones at 0 Hz among them.
        """
        ...


@dataclass(frozen=True)
class ConstantDamping:
    """The same ratio at every mode.

    0.5 % is our assumption: metal alone has a tenth of that or less (Cremer, Heckl, Petersson,
    Structure-Borne Sound: loss factors, 2 zeta, of 1e-4 to 1e-3); cables, joints and what the plate
    hangs from bring it to 0.2 to 1 %.
    """

    ratio: float = 0.005

    def __post_init__(self) -> None:
        if not 0 <= self.ratio < 1:
            raise ValueError(f"ratio = {self.ratio!r}: expected 0 to below 1")

    def ratios(self, frequency_hz: Floats) -> Floats:
        """The same ratio for all modes, (m,).

        Parameters:
            frequency_hz: Frequencies of modes (m,).
        """
        return np.full(frequency_hz.shape, self.ratio)


@dataclass(frozen=True)
class RayleighDamping:
    """C = alpha M + beta K: zeta = alpha / (2 omega) + beta omega / 2; a rigid mode, which nothing
    damps, has 0.

    Given by the ratio at two frequencies, low and high. Raises `ValueError` where that takes a
    negative alpha or beta.
    """

    low_hz: float
    low_ratio: float
    high_hz: float
    high_ratio: float

    def __post_init__(self) -> None:
        if not 0 < self.low_hz < self.high_hz:
            raise ValueError(
                f"frequencies {self.low_hz!r} and {self.high_hz!r} Hz: expected rising ones above 0"
            )
        if not (
            min(self._coefficients()) >= 0 and 0 <= self.low_ratio < 1 and 0 <= self.high_ratio < 1
        ):
            raise ValueError(
                f"ratios {self.low_ratio!r} and {self.high_ratio!r}: no Rayleigh damping has them"
            )

    def ratios(self, frequency_hz: Floats) -> Floats:
        """Damping ratios (m,); 0 for rigid modes.

        Parameters:
            frequency_hz: Frequencies of modes (m,), rigid ones at 0 Hz among them.
        """
        alpha, beta = self._coefficients()
        omega = 2 * np.pi * frequency_hz
        elastic = omega > 0
        return np.where(elastic, alpha / (2 * np.where(elastic, omega, 1)) + beta * omega / 2, 0.0)

    def _coefficients(self) -> tuple[float, float]:
        low, high = 2 * np.pi * self.low_hz, 2 * np.pi * self.high_hz
        alpha = (
            2 * low * high * (self.low_ratio * high - self.high_ratio * low) / (high**2 - low**2)
        )
        return alpha, 2 * (self.high_ratio * high - self.low_ratio * low) / (high**2 - low**2)


@dataclass(frozen=True)
class NamedPoint:
    """A named point of the plate: an impact point or a sensor."""

    name: str
    position_m: Point


@dataclass(frozen=True)
class PointMass:
    """Something bolted to the plate, small beside a wavelength: it has no rotary inertia."""

    position_m: Point
    mass_kg: float


@dataclass(frozen=True)
class PointSpring:
    """What a chain, a rope or a pad does to the plate, normal to it."""

    position_m: Point
    stiffness_n_m: float


def named_points(points: Mapping[str, Point]) -> tuple[NamedPoint, ...]:
    """Points as a plate takes them.

    Parameters:
        points: Positions (x, y) in m by name, such as `{"#1": (0.1, 0.2)}`.
    """
    return tuple(NamedPoint(name, (float(x), float(y))) for name, (x, y) in points.items())


@dataclass(frozen=True)
class PlateBuild:
    """One plate of one thickness; hashable, so that it is solved once.

    The outline is a simple polygon, either way round; edge k runs from corner k to the next.
    Sensors have no mass but what `masses` puts there. Raises `ValueError` naming the field, the
    value and what is expected.
    """

    outline_m: tuple[Point, ...]
    thickness_m: float
    material: ElasticMaterial
    impact_points: tuple[NamedPoint, ...]
    sensors: tuple[NamedPoint, ...]
    damping: DampingLaw = field(default_factory=ConstantDamping)
    masses: tuple[PointMass, ...] = ()
    springs: tuple[PointSpring, ...] = ()
    edges: tuple[Edge, ...] = ()

    def __post_init__(self) -> None:
        checked_outline(self.outline_m)
        if not (math.isfinite(self.thickness_m) and self.thickness_m > 0):
            raise ValueError(f"thickness_m = {self.thickness_m!r}: expected a positive number")
        for mass in self.masses:
            _not_negative("mass_kg", mass.mass_kg)
        for spring in self.springs:
            _not_negative("stiffness_n_m", spring.stiffness_n_m)
        for what, named in (("impact_points", self.impact_points), ("sensors", self.sensors)):
            names = [place.name for place in named]
            if not names or len(set(names)) < len(names):
                raise ValueError(
                    f"{what} has names {names!r}: expected one or more, each of them once"
                )
        for edge in self.edges:
            if not 0 <= edge.side < len(self.outline_m):
                raise ValueError(f"edge {edge.side!r}: expected 0 to {len(self.outline_m) - 1}")

    @property
    def area_m2(self) -> float:
        return abs(area(np.array(self.outline_m, dtype=np.float64)))

    @property
    def mass_kg(self) -> float:
        """Of the bare plate."""
        return self.mass_per_area_kg_m2 * self.area_m2

    @property
    def mass_per_area_kg_m2(self) -> float:
        return self.material.density_kg_m3 * self.thickness_m

    @property
    def rigidity_n_m(self) -> float:
        """E h^3 / (12 (1 - nu^2))."""
        return (
            self.material.youngs_modulus_pa
            * self.thickness_m**3
            / (12 * (1 - self.material.poisson_ratio**2))
        )


def _not_negative(name: str, value: float) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise ValueError(f"{name} = {value!r}: expected 0 or more")
