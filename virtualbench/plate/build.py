"""What a virtual plate is made of: material, outline, supports, sensors, and the damping it was
born with.

The plate of the virtual bench.

The thesis gives the outline of its plate in a drawing only ("diamond-like", 10 mm thick, held at
two points of the upper edge and one of the lower). Ours is an irregular quadrilateral of 1.0 m by
0.6 m without any symmetry: corners (0, 0.10), (0.62, 0), (1.00, 0.38), (0.30, 0.60) m, y upwards,
area 0.345 m^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

Point = tuple[float, float]
Boundary = Literal["free", "fixed"]


@dataclass(frozen=True)
class PlateMaterial:
    """An isotropic elastic material. Raises `ValueError` for what no stable material has."""

    young_modulus_pa: float
    poisson_ratio: float
    density_kg_m3: float

    def __post_init__(self) -> None:
        _positive(young_modulus_pa=self.young_modulus_pa, density_kg_m3=self.density_kg_m3)
        if not -1 < self.poisson_ratio < 0.5:
            raise ValueError(
                f"poisson_ratio = {self.poisson_ratio!r}: expected a number between -1 and 0.5"
            )

    @property
    def shear_modulus_pa(self) -> float:
        return self.young_modulus_pa / (2 * (1 + self.poisson_ratio))


@dataclass(frozen=True)
class PlateSensor:
    """An accelerometer on the plate, normal to it. The default mass is that of a PCB 350B43 (thesis
    2.2.1)."""

    name: str
    position_m: Point
    mass_kg: float = 0.027


@dataclass(frozen=True)
class Spring:
    """A point spring normal to the plate: what a chain, a rope or the edge of a fixture does to
    it."""

    position_m: Point
    stiffness_n_m: float


@dataclass(frozen=True)
class Clamp:
    """A stretch of an edge without deflection or rotation; edge k runs from corner k to the next,
    from 0 to 1."""

    edge: int
    start: float = 0.0
    stop: float = 1.0

    def __post_init__(self) -> None:
        if self.edge not in range(4):
            raise ValueError(f"edge = {self.edge!r}: expected 0, 1, 2 or 3")
        if not 0 <= self.start < self.stop <= 1:
            raise ValueError(
                f"clamp from {self.start!r} to {self.stop!r}: expected 0 <= start < stop <= 1"
            )


@dataclass(frozen=True)
class BenchPlate:
    """One plate on the bench.

    `springs` act in proportion to the effect `plate.boundary`, sensor masses to
    `plate.sensor_mass`. `damping_ratios` are those of the modes in rising order, rigid ones
    included. Raises `ValueError` for an outline that is not convex and counter-clockwise, and for
    numbers no plate has.
    """

    material: PlateMaterial
    thickness_m: float
    outline_m: tuple[Point, Point, Point, Point]
    impact_points_m: tuple[Point, ...]
    sensors: tuple[PlateSensor, ...]
    damping_ratios: tuple[float, ...]
    clamps: tuple[Clamp, ...] = ()
    springs: tuple[Spring, ...] = ()

    def __post_init__(self) -> None:
        _positive(thickness_m=self.thickness_m)
        _checked_outline(self.outline_m)
        for sensor in self.sensors:
            _not_negative(f"mass_kg of {sensor.name}", sensor.mass_kg)
        for spring in self.springs:
            _not_negative("stiffness_n_m", spring.stiffness_n_m)
        if not all(0 <= ratio < 1 for ratio in self.damping_ratios):
            raise ValueError("damping_ratios: expected numbers from 0 to below 1")

    @property
    def boundary(self) -> Boundary:
        return "fixed" if self.clamps else "free"

    @property
    def area_m2(self) -> float:
        x, y = np.array(self.outline_m).T
        return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)

    @property
    def mass_kg(self) -> float:
        """Without sensors."""
        return self.material.density_kg_m3 * self.thickness_m * self.area_m2

    @property
    def rigidity_n_m(self) -> float:
        """E h^3 / (12 (1 - nu^2))."""
        return (
            self.material.young_modulus_pa
            * self.thickness_m**3
            / (12 * (1 - self.material.poisson_ratio**2))
        )


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value!r}: expected a number above 0")


def _not_negative(name: str, value: float) -> None:
    if not (math.isfinite(value) and value >= 0):
        raise ValueError(f"{name} = {value!r}: expected 0 or more")


def _checked_outline(outline: tuple[Point, ...]) -> None:
    corners = np.array(outline, dtype=float)
    if corners.shape != (4, 2) or not np.isfinite(corners).all():
        raise ValueError(f"outline_m = {outline!r}: expected four corners (x, y)")
    (ax, ay), (bx, by) = (
        (np.roll(corners, -1, axis=0) - corners).T,
        (np.roll(corners, -2, axis=0) - corners).T,
    )
    if not np.all(ax * by - ay * bx > 0):
        raise ValueError(f"outline_m = {outline!r}: expected a convex outline, counter-clockwise")


#: Thesis, table 4.2.
MATERIALS = {
    "aluminum": PlateMaterial(69.9e9, 0.33, 2700.0),
    "steel": PlateMaterial(200e9, 0.30, 7800.0),
}
OUTLINE_M: tuple[Point, Point, Point, Point] = ((0.0, 0.10), (0.62, 0.0), (1.0, 0.38), (0.30, 0.60))
#: #1, #2 and #3 of a plate that hangs as usual.
IMPACT_POINTS_M: tuple[Point, ...] = ((0.47, 0.28), (0.31, 0.37), (0.68, 0.22))
_SUSPENSION = (Spring((0.34, 0.56), 2e3), Spring((0.93, 0.37), 2e3), Spring((0.61, 0.03), 4e3))
_FIXTURE = (
    Spring((0.02, 0.11), 2e4),
    Spring((0.61, 0.01), 2e4),
    Spring((0.98, 0.38), 2e4),
    Spring((0.31, 0.59), 2e4),
)


def resonant_plate(material: str, boundary: Boundary, rng: np.random.Generator) -> BenchPlate:
    """The plate of the virtual bench, 10 mm thick: impact points #1, #2 and #3, two accelerometers.

    Free: two chains at the upper edge and a rope at the lower corner. Tension over length, 800 N in
    a rope of 0.2 m and its share in the chains, makes them 4 and 2 kN/m across. Fixed: the middle
    half of the lower and of the upper edge is bolted to the frame, whose bars reach on to the
    corners and touch there (assumed, 20 kN/m).

    Parameters:
        material: A name of `MATERIALS`: "aluminum" or "steel".
        boundary: How the plate is held: "free" or "fixed".
        rng: Generator of random numbers, from which every mode's damping is drawn: from 0.2 to 1 %,
            evenly in its logarithm.

    Raises:
        ValueError: For an unknown material or boundary.
    """
    if material not in MATERIALS:
        raise ValueError(f"plate material {material!r}: expected one of {', '.join(MATERIALS)}")
    if boundary not in ("free", "fixed"):
        raise ValueError(f"plate boundary {boundary!r}: expected 'free' or 'fixed'")
    fixed = boundary == "fixed"
    return BenchPlate(
        material=MATERIALS[material],
        thickness_m=0.010,
        outline_m=OUTLINE_M,
        impact_points_m=IMPACT_POINTS_M,
        sensors=(
            PlateSensor("acceleration_1", (0.22, 0.20)),
            PlateSensor("acceleration_2", (0.73, 0.37)),
        ),
        damping_ratios=tuple(np.exp(rng.uniform(math.log(0.002), math.log(0.01), 1000)).tolist()),
        clamps=(Clamp(0, 0.25, 0.75), Clamp(2, 0.25, 0.75)) if fixed else (),
        springs=_FIXTURE if fixed else _SUSPENSION,
    )
