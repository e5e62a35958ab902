"""`Chain.motion` and the Runge-Kutta steps of `integrate`, compiled, for one impact at a time.

The contact forces of many impacts alone: those of `strike_many`, as the compiled solver has them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit

from ...array_types import Floats
from ..effects import Effects
from .build import Impactor, ImpactTarget
from .chain import FULLY_PLASTIC, ONSET_SHARE, TIP_REFERENCE, Chain
from .integrate import CREEPING, LOOK, assemble, longest_s, steps_for

_SMALLEST_M = 1e-12
# fmt: off
(K, YIELD_M, SLOPE_N_M, RADIUS_M, HEIGHT_M, TIP_SHARE, FRONT_KG, REAR_1_KG, NECK_N_M, NECK_N_S_M,
ANVIL_1_KG,
 JOINT_N_M, JOINT_N_S_M, MOBILITY, RELAXING, RELAX_S, LAYER, LAYER_N_M2, SEATING_N, LIMIT_M,
 RETARD_S) = range(21)
# fmt: on


def figures_of(chain: Chain) -> Floats:
    """The figures (impacts, 21) of a chain in the order of the names above."""
    law = chain.law
    rows = (
        law.stiffness,
        law.yield_m,
        law.plastic_slope,
        law.radius_m,
        law.tip_height_m,
        law.tip_share,
        chain.front_kg,
        chain.inverse_rear_1_kg,
        chain.neck_n_m,
        chain.neck_n_s_m,
        chain.inverse_anvil_1_kg,
        chain.joint_n_m,
        chain.joint_n_s_m,
        chain.plate_mobility_m_n_s,
        chain.relaxing,
        chain.relaxation_s,
        chain.layer_share,
        chain.layer_n_m2,
        chain.layer_seating_n,
        chain.layer_limit_m,
        chain.retardation_s,
    )
    return np.ascontiguousarray(np.array(rows, dtype=np.float64).T)


@njit(cache=True, error_model="numpy")
def _shape(depth: float, share: float) -> float:
    if share < 0:
        linear = -math.pi / 4 * share
        radius = 2 * depth / (linear + math.sqrt(linear**2 + 4 * (1 + share) * depth))
        sharper: float = (1 + share + 3 / 4 * linear / radius) * (radius**2 / depth) ** 1.5
        return sharper
    area = 2 * depth / (1 - share + math.sqrt((1 - share) ** 2 + 16 / 3 * share * depth))
    flatter: float = (area / depth) ** 1.5 * (1 - share + 8 / 5 * share * area)
    return flatter


@njit(cache=True, error_model="numpy")
def _contact(indentation: float, deepest: float, f: Floats) -> float:
    top = max(indentation, deepest)
    hertz = f[K] * top * math.sqrt(top)
    loading, wider = hertz, 1.0
    if top > f[YIELD_M]:
        depth = top / f[YIELD_M]
        transition = min((depth - 1) / (FULLY_PLASTIC - 1), 1.0)
        wider = 1 + transition**2 * (3 - 2 * transition)
        pressure = min(1 - (1 - ONSET_SHARE) * (1 - math.log(depth) / math.log(FULLY_PLASTIC)), 1.0)
        loading = f[SLOPE_N_M] / 2 * top * wider * pressure
    spring_back = max(
        top * loading / max(hertz * math.sqrt(wider), 2.2250738585072014e-308), _SMALLEST_M
    )
    share = max(1 - (top - indentation) / spring_back, 0.0)
    force: float = loading * share * math.sqrt(share)
    if force == 0.0 or (math.isinf(f[HEIGHT_M]) and f[TIP_SHARE] == 0.0):
        return force
    depth = max(indentation, _SMALLEST_M)
    chi = math.sqrt(f[RADIUS_M] * depth) / f[HEIGHT_M]
    finite = 1 + chi * (1.133 + chi * (1.283 + chi * (0.769 + chi * 0.0975)))
    corrected: float = force * finite * _shape(depth / (TIP_REFERENCE * f[RADIUS_M]), f[TIP_SHARE])
    return corrected


@njit(cache=True, error_model="numpy")
def _motion(s: Floats, deepest: float, f: Floats, rates: Floats, seen: Floats) -> None:
    """Rates (9,) of the state (9,); seen: contact and plate force, front and rear acceleration,
    indentation (5,)."""
    anvil = f[ANVIL_1_KG] > 0
    indentation = s[0] - (s[4] if anvil else s[6])
    if f[LAYER] > 0:
        pressed = max(s[7], 0.0) + f[SEATING_N]
        depth = (math.sqrt(pressed) - math.sqrt(f[SEATING_N])) / math.sqrt(f[LAYER_N_M2])
        indentation -= f[LAYER] * depth / (1 + depth / f[LIMIT_M])
    elastic = _contact(indentation, deepest, f)
    force = max(elastic + f[RELAXING] * (elastic - s[8]), 0.0)
    neck = f[NECK_N_M] * (s[2] - s[0]) + f[NECK_N_S_M] * (s[3] - s[1])
    joint = f[JOINT_N_M] * (s[4] - s[6]) + f[JOINT_N_S_M] * s[5]
    joint = joint / (1 + f[JOINT_N_S_M] * f[MOBILITY])
    plate = joint if anvil else force
    front = (force - neck) / f[FRONT_KG]
    rear = front if f[REAR_1_KG] == 0 else neck * f[REAR_1_KG]
    rates[0], rates[1], rates[2], rates[3] = s[1], -front, s[3], -rear
    rates[4], rates[5] = s[5], (force - joint) * f[ANVIL_1_KG]
    rates[6] = f[MOBILITY] * plate
    rates[7] = (force - s[7]) / f[RETARD_S]
    rates[8] = (elastic - s[8]) / f[RELAX_S]
    seen[0], seen[1], seen[2], seen[3], seen[4] = force, plate, front, rear, indentation


@njit(cache=True)
def _moved(state: Floats, step: float, rates: Floats, there: Floats) -> None:
    for i in range(9):
        there[i] = state[i] + step * rates[i]


@njit(cache=True, error_model="numpy")
def run(
    f: Floats, speed: float, step: float, limit: int, look: int, creeping: float
) -> tuple[int, Floats, Floats]:
    """Steps until an impactor has let go (0: not within `limit`), the state (9,) then, histories
    (4, steps)."""
    state, k1, k2, k3, k4 = np.zeros(9), np.empty(9), np.empty(9), np.empty(9), np.empty(9)
    seen, unused, there = np.empty(5), np.empty(5), np.empty(9)
    state[1] = state[3] = speed
    share = 1.0 if f[REAR_1_KG] == 0 else f[FRONT_KG] / (f[FRONT_KG] + 1 / f[REAR_1_KG])
    history = np.empty((4, 1024))
    deepest, peak, last, count = 0.0, 0.0, 0, 0
    while count <= limit:
        _motion(state, deepest, f, k1, seen)
        if count == history.shape[1]:
            longer = np.empty((4, 2 * count))
            for row in range(4):
                for i in range(count):
                    longer[row, i] = history[row, i]
            history = longer
        for row in range(4):
            history[row, count] = seen[row]
        count += 1
        peak, deepest = max(peak, seen[0]), max(deepest, seen[4])
        if seen[0] > creeping * peak:
            last = count
        if count % look == 0:
            moving = share * state[1] + (1 - share) * state[3]
            if (seen[0] == 0 and moving < 0) or count > 1.3 * last:
                return count, state, history[:, :count]
        _moved(state, step / 2, k1, there)
        _motion(there, deepest, f, k2, unused)
        _moved(state, step / 2, k2, there)
        _motion(there, deepest, f, k3, unused)
        _moved(state, step, k3, there)
        _motion(there, deepest, f, k4, unused)
        for i in range(9):
            state[i] += step / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i])
    return 0, state, history[:, :count]


def contact_forces(
    impactors: Sequence[Impactor],
    targets: Sequence[ImpactTarget],
    effects: Effects,
    velocities_m_s: Floats,
    rng: np.random.Generator,
    *,
    steps_per_contact: int = 250,
) -> list[tuple[float, Floats]]:
    """Of each impact the step (s) and the force (n,) in N between tip and target, from first
    contact until it lets go.

    Raises `RuntimeError` as `strike_many` does.
    """
    chain = assemble(impactors, targets, effects, rng)
    steps = steps_for(chain, velocities_m_s, steps_per_contact)
    limits = (longest_s(chain, velocities_m_s) / steps).astype(np.int64)
    forces = []
    for figures, speed, step, limit in zip(
        figures_of(chain), velocities_m_s, steps, limits, strict=True
    ):
        count, _, history = run(
            figures, float(speed), float(step), int(limit) + LOOK, LOOK, CREEPING
        )
        if not count:
            raise RuntimeError(f"an impact at {speed!r} m/s has not ended after {limit} steps")
        forces.append((float(step), history[0]))
    return forces
