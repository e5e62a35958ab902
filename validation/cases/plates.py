"""The plates of withheld campaigns: modal tables drawn to be plausible, and what effects make of
them.

A plate has more modes than its table, and points at which it is supported: sensors' masses and
springs couple them all.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ...array_types import Floats
from ...virtualbench.plate.modes import PlateModes
from ...virtualbench.second_laws.plate import changed_modes

CHANNELS = ("acceleration_1", "acceleration_2")
#: Modes beyond the table's, and points of support.
_UNSEEN, _SUPPORTS = 8, 8
#: How differently modes feel an error of the modulus, which is not the same everywhere in a sheet.
_UNEVEN = 0.4


@dataclass(frozen=True)
class CasePlate:
    """All its modes, of which the first `listed` stand in the table; `supports` (points, modes) are
    shapes.

    `slope`: with what power of frequency the change of damping goes. `bent` (modes,): by what share
    a mode feels an error of the modulus more than the mean does, as it bends where the sheet is
    stiffer.
    """

    modes: PlateModes
    listed: int
    supports: Floats
    slope: float
    bent: Floats

    @property
    def table(self) -> PlateModes:
        return first_modes(self.modes, self.listed)


@lru_cache(maxsize=64)
def plate_of(kind: str, number: int) -> CasePlate:
    """The plate of a plan: 10 to 16 modes from some 200 Hz to 7 to 10 kHz in its table."""
    rng = np.random.default_rng([number, *kind.encode(), 2])
    listed = int(rng.integers(10, 17))
    ratio = (rng.uniform(7e3, 9.5e3) / (low := rng.uniform(180, 300))) ** (1 / (listed - 1))
    count = listed + _UNSEEN
    steps = np.arange(count) + np.concatenate([[0.0], rng.uniform(-0.2, 0.2, count - 1)])
    frequencies = low * ratio**steps
    damping = np.exp(rng.normal(np.log(rng.uniform(0.004, 0.008)), 0.15, count))
    shapes, supports = (
        0.45 * rng.standard_normal((2, count)),
        0.35 * rng.standard_normal((_SUPPORTS, count)),
    )
    impact = rng.choice([-1, 1], count) * rng.uniform(0.15, 0.75, count)
    modes = PlateModes(frequencies, damping, impact[None], shapes, CHANNELS)
    slope = float(rng.uniform(-0.3, 0.3))
    return CasePlate(modes, listed, supports, slope, rng.uniform(-_UNEVEN, _UNEVEN, count))


def first_modes(modes: PlateModes, count: int) -> PlateModes:
    """The lowest `count` of them."""
    return replace(
        modes,
        frequencies_hz=modes.frequencies_hz[:count],
        damping=modes.damping[:count],
        shape_impact=modes.shape_impact[:, :count],
        shapes=modes.shapes[:, :count],
    )


def changed(plate: CasePlate, strengths: Mapping[str, float], laws: str = "") -> PlateModes:
    """The table's modes as they are under effects.

    `plate.damping`: so many times 10 % more, with a power of frequency that is the plate's;
    `plate.stiffness`: per cent of frequency in the mean of the modes; `plate.sensor_mass`: kg at
    each sensor; `plate.boundary`: Hz at which the rigid plate would swing on the springs at its
    supports. Masses and springs go into an eigenproblem over all modes.
    """
    if laws:
        return first_modes(
            changed_modes(plate.modes, plate.supports, strengths, laws), plate.listed
        )
    modes = plate.modes
    squares = (2 * np.pi * modes.frequencies_hz) ** 2
    swing = (2 * np.pi * strengths.get("plate.boundary", 0.0)) ** 2
    mass = strengths.get("plate.sensor_mass", 0.0)
    if swing or mass:
        modes = _coupled(modes, squares, plate.supports, swing, mass)
    damping = strengths.get("plate.damping", 0.0)
    tilt = (modes.frequencies_hz / np.median(modes.frequencies_hz)) ** plate.slope
    modes = replace(
        modes,
        frequencies_hz=modes.frequencies_hz
        * (1 + 0.01 * strengths.get("plate.stiffness", 0.0) * (1 + plate.bent)),
        damping=np.maximum(modes.damping * (1 + 0.1 * damping * tilt), 1e-4),
    )
    return first_modes(modes, plate.listed)


def _coupled(
    modes: PlateModes, squares: Floats, supports: Floats, swing: float, mass: float
) -> PlateModes:
    from scipy.linalg import eigh

    # mean stiffness of the springs on a mode is that of a foundation: swing^2
    scale = swing / np.mean(np.sum(supports**2, axis=0))
    stiffness = np.diag(squares) + scale * supports.T @ supports
    inertia = np.eye(squares.size) + mass * modes.shapes.T @ modes.shapes
    new, vectors = eigh(stiffness, inertia)
    return replace(
        modes,
        frequencies_hz=np.sqrt(new) / (2 * np.pi),
        shape_impact=modes.shape_impact @ vectors,
        shapes=modes.shapes @ vectors,
    )
