"""The plate of the virtual bench.

The thesis gives the outline of its plate in a drawing only ("diamond-like", 10 mm thick, held at two points of
the upper edge and one of the lower). Ours is an irregular quadrilateral of 1.0 m by 0.6 m without any symmetry:
corners (0, 0.10), (0.62, 0), (1.00, 0.38), (0.30, 0.60) m, y upwards, area 0.345 m^2.
"""

from __future__ import annotations

import math

import numpy as np

from .build import BenchPlate, Boundary, Clamp, PlateMaterial, PlateSensor, Point, Spring

__all__ = ["IMPACT_POINTS_M", "MATERIALS", "OUTLINE_M", "resonant_plate"]

#: Thesis, table 4.2.
MATERIALS = {"aluminum": PlateMaterial(69.9e9, 0.33, 2700.0), "steel": PlateMaterial(200e9, 0.30, 7800.0)}
OUTLINE_M: tuple[Point, Point, Point, Point] = ((0.0, 0.10), (0.62, 0.0), (1.0, 0.38), (0.30, 0.60))
#: #1, #2 and #3 of a plate that hangs as usual.
IMPACT_POINTS_M: tuple[Point, ...] = ((0.47, 0.28), (0.31, 0.37), (0.68, 0.22))
_MOST_MODES = 1000
_SUSPENSION = (Spring((0.34, 0.56), 2e3), Spring((0.93, 0.37), 2e3), Spring((0.61, 0.03), 4e3))
_FIXTURE = (Spring((0.02, 0.11), 2e4), Spring((0.61, 0.01), 2e4), Spring((0.98, 0.38), 2e4), Spring((0.31, 0.59), 2e4))


def resonant_plate(material: str, boundary: Boundary, rng: np.random.Generator) -> BenchPlate:
    """The plate of the virtual bench, 10 mm thick: impact points #1, #2 and #3, two accelerometers.

    Free: two chains at the upper edge and a rope at the lower corner. Tension over length, 800 N in a rope of 0.2 m
    and its share in the chains, makes them 4 and 2 kN/m across. Fixed: the middle half of the lower and of the upper
    edge is bolted to the frame, whose bars reach on to the corners and touch there (assumed, 20 kN/m). Every mode's
    damping is drawn from 0.2 to 1 %, evenly in its logarithm. Raises `ValueError` for an unknown material or boundary.
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
        sensors=(PlateSensor("acceleration_1", (0.22, 0.20)), PlateSensor("acceleration_2", (0.73, 0.37))),
        damping_ratios=tuple(np.exp(rng.uniform(math.log(0.002), math.log(0.01), 1000)).tolist()),
        clamps=(Clamp(0, 0.25, 0.75), Clamp(2, 0.25, 0.75)) if fixed else (),
        springs=_FIXTURE if fixed else _SUSPENSION,
    )
