"""The load-cell array and the bolts that preload it (thesis 2.2.1, eq. 2.10-2.12)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .ballistic import positive


@dataclass(frozen=True)
class MetricThread:
    """An ISO metric thread (ISO 68-1, ISO 724; stress area as in ISO 898-1). Raises `ValueError` if not positive."""

    diameter_m: float
    pitch_m: float

    def __post_init__(self) -> None:
        positive(diameter_m=self.diameter_m, pitch_m=self.pitch_m)
        if self.root_diameter_m <= 0:
            raise ValueError(f"pitch_m = {self.pitch_m!r}: too coarse for diameter_m = {self.diameter_m!r}")

    @property
    def pitch_diameter_m(self) -> float:
        """d2 = d - (3/8) sqrt(3) P."""
        return self.diameter_m - 0.375 * math.sqrt(3) * self.pitch_m

    @property
    def root_diameter_m(self) -> float:
        """d3 = d - (17/24) sqrt(3) P."""
        return self.diameter_m - 17 / 24 * math.sqrt(3) * self.pitch_m

    @property
    def stress_area_m2(self) -> float:
        """As = pi/4 ((d2 + d3) / 2)^2."""
        return math.pi / 4 * ((self.pitch_diameter_m + self.root_diameter_m) / 2) ** 2


M20 = MetricThread(diameter_m=0.020, pitch_m=0.0025)


@dataclass(frozen=True)
class LoadCellArray:
    """Equal force sensors side by side, each clamped by a bolt; the defaults are the thesis's four Kistler 9107C.

    Raises `ValueError` when a value is out of range.
    """

    sensors: int = 4
    sensor_range_n: float = 700e3
    preload_share: float = 0.2  # of each sensor's range

    def __post_init__(self) -> None:
        positive(sensors=self.sensors, sensor_range_n=self.sensor_range_n)
        if not 0 < self.preload_share < 1:
            raise ValueError(f"preload_share = {self.preload_share!r}: expected between 0 and 1")

    @property
    def preload_per_bolt_n(self) -> float:
        return self.preload_share * self.sensor_range_n

    @property
    def capacity_n(self) -> float:
        """What is left for the impact: 2240 kN of 2800 kN."""
        return self.sensors * (self.sensor_range_n - self.preload_per_bolt_n)


def tensile_resistance(
    tensile_strength_pa: float, stress_area_m2: float, *, k2: float = 0.9, partial_factor: float = 1.25
) -> float:
    """Design tensile resistance (N) of a bolt, eq. 2.10: k2 f_ub A_s / gamma_M2.

    k2 is 0.9, and 0.63 for a countersunk head (EN 1993-1-8, Table 3.4). An M20 of class 10.9: 176.4 kN. Raises
    `ValueError` for values that are not positive.
    """
    positive(tensile_strength_pa=tensile_strength_pa, stress_area_m2=stress_area_m2)
    positive(k2=k2, partial_factor=partial_factor)
    return k2 * tensile_strength_pa * stress_area_m2 / partial_factor


def tightening_torque(preload_n: float, thread: MetricThread, *, bearing_diameter_m: float, friction: float) -> float:
    """Torque (N m) that gives a bolt its preload, eq. 2.11: F [0.16 P + 0.58 d2 mu + (Dkm / 2) mu] (VDI 2230, MA).

    Pitch, thread friction, friction under the head. Erratum: eq. 2.11 prints a product of the first two terms, which
    is an area; the sum gives the printed 320 N m (318 for Dkm = 25.4 mm), the product 142 N m, or 44 % of it, which
    would leave the array without its preload. The bearing diameter is the mean of the head's and the hole's. Raises
    `ValueError` for values that are not positive.
    """
    positive(preload_n=preload_n, bearing_diameter_m=bearing_diameter_m, friction=friction)
    threads = 0.16 * thread.pitch_m + 0.58 * thread.pitch_diameter_m * friction
    return preload_n * (threads + bearing_diameter_m / 2 * friction)
