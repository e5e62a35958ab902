"""The plates of a campaign, solved once for all its recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ...array_types import Floats
from ..effects import Effects
from ..impact.build import ImpactTarget
from ..impact.echoes import PlateEchoes
from ..plate.build import Boundary
from ..plate.modes import PlateModes, modes
from ..plate.resonant import OUTLINE_M, resonant_plate
from ..plate.respond import respond
from ..recorder import Value

Key = tuple[str, Boundary]

#: The bench's plates are 10 mm thick.
THICKNESS_M = 0.010
#: The pass band of 51.2 kHz; at 100 kHz the modes beyond are missing, and with them what short pulses excite there.
MAX_FREQUENCY_HZ = 20e3
BOUNDARIES: Mapping[str, Boundary] = {"free": "free", "fixed": "fixed"}
_LIBRARY: tuple[Key, ...] = (("aluminum", "free"), ("aluminum", "fixed"), ("steel", "free"), ("steel", "fixed"))


def solved_plates(
    keys: Iterable[Key], effects: Effects, rng: np.random.Generator, heights_m: Sequence[float] = (0.0,)
) -> Mapping[Key, PlateModes]:
    """Modes of the plates asked for, with the impact points of each height at which a plate hangs one after the other:
    a plate that hangs higher is struck lower. Each plate's damping has its own place in `rng`, whichever are asked for.

    Raises `ValueError` for a plate that the bench has not got.
    """
    wanted = set(keys)
    if unknown := wanted.difference(_LIBRARY):
        library_materials = ", ".join(sorted({material for material, _ in _LIBRARY}))
        raise ValueError(f"plan: plate_material is {min(unknown)[0]!r}; expected one of {library_materials}")
    generators = dict(zip(_LIBRARY, rng.spawn(len(_LIBRARY)), strict=True))
    plates = {key: resonant_plate(*key, generators[key]) for key in _LIBRARY if key in wanted}
    for key, plate in plates.items():
        points = tuple((x, y - height) for height in heights_m for x, y in plate.impact_points_m)
        plates[key] = replace(plate, impact_points_m=points)
    return {key: modes(plate, effects, max_frequency_hz=MAX_FREQUENCY_HZ) for key, plate in plates.items()}


def response_at(plate: PlateModes, point: int) -> Callable[[Floats, Floats], Floats]:
    """The plate's accelerations (sensors, n) under a force (n,) at one of its impact points, from rest."""

    def response(time_s: Floats, force_n: Floats) -> Floats:
        acting = np.flatnonzero(force_n)
        if not acting.size:
            return np.zeros((plate.shapes.shape[0], time_s.size))
        stretch = slice(max(0, int(acting[0]) - 1), int(acting[-1]) + 2)
        return respond(plate, time_s[stretch], force_n[stretch], time_s, point=point)

    return response


def echoes_at(plate: PlateModes, point: int, target: ImpactTarget) -> PlateEchoes:
    """What a plate sends back to one of its impact points while it is struck there."""
    return PlateEchoes(plate.frequencies_hz, plate.damping, plate.shape_impact[point], target.plate_impedance_n_s_m)


def plate_stage(material: str) -> dict[str, Value]:
    """`[bench.plate]`: what the lab's drawing says."""
    return {"material": material, "thickness_m": THICKNESS_M, "outline_m": [list(corner) for corner in OUTLINE_M]}
