"""What rings on when the contact is over: the rear of the impactor on its neck, the anvil on its joint.

Nothing acts any more and all links are linear: the states follow from a matrix exponential, exactly.
"""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from .chain import Chain

__all__ = ["ringing"]


def ringing(chain: Chain, state: Floats, duration_s: float, step_s: float) -> tuple[Floats, Floats]:
    """Acceleration of the rear and force on the plate at steps 1, 2 ... after `state`, both (n, impacts).

    The acceleration is the one that slows the impactor down, and 0 for a rigid one.
    """
    count = round(duration_s / step_s)
    stretch, closing = state[2] - state[0], state[3] - state[1]
    rear, joint = _neck(chain), _joint(chain)
    neck = _histories(rear, np.stack([stretch, closing]), count, step_s)
    anvil = _histories(joint, np.stack([state[4] - state[6], state[5]]), count, step_s)
    pull = chain.neck_n_m * neck[:, 0] + chain.neck_n_s_m * neck[:, 1]
    loss = 1 + chain.joint_n_s_m * chain.plate_mobility_m_n_s
    plate = (chain.joint_n_m * anvil[:, 0] + chain.joint_n_s_m * anvil[:, 1]) / loss
    return pull * chain.inverse_rear_1_kg, plate


def _neck(chain: Chain) -> Floats:
    """(impacts, 2, 2) of stretch and its rate: the two masses in free flight."""
    inverse = chain.inverse_rear_1_kg + np.where(chain.inverse_rear_1_kg > 0, 1 / chain.front_kg, 0.0)
    matrix = np.zeros((inverse.size, 2, 2))
    matrix[:, 0, 1] = 1.0
    matrix[:, 1, 0], matrix[:, 1, 1] = -inverse * chain.neck_n_m, -inverse * chain.neck_n_s_m
    return matrix


def _joint(chain: Chain) -> Floats:
    """(impacts, 2, 2) of the joint's compression and the anvil's velocity; the plate's end moves with joint / Z."""
    loss = 1 + chain.joint_n_s_m * chain.plate_mobility_m_n_s
    stiffness, damping = chain.joint_n_m / loss, chain.joint_n_s_m / loss
    matrix = np.zeros((loss.size, 2, 2))
    matrix[:, 0, 0] = -chain.plate_mobility_m_n_s * stiffness
    matrix[:, 0, 1] = 1 - chain.plate_mobility_m_n_s * damping
    matrix[:, 1, 0], matrix[:, 1, 1] = -chain.inverse_anvil_1_kg * stiffness, -chain.inverse_anvil_1_kg * damping
    return matrix


def _histories(matrix: Floats, start: Floats, count: int, step: float) -> Floats:
    """(count, 2, impacts): states 1 to `count`, doubled in length with every product."""
    from scipy.linalg import expm

    advance = np.asarray(expm(matrix * step), dtype=np.float64)
    states = np.einsum("ijk,ki->ij", advance, start)[None]
    while states.shape[0] < count:
        states = np.concatenate([states, np.einsum("ijk,nik->nij", advance, states)])
        advance = advance @ advance
    return np.asarray(states[:count].transpose(0, 2, 1))
