"""Contacts from touch to parting, with fixed steps of each contact's own time.

An impact in its own units.

Glossary: lengths are in l = (m u^2 / k)^(1/(p+1)), velocities in u, forces in m u^2 / l, times in l
/ u; p exponent, xi indentation, eta the impactor's velocity, a damping number chi u, lambda = m u /
(l Z) Zener's inelasticity, beta compliance of the layer, h by how much it grows stiffer with force,
r hardening, f static force, phi force.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Index
from .impacts import Impacts


@dataclass(frozen=True, eq=False)
class Numbers:
    """What the motions of n impacts depend on, arrays (n,)."""

    exponent: Floats
    damping: Floats
    inelasticity: Floats
    compliance: Floats
    stiffening: Floats
    yield_depth: Floats
    hardening: Floats

    @classmethod
    def of(cls, impacts: Impacts) -> Self:
        length, force = scales(impacts)
        velocity = impacts.bodies.impact_velocity_m_s
        return cls(
            exponent=impacts.exponent,
            damping=impacts.rate_loss_s_m * velocity,
            inelasticity=impacts.plate_mobility_m_n_s * force / velocity,
            compliance=impacts.layer_compliance_m_n * force / length,
            stiffening=impacts.layer_stiffening_1_n * force,
            yield_depth=(impacts.yield_load_n / force) ** (1 / impacts.exponent),
            hardening=impacts.hardening_up_to_elastic,
        )


def scales(impacts: Impacts) -> tuple[Floats, Floats]:
    """l (m) and m u^2 / l (N), (n,)."""
    energy = impacts.mass_kg * impacts.bodies.impact_velocity_m_s**2
    length = (energy / impacts.stiffness_n_mp) ** (1 / (impacts.exponent + 1))
    return length, energy / length


#: Steps for each contact's own time, about those of the loading.
STEPS = 96
#: A contact that does not part by itself is left when its force has fallen to this share of that at
#: the turn.
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
    with np.errstate(
        divide="ignore", over="ignore"
    ):  # what there is next to nothing of asks for endless depths
        hertz = ((p + 1) * energy) ** (1 / (p + 1))
        soft = np.minimum(hertz**p, (2 * energy / numbers.compliance) ** 0.5)
        beta = numbers.compliance / (
            1 + numbers.stiffening * soft
        )  # about as stiff as under that force
        elastic = np.minimum(hertz, (2 * energy / beta) ** (0.5 / p))
        held = numbers.inelasticity ** (-1 / p)
    yielded = np.minimum(elastic, numbers.yield_depth)
    flow = np.where(elastic > yielded, _flow(numbers, energy, yielded), 0.0)
    depth = np.minimum(np.maximum(elastic, yielded + flow), held)
    return np.asarray(1.4 * (depth + beta * depth**p))


def _flow(numbers: Numbers, energy: Floats, yielded: Floats) -> Floats:
    """Depth (n,) that takes the energy in yield alone: of f = p xi_y^p (xi / xi_y)^r / r, r = 1 a
    spring."""
    p, r = numbers.exponent, numbers.hardening
    straight = np.sqrt(2 * energy / (p * yielded ** (p - 1)))
    bent = (r * (r + 1) * energy / p * yielded ** (r - p)) ** (1 / (r + 1))
    return np.where(r == 1, straight, bent)


def power_of_time(numbers: Numbers) -> Floats:
    """q (n,): steps are equal in the q-th root of time, in which the force begins smoothly."""
    return np.where(numbers.compliance > 0, np.clip(2 * numbers.exponent, 2.0, 4.0), 2.0)
