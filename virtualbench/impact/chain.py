"""The figures of the chain and of its contact's law, for many impacts at once; `kernel` has the
equations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...array_types import Floats
from .kernel import ONSET_SHARE, correction


@dataclass(frozen=True)
class ContactLaw:
    """Arrays are (contacts,). A hardness may be infinite, and so may a tip's height."""

    modulus_pa: Floats  # E*, of the pair
    radius_m: Floats
    hardness_pa: Floats  # of the softer of the two
    tip_height_m: Floats
    tip_share: Floats  # w of a worn tip; less than 0: -w of a pointed one

    @cached_property
    def stiffness(self) -> Floats:
        """Hertz's K = 4/3 E* sqrt(R), N / m^1.5."""
        return np.asarray(4 / 3 * self.modulus_pa * np.sqrt(self.radius_m))

    @cached_property
    def yield_m(self) -> Floats:
        """Indentation d1 at which yield begins: there Hertz's mean pressure is 0.4 of the
        hardness."""
        return np.asarray(
            self.radius_m
            * (3 * np.pi * ONSET_SHARE * self.hardness_pa / (4 * self.modulus_pa)) ** 2
        )

    @cached_property
    def plastic_slope(self) -> Floats:
        """Force over indentation (N/m) of the plastic contact; 0 where none yields."""
        finite = np.where(np.isfinite(self.hardness_pa), self.hardness_pa, 0.0)
        return np.asarray(2 * np.pi * finite * self.radius_m)

    @cached_property
    def figures(self) -> Floats:
        """What the compiled law takes, (contacts, 6)."""
        rows = (
            self.stiffness,
            self.yield_m,
            self.plastic_slope,
            self.radius_m,
            self.tip_height_m,
            self.tip_share,
        )
        return np.ascontiguousarray(np.array(rows, dtype=np.float64).T)

    def correction(self, indentation_m: Floats) -> Floats:
        """The factor g of finite height and of the tip's shape."""
        pairs = zip(indentation_m, self.figures, strict=True)
        return np.array([correction(depth, figures) for depth, figures in pairs])


@dataclass(frozen=True)
class Chain:
    """What strikes and is struck in many impacts; arrays are (impacts,). An inverse mass of 0
    stands for a body that is not there."""

    law: ContactLaw
    front_kg: Floats
    inverse_rear_1_kg: Floats
    neck_n_m: Floats
    neck_n_s_m: Floats
    inverse_anvil_1_kg: Floats
    joint_n_m: Floats
    joint_n_s_m: Floats
    plate_mobility_m_n_s: Floats
    relaxing: Floats
    relaxation_s: Floats
    layer_share: Floats  # strength of the insulator's compliance; 0 without one
    layer_n_m2: Floats  # pi M R / h
    layer_seating_n: Floats
    layer_limit_m: Floats
    retardation_s: Floats

    @cached_property
    def mass_kg(self) -> Floats:
        """Of the whole impactor."""
        rear = np.divide(
            1.0,
            self.inverse_rear_1_kg,
            out=np.zeros_like(self.front_kg),
            where=self.inverse_rear_1_kg > 0,
        )
        return np.asarray(self.front_kg + rear)

    def velocity(self, state: Floats) -> Floats:
        """Of the impactor's centre of mass (m/s)."""
        share = self.front_kg / self.mass_kg
        return np.asarray(share * state[1] + (1 - share) * state[3])

    @cached_property
    def figures(self) -> Floats:
        """What the compiled chain takes, (impacts, 21), in the order of `kernel`."""
        rows = (
            self.front_kg,
            self.inverse_rear_1_kg,
            self.neck_n_m,
            self.neck_n_s_m,
            self.inverse_anvil_1_kg,
            self.joint_n_m,
            self.joint_n_s_m,
            self.plate_mobility_m_n_s,
            self.relaxing,
            self.relaxation_s,
            self.layer_share,
            self.layer_n_m2,
            self.layer_seating_n,
            self.layer_limit_m,
            self.retardation_s,
        )
        return np.ascontiguousarray(np.hstack([self.law.figures, np.array(rows).T]))

    @cached_property
    def layer_rate(self) -> Floats:
        """How fast (1/s) the insulator settles when the contact behind it is at its stiffest
        against it.

        If what has settled is the force, that is at twice the seating force, where u^(1/3) / (u +
        u0)^(1/2) is largest.
        """
        load = 2 * self.layer_seating_n
        depth = (load / self.law.stiffness) ** (2 / 3)
        contact = (1 + self.relaxing) * self.law.correction(depth) * 1.5 * load / depth
        layer = 2 * np.sqrt((load + self.layer_seating_n) * self.layer_n_m2)
        return np.asarray((1 + self.layer_share * contact / layer) / self.retardation_s)
