"""Contacts from touch to parting, with fixed steps of each contact's own time."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Index
from .dimensionless import Numbers

#: Steps for each contact's own time, about those of the loading.
STEPS = 96
#: A contact that does not part by itself is left when its force has fallen to this share of that at the turn.
LEAST_FORCE = 1e-4


@dataclass(frozen=True, eq=False)
class Nodes:
    """Times, forces and the forces' rates after each step, one contact after the other."""

    first: Index  # (n + 1,): where the nodes of a contact begin
    time: Floats  # (all nodes,)
    force: Floats
    force_rate: Floats


@dataclass(frozen=True, eq=False)
class March:
    """n contacts in their own units."""

    contact_time: Floats
    compression_time: Floats  # until the deepest indentation
    deepest: Floats
    permanent: Floats
    velocity: Floats  # the impactor's at the end, negative when it comes back
    parted: NDArray[np.bool_]  # or left, still touching
    nodes: Nodes


def march(numbers: Numbers, steps: int = STEPS) -> March:
    """Raises `ArithmeticError` where a contact does not come to an end."""
    from . import kernel

    columns = [getattr(numbers, item.name) for item in fields(numbers)]
    figures = np.stack([*columns, own_time(numbers), power_of_time(numbers)], axis=1)
    outcomes, unturned, endless, first, nodes = kernel.march(figures, steps, LEAST_FORCE)
    if unturned:
        raise ArithmeticError(f"{unturned} contacts do not come to their deepest indentation")
    if endless:
        raise ArithmeticError(f"{endless} contacts neither part nor come to rest")
    time, compression, deepest, permanent, velocity, parted = outcomes
    return March(time, compression, deepest, permanent, velocity, parted == 1, Nodes(first, *nodes))


def own_time(numbers: Numbers) -> Floats:
    """T (n,): about as long as the loading takes. It sets the steps, and nothing else."""
    p = numbers.exponent
    energy = 0.5 / (1 + numbers.damping / 2)
    with np.errstate(divide="ignore", over="ignore"):  # what there is next to nothing of asks for endless depths
        hertz = ((p + 1) * energy) ** (1 / (p + 1))
        soft = np.minimum(hertz**p, (2 * energy / numbers.compliance) ** 0.5)
        beta = numbers.compliance / (1 + numbers.stiffening * soft)  # about as stiff as under that force
        elastic = np.minimum(hertz, (2 * energy / beta) ** (0.5 / p))
        held = numbers.inelasticity ** (-1 / p)
    yielded = np.minimum(elastic, numbers.yield_depth)
    flow = np.where(elastic > yielded, np.sqrt(2 * energy / (p * yielded ** (p - 1))), 0.0)
    depth = np.minimum(np.maximum(elastic, yielded + flow), held)
    return np.asarray(1.4 * (depth + beta * depth**p))


def power_of_time(numbers: Numbers) -> Floats:
    """q (n,): steps are equal in the q-th root of time, in which the force begins smoothly."""
    return np.where(numbers.compliance > 0, np.clip(2 * numbers.exponent, 2.0, 4.0), 2.0)
