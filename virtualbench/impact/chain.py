"""The equations of motion of the chain, for many impacts at once.

States, each (impacts,): front and rear mass, anvil and plate surface (positions x in m, velocities v in m/s), u the
force (N) that has settled in the insulator, w the elastic contact force (N) that has relaxed.

- Contact: F = Fe + r (Fe - w), tau dw/dt = Fe - w, never below 0. That is a Hertz contact of a body whose modulus
  relaxes (Lee and Radok, J. Appl. Mech. 27 (1960) 438), with Fe elastic-plastic.
- Insulator: a foundation, u = pi M R d^2 / h (Johnson, Contact Mechanics, 1985, section 4.3), that follows with a
  retardation, tau du/dt = F - u. It sits under a small force, without which it would have no stiffness at first
  touch, and depth d is bounded by what of the sheet can be crushed.
- Plate: dx/dt = P / Z under the force P that reaches it, and what of earlier force comes back from its edges
  (`echoes.py`), where that is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .contact import ContactLaw

__all__ = ["STATES", "Chain", "Signals"]

STATES = 9  # x and v of front, rear and anvil; x of the plate; u; w


@dataclass(frozen=True)
class Signals:
    """What one instant shows, each (impacts,). Accelerations are those that slow the impactor down."""

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
        rear = np.divide(1.0, self.inverse_rear_1_kg, out=np.zeros_like(self.front_kg), where=~self._rigid)
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

    def motion(self, state: Floats, deepest_m: Floats, echo_m_s: Floats | float = 0.0) -> tuple[Floats, Signals]:
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
        joint = joint / (1 + self.joint_n_s_m * self.plate_mobility_m_n_s)  # its plate end moves with joint / Z
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
        """How fast (1/s) the insulator settles when the contact behind it is at its stiffest against it.

        If what has settled is the force, that is at twice the seating force, where u^(1/3) / (u + u0)^(1/2) is largest.
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
