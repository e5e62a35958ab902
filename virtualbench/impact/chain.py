"""The equations of motion of the chain, for many impacts at once.

States, each (impacts,): front and rear mass, anvil and plate surface (positions x in m, velocities
v in m/s), u the force (N) that has settled in the insulator, w the elastic contact force (N) that
has relaxed.

- Contact: F = Fe + r (Fe - w), tau dw/dt = Fe - w, never below 0. That is a Hertz contact of a body
  whose modulus relaxes (Lee and Radok, J. Appl. Mech. 27 (1960) 438), with Fe elastic-plastic.
- Insulator: a foundation, u = pi M R d^2 / h (Johnson, Contact Mechanics, 1985, section 4.3), that
  follows with a retardation, tau du/dt = F - u. It sits under a small force, without which it would
  have no stiffness at first touch, and depth d is bounded by what of the sheet can be crushed.
- Plate: dx/dt = P / Z under the force P that reaches it, and what of earlier force comes back from
  its edges (`echoes.py`), where that is asked for.

Force over indentation: elastic-plastic, of a finite tip, for many contacts at once.

Loading is that of Zhao, Maietta and Chang (J. Tribol. 122 (2000) 86) for a ball whose hardness is
H:

- elastic, Hertz, up to the indentation d1 at which the mean pressure of the contact is 0.4 H;
- elastic-plastic, from d1 to d2 = 54 d1: the contact's area grows from Hertz's pi R d to the
  plastic 2 pi R d along a cubic in the indentation, and the mean pressure from 0.4 H to H along a
  straight line in its logarithm;
- plastic beyond: 2 pi R d H.

Unloading is elastic, with the contact's radius a that the loading left (Johnson, Contact Mechanics,
1985, section 6.4): from the force F it springs back by 3 F / (4 E* a), as 3/2 power. A factor g of
the indentation alone multiplies both:

- Dimitriadis et al., Biophys. J. 82 (2002) 2798, eq. 7: a bonded elastic layer of finite height is
  stiffer, as a polymer tip is against its holder; chi = sqrt(R d) / h. The figures are for an
  incompressible one;
- a tip that is no paraboloid: two terms of a power series, r^2 and r^4 of a worn tip, r^2 and r of
  a pointed one. Their contacts add up: a term c r^n gives the depth k c a^n and the force 2 E* n /
  (n + 1) k c a^(n + 1) at the contact's radius a, with k = 2, 8/3 and pi/2 for n = 2, 4 and 1
  (Popov, Hess and Willert, Handbook of Contact Mechanics, 2019, section 2.5). The shares of the
  terms are such that the tip has the ball's height at the radius b = 0.32 R: worn (1 - w) r^2 / 2R
  + w r^4 / (2R b^2), pointed (1 - w) r^2 / 2R + w b r / 2R. A worn tip is stiffer as long as the
  indentation is shallow, a pointed one softer.

Since g does not depend on the path, an elastic contact loses nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats

#: Mean pressure at which yield begins over the hardness, and d2 / d1.
ONSET_SHARE, FULLY_PLASTIC = 0.4, 54.0
#: b^2 / R^2.
TIP_REFERENCE = 0.1
_SMALLEST_M = 1e-12  # the factor g divides by the depth; here the force is none


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

    def force(self, indentation_m: Floats, deepest_m: Floats) -> Floats:
        """Force (N), 0 without contact, when `deepest_m` is the deepest indentation so far."""
        top = np.maximum(indentation_m, deepest_m)
        hertz = self.stiffness * top * np.sqrt(top)
        yielding = top > self.yield_m
        depth = np.where(yielding, top / np.where(yielding, self.yield_m, 1.0), 1.0)
        transition = np.minimum((depth - 1) / (FULLY_PLASTIC - 1), 1.0)
        wider = 1 + transition**2 * (3 - 2 * transition)
        pressure = np.minimum(
            1 - (1 - ONSET_SHARE) * (1 - np.log(depth) / np.log(FULLY_PLASTIC)), 1.0
        )
        loading = np.where(yielding, self.plastic_slope / 2 * top * wider * pressure, hertz)
        # A Hertzian contact of this radius springs back by as much as it was pressed in: by 3 F /
        # (4 E* a).
        spring_back = top * loading / np.maximum(hertz * np.sqrt(wider), np.finfo(np.float64).tiny)
        share = np.maximum(1 - (top - indentation_m) / np.maximum(spring_back, _SMALLEST_M), 0.0)
        force = loading * share * np.sqrt(share)
        return np.asarray(force * self.correction(indentation_m) if self._corrected else force)

    @cached_property
    def _corrected(self) -> bool:
        return bool(np.any(np.isfinite(self.tip_height_m) | (self.tip_share != 0)))

    def correction(self, indentation_m: Floats) -> Floats:
        """The factor g of finite height and of the tip's shape."""
        depth = np.maximum(indentation_m, _SMALLEST_M)
        chi = np.sqrt(self.radius_m * depth) / self.tip_height_m
        finite = 1 + chi * (1.133 + chi * (1.283 + chi * (0.769 + chi * 0.0975)))
        return np.asarray(finite * self._shape(depth / (TIP_REFERENCE * self.radius_m)))

    def _shape(self, depth: Floats) -> Floats:
        """Force over the ball's at depths in units of b^2 / R.

        From the contact's area in units of pi b^2 for a worn tip, from its radius in units of b for
        a pointed one.
        """
        worn, pointed = np.maximum(self.tip_share, 0.0), np.maximum(-self.tip_share, 0.0)
        area = 2 * depth / (1 - worn + np.sqrt((1 - worn) ** 2 + 16 / 3 * worn * depth))
        flatter = (area / depth) ** 1.5 * (1 - worn + 8 / 5 * worn * area)
        linear = np.pi / 4 * pointed
        radius = 2 * depth / (linear + np.sqrt(linear**2 + 4 * (1 - pointed) * depth))
        sharper = (1 - pointed + 3 / 4 * linear / radius) * (radius**2 / depth) ** 1.5
        return np.asarray(np.where(self.tip_share < 0, sharper, flatter))


STATES = 9  # x and v of front, rear and anvil; x of the plate; u; w


@dataclass(frozen=True)
class Signals:
    """What one instant shows, each (impacts,). Accelerations are those that slow the impactor
    down."""

    contact_force_n: Floats
    plate_force_n: Floats
    front_m_s2: Floats
    rear_m_s2: Floats
    indentation_m: Floats


@dataclass(frozen=True)
class Chain:
    """Arrays are (impacts,). An inverse mass of 0 stands for a body that is not there."""

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
            1.0, self.inverse_rear_1_kg, out=np.zeros_like(self.front_kg), where=~self._rigid
        )
        return np.asarray(self.front_kg + rear)

    def velocity(self, state: Floats) -> Floats:
        """Of the impactor's centre of mass (m/s)."""
        share = self.front_kg / self.mass_kg
        return np.asarray(share * state[1] + (1 - share) * state[3])

    def start(self, velocity_m_s: Floats) -> Floats:
        """The state (STATES, impacts) at first contact."""
        state = np.zeros((STATES, velocity_m_s.size))
        state[1] = state[3] = velocity_m_s
        return state

    def motion(
        self, state: Floats, deepest_m: Floats, echo_m_s: Floats | float = 0.0
    ) -> tuple[Floats, Signals]:
        """Rates (STATES, impacts) and what is seen, for the deepest indentation before.

        `echo_m_s` is the velocity that earlier force has given the plate's surface by its edges.
        """
        x_front, v_front, x_rear, v_rear, x_anvil, v_anvil, x_plate, settled, relaxed = state
        indentation = x_front - np.where(self._anvil, x_anvil, x_plate)
        if self._layered:
            indentation = indentation - self._layer_depth(settled)
        elastic = self.law.force(indentation, deepest_m)
        force = np.maximum(elastic + self.relaxing * (elastic - relaxed), 0.0)
        neck = self.neck_n_m * (x_rear - x_front) + self.neck_n_s_m * (v_rear - v_front)
        joint = self.joint_n_m * (x_anvil - x_plate) + self.joint_n_s_m * (v_anvil - echo_m_s)
        joint = joint / (
            1 + self.joint_n_s_m * self.plate_mobility_m_n_s
        )  # its plate end moves with joint / Z
        plate = np.where(self._anvil, joint, force)
        front = np.asarray((force - neck) / self.front_kg)
        rear = np.asarray(np.where(self._rigid, front, neck * self.inverse_rear_1_kg))
        rates = np.empty_like(state)
        rates[0], rates[1], rates[2], rates[3] = v_front, -front, v_rear, -rear
        rates[4], rates[5] = v_anvil, (force - joint) * self.inverse_anvil_1_kg
        rates[6] = self.plate_mobility_m_n_s * plate + echo_m_s
        rates[7] = (force - settled) / self.retardation_s
        rates[8] = (elastic - relaxed) / self.relaxation_s
        seen = Signals(force, np.asarray(plate), front, rear, np.asarray(indentation))
        return rates, seen

    @cached_property
    def _anvil(self) -> NDArray[np.bool_]:
        return np.asarray(self.inverse_anvil_1_kg > 0)

    @cached_property
    def _rigid(self) -> NDArray[np.bool_]:
        return np.asarray(self.inverse_rear_1_kg == 0)

    @cached_property
    def _layered(self) -> bool:
        return bool(np.any(self.layer_share > 0))

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

    def _layer_depth(self, settled: Floats) -> Floats:
        pressed = np.maximum(settled, 0.0) + self.layer_seating_n
        depth = (np.sqrt(pressed) - np.sqrt(self.layer_seating_n)) / np.sqrt(self.layer_n_m2)
        return np.asarray(self.layer_share * depth / (1 + depth / self.layer_limit_m))
