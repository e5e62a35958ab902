"""An impact in its own units, and the law of force in them.

Glossary: lengths are in l = (m u^2 / k)^(1/(p+1)), velocities in u, forces in m u^2 / l, times in l / u; p exponent,
xi indentation, eta the impactor's velocity, a damping number chi u, lambda = m u / (l Z) Zener's inelasticity, beta
compliance of the layer, h by how much it grows stiffer with force, f static force, phi force.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .bodies import Floats
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

    def take(self, chosen: NDArray[np.intp]) -> Self:
        return type(self)(*(getattr(self, item.name)[chosen] for item in fields(self)))

    def layer(self, static: Floats) -> Floats:
        """By how much the layer gives way under f: beta ln(1 + h f) / h."""
        stiffer = self.stiffening * static
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(stiffer > _LINEAR, np.log1p(stiffer) / stiffer, 1.0 - stiffer / 2)
        return np.asarray(self.compliance * static * share)


#: Below, a logarithm over its argument is its first two terms.
_LINEAR = 1e-8


def scales(impacts: Impacts) -> tuple[Floats, Floats]:
    """l (m) and m u^2 / l (N), (n,)."""
    energy = impacts.mass_kg * impacts.bodies.impact_velocity_m_s**2
    length = (energy / impacts.stiffness_n_mp) ** (1 / (impacts.exponent + 1))
    return length, energy / length


@dataclass(frozen=True, eq=False)
class Spring:
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
        elastic = np.minimum(over, self.yield_depth)
        root = self.factor * _power(elastic, self.exponent - 1)
        slope = self.exponent * root
        return np.asarray(elastic * root + slope * (over - elastic)), np.asarray(slope)

    def take(self, chosen: NDArray[np.intp]) -> Self:
        return type(self)(*(getattr(self, item.name)[chosen] for item in fields(self)))


def _power(values: Floats, exponent: Floats) -> Floats:
    # A root costs a tenth of a power, and nearly every contact is a sphere's.
    return np.sqrt(values) if np.all(exponent == 0.5) else np.asarray(values**exponent)


@dataclass(frozen=True, eq=False)
class Rates:
    """How a motion goes on from one state, arrays (n,)."""

    force: Floats
    indentation: Floats  # d xi / dt
    approach: Floats  # dx / dt
    approach_rate: Floats  # d2x / dt2
    force_rate: Floats
    static: Floats  # f
    slope: Floats  # df / d xi

    def take(self, chosen: NDArray[np.intp]) -> Self:
        return type(self)(*(getattr(self, item.name)[chosen] for item in fields(self)))


def rates(numbers: Numbers, spring: Spring, depth: Floats, velocity: Floats) -> Rates:
    """x = xi + beta ln(1 + h f) / h; x' = eta - lambda phi; phi = f (1 + a x'); eta' = -phi.

    The loss acts on the rate of the whole approach, so that x' = (eta - lambda f) / (1 + a lambda f) is explicit.
    """
    static, slope = spring(depth)
    lossy = 1 + numbers.damping * numbers.inelasticity * static
    approach = (velocity - numbers.inelasticity * static) / lossy
    grip = 1 + numbers.damping * approach
    force = static * grip
    gives = numbers.compliance
    if numbers.stiffening.any():  # what nearly no layer does would cost all of them a twentieth
        gives = gives / (1 + numbers.stiffening * static)
    indentation = approach / (1 + gives * slope)
    static_rate = slope * indentation
    approach_rate = -(force + numbers.inelasticity * static_rate * grip) / lossy
    force_rate = static_rate * grip + numbers.damping * static * approach_rate
    return Rates(force, indentation, approach, approach_rate, force_rate, static, slope)
