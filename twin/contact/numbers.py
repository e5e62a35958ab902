"""An impact in its own units, and the law of force in them.

Glossary: lengths are in l = (m u^2 / k)^(1/(p+1)), velocities in u, forces in m u^2 / l, times in l / u; p exponent,
xi indentation, eta the impactor's velocity, a damping number chi u, lambda = m u / (l Z) Zener's inelasticity, beta
compliance of the layer, h by how much it grows stiffer with force, f static force, phi force.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from .bodies import Floats
from .columns import Columns
from .impacts import Impacts


@dataclass(frozen=True, eq=False)
class Numbers(Columns):
    """What the motions of n impacts depend on, arrays (n,)."""

    exponent: Floats
    damping: Floats
    inelasticity: Floats
    compliance: Floats
    stiffening: Floats
    yield_depth: Floats

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
        )

    def layer(self, static: Floats) -> Floats:
        """By how much the layer gives way under f: beta ln(1 + h f) / h."""
        stiffer = self.stiffening * static
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(stiffer > _LINEAR, np.log1p(stiffer) / stiffer, 1.0 - stiffer / 2)
        return np.asarray(self.compliance * static * share)

    def layered(self, static: Floats, slope: Floats) -> Floats | float:
        """Rate of the approach over that of the indentation, without the plate: 1 + beta f' / (1 + h f)."""
        # What few batches have would cost all of them.
        if not self._has_layers:
            return 1.0
        gives = self.compliance / (1 + self.stiffening * static) if self._stiffens else self.compliance
        return np.asarray(1 + gives * slope)

    @cached_property
    def _has_layers(self) -> bool:
        return bool(self.compliance.any())

    @cached_property
    def _stiffens(self) -> bool:
        return bool(self.stiffening.any())


#: Below, a logarithm over its argument is its first two terms.
_LINEAR = 1e-8


def scales(impacts: Impacts) -> tuple[Floats, Floats]:
    """l (m) and m u^2 / l (N), (n,)."""
    energy = impacts.mass_kg * impacts.bodies.impact_velocity_m_s**2
    length = (energy / impacts.stiffness_n_mp) ** (1 / (impacts.exponent + 1))
    return length, energy / length


@dataclass(frozen=True, eq=False)
class Spring(Columns):
    """f = c (xi - xi_0)^p, up to the depth where it yields; from there on along its tangent. Arrays (n,)."""

    exponent: Floats
    factor: Floats  # c
    rest: Floats  # xi_0: the indentation that stays
    yield_depth: Floats

    @classmethod
    def loading(cls, numbers: Numbers) -> Self:
        n = len(numbers.exponent)
        return cls(numbers.exponent, np.ones(n), np.zeros(n), numbers.yield_depth)

    def unloading(self, deepest: Floats) -> Self:
        """From the deepest indentation of the loading, after eq. 1.17 and Thornton (`unloading.py`)."""
        from .unloading import elastic_recovery

        elastic = deepest**self.exponent
        force, _ = self(deepest)
        recovered = elastic_recovery(deepest, force, elastic)
        yielded = deepest > self.yield_depth
        return type(self)(
            self.exponent,
            np.where(yielded, force / recovered**self.exponent, 1.0),
            np.where(yielded, deepest - recovered, 0.0),
            np.full_like(deepest, np.inf),
        )

    def __call__(self, depth: Floats) -> tuple[Floats, Floats]:
        """f and its slope."""
        over = np.maximum(depth - self.rest, 0.0)
        elastic = np.minimum(over, self.yield_depth) if self._yields else over
        root = self.factor * (np.sqrt(elastic) if self._of_spheres else elastic ** (self.exponent - 1))
        slope, force = self.exponent * root, elastic * root
        if self._yields:
            force += slope * (over - elastic)
        return force, slope

    @cached_property
    def _yields(self) -> bool:
        return bool(np.isfinite(self.yield_depth).any())

    @cached_property
    def _of_spheres(self) -> bool:
        """All of them: a root costs a tenth of a power."""
        return bool(np.all(self.exponent == 1.5))


@dataclass(frozen=True, eq=False)
class Pace:
    """What a step needs of a state, arrays (n,): the force, and the rates of indentation and approach."""

    static: Floats  # f
    slope: Floats  # df / d xi
    lossy: Floats  # 1 + a lambda f
    grip: Floats  # 1 + a x'
    force: Floats
    indentation: Floats  # d xi / dt
    approach: Floats  # dx / dt


def pace(numbers: Numbers, spring: Spring, depth: Floats, velocity: Floats) -> Pace:
    """x = xi + beta ln(1 + h f) / h; x' = eta - lambda phi; phi = f (1 + a x'); eta' = -phi.

    The loss acts on the rate of the whole approach, so that x' = (eta - lambda f) / (1 + a lambda f) is explicit.
    """
    static, slope = spring(depth)
    zener = numbers.inelasticity * static
    lossy = 1 + numbers.damping * zener
    approach = (velocity - zener) / lossy
    grip = 1 + numbers.damping * approach
    return Pace(static, slope, lossy, grip, static * grip, approach / numbers.layered(static, slope), approach)


@dataclass(frozen=True, eq=False)
class Rates(Columns):
    """How a motion goes on from one state, arrays (n,)."""

    force: Floats
    indentation: Floats  # d xi / dt
    approach: Floats  # dx / dt
    approach_rate: Floats  # d2x / dt2
    force_rate: Floats
    static: Floats  # f
    slope: Floats  # df / d xi


def rates(numbers: Numbers, spring: Spring, depth: Floats, velocity: Floats) -> Rates:
    """`pace`, and how fast that changes."""
    now = pace(numbers, spring, depth, velocity)
    gripped = now.slope * now.indentation * now.grip
    approach_rate = -(now.force + numbers.inelasticity * gripped) / now.lossy
    force_rate = gripped + numbers.damping * now.static * approach_rate
    return Rates(now.force, now.indentation, now.approach, approach_rate, force_rate, now.static, now.slope)
