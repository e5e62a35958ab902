"""The chain of masses in time, compiled: Runge-Kutta of fourth order, one impact at a time.

States: front and rear mass, anvil and plate surface (positions x in m, velocities v in m/s), u the
force (N) that has settled in the insulator, w the elastic contact force (N) that has relaxed.

- Contact: F = Fe + r (Fe - w), tau dw/dt = Fe - w, never below 0. That is a Hertz contact of a body
  whose modulus relaxes (Lee and Radok, J. Appl. Mech. 27 (1960) 438), with Fe elastic-plastic.
- Insulator: a foundation, u = pi M R d^2 / h (Johnson, Contact Mechanics, 1985, section 4.3), that
  follows with a retardation, tau du/dt = F - u. It sits under a small force, without which it would
  have no stiffness at first touch, and depth d is bounded by what of the sheet can be crushed.
- Plate: dx/dt = P / Z under the force P that reaches it, and what of earlier force comes back from
  its edges (`echoes.py`), where that is asked for.

Force over indentation: elastic-plastic, of a finite tip.

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

import math

import numpy as np
from numba import njit

from ...array_types import Floats

#: Mean pressure at which yield begins over the hardness, and d2 / d1.
ONSET_SHARE, FULLY_PLASTIC = 0.4, 54.0
#: b^2 / R^2.
_TIP_REFERENCE = 0.1
_SMALLEST_M = 1e-12  # the factor g divides by the depth; here the force is none
_STATES = 9

#: The figures of one impact in this order, those of the contact's law first.
# fmt: off
(K, YIELD_M, SLOPE_N_M, RADIUS_M, HEIGHT_M, TIP_SHARE, FRONT_KG, REAR_1_KG, NECK_N_M, NECK_N_S_M,
ANVIL_1_KG,
 JOINT_N_M, JOINT_N_S_M, MOBILITY, RELAXING, RELAX_S, LAYER, LAYER_N_M2, SEATING_N, LIMIT_M,
 RETARD_S) = range(21)
# fmt: on

#: Share of the peak force below which an impactor that no longer bounces but creeps along with the
#: plate counts as having let go: the threshold at which the thesis ends a pulse (section 4.1).
CREEPING = 0.005
_LOOK = 16  # steps between two looks at whether the impactor has let go
_PRESSED = 1.3  # an impactor that has not pressed for this share of its time presses no more
# of the time until the last touch: a plate that rings may meet the impactor again until then
_APART = 1.5
#: What `run` counts where the impactor has not let go, or the table of echoes is too short.
UNENDED, SHORT_ECHO = 0, -1


@njit(cache=True, error_model="numpy")
def _shape(depth: float, share: float) -> float:
    """Force over the ball's at a depth in units of b^2 / R.

    From the contact's area in units of pi b^2 for a worn tip, from its radius in units of b for a
    pointed one.
    """
    if share < 0:
        linear = -math.pi / 4 * share
        radius = 2 * depth / (linear + math.sqrt(linear**2 + 4 * (1 + share) * depth))
        sharper: float = (1 + share + 3 / 4 * linear / radius) * (radius**2 / depth) ** 1.5
        return sharper
    area = 2 * depth / (1 - share + math.sqrt((1 - share) ** 2 + 16 / 3 * share * depth))
    flatter: float = (area / depth) ** 1.5 * (1 - share + 8 / 5 * share * area)
    return flatter


@njit(cache=True, error_model="numpy")
def correction(indentation: float, f: Floats) -> float:
    """The factor g of finite height and of the tip's shape.

    Parameters:
        indentation: The indentation in m.
        f: The figures of the impact in SI, of shape `(21,)`, or those of its law alone, `(6,)`.
    """
    depth = max(indentation, _SMALLEST_M)
    chi = math.sqrt(f[RADIUS_M] * depth) / f[HEIGHT_M]
    finite = 1 + chi * (1.133 + chi * (1.283 + chi * (0.769 + chi * 0.0975)))
    factor: float = finite * _shape(depth / (_TIP_REFERENCE * f[RADIUS_M]), f[TIP_SHARE])
    return factor


@njit(cache=True, error_model="numpy")
def elastic_force(indentation: float, deepest: float, f: Floats) -> float:
    """The force (N) of the contact without relaxation, 0 where it does not touch.

    Parameters:
        indentation: The indentation in m.
        deepest: The deepest indentation before, in m.
        f: The figures of the impact in SI, of shape `(21,)`, or those of its law alone, `(6,)`.
    """
    top = max(indentation, deepest)
    hertz = f[K] * top * math.sqrt(top)
    loading, wider = hertz, 1.0
    if top > f[YIELD_M]:
        depth = top / f[YIELD_M]
        transition = min((depth - 1) / (FULLY_PLASTIC - 1), 1.0)
        wider = 1 + transition**2 * (3 - 2 * transition)
        pressure = min(1 - (1 - ONSET_SHARE) * (1 - math.log(depth) / math.log(FULLY_PLASTIC)), 1.0)
        loading = f[SLOPE_N_M] / 2 * top * wider * pressure
    # A Hertzian contact of this radius springs back by as much as it was pressed in: by 3 F /
    # (4 E* a).
    spring_back = max(
        top * loading / max(hertz * math.sqrt(wider), 2.2250738585072014e-308), _SMALLEST_M
    )
    share = max(1 - (top - indentation) / spring_back, 0.0)
    force: float = loading * share * math.sqrt(share)
    if force == 0.0 or (math.isinf(f[HEIGHT_M]) and f[TIP_SHARE] == 0.0):
        return force
    return force * correction(indentation, f)


@njit(cache=True, error_model="numpy")
def _motion(
    s: Floats, deepest: float, f: Floats, echo_m_s: float, rates: Floats, seen: Floats
) -> None:
    """Rates (9,) of the state (9,); seen: contact and plate force, front and rear acceleration that
    slow the impactor down, and indentation (5,).

    `echo_m_s` is the velocity that earlier force has given the plate's surface by its edges.
    """
    anvil = f[ANVIL_1_KG] > 0
    indentation = s[0] - (s[4] if anvil else s[6])
    if f[LAYER] > 0:
        pressed = max(s[7], 0.0) + f[SEATING_N]
        depth = (math.sqrt(pressed) - math.sqrt(f[SEATING_N])) / math.sqrt(f[LAYER_N_M2])
        indentation -= f[LAYER] * depth / (1 + depth / f[LIMIT_M])
    elastic = elastic_force(indentation, deepest, f)
    force = max(elastic + f[RELAXING] * (elastic - s[8]), 0.0)
    neck = f[NECK_N_M] * (s[2] - s[0]) + f[NECK_N_S_M] * (s[3] - s[1])
    joint = f[JOINT_N_M] * (s[4] - s[6]) + f[JOINT_N_S_M] * (s[5] - echo_m_s)
    joint = joint / (1 + f[JOINT_N_S_M] * f[MOBILITY])  # its plate end moves with joint / Z
    plate = joint if anvil else force
    front = (force - neck) / f[FRONT_KG]
    rear = front if f[REAR_1_KG] == 0 else neck * f[REAR_1_KG]
    rates[0], rates[1], rates[2], rates[3] = s[1], -front, s[3], -rear
    rates[4], rates[5] = s[5], (force - joint) * f[ANVIL_1_KG]
    rates[6] = f[MOBILITY] * plate + echo_m_s
    rates[7] = (force - s[7]) / f[RETARD_S]
    rates[8] = (elastic - s[8]) / f[RELAX_S]
    seen[0], seen[1], seen[2], seen[3], seen[4] = force, plate, front, rear, indentation


@njit(cache=True)
def _moved(state: Floats, step: float, rates: Floats, there: Floats) -> None:
    for i in range(_STATES):
        there[i] = state[i] + step * rates[i]


@njit(cache=True)
def _echo(answer: Floats, plate: Floats, count: int, late: int) -> float:
    """The sum of the answers to the first `count` forces on the plate, `late` steps after the last
    of them."""
    total = 0.0
    for i in range(count):
        total += answer[count - 1 - i + late] * plate[i]
    return total


@njit(cache=True, error_model="numpy")
def run(
    f: Floats, speed: float, step: float, limit: int, answer: Floats
) -> tuple[int, Floats, Floats]:
    """One impact from first contact until the impactor has let go.

    Parameters:
        f: The figures of the impact in SI, of shape `(21,)`.
        speed: The speed of the impactor at first contact, in m/s.
        step: The time step in s.
        limit: The largest number of steps.
        answer: The echo's answer to the force of one step, in m/s for 1 N, at whole steps after it;
            of shape `(n,)`. An empty one stands for a plate without edges.

    Returns:
        The number of steps n, or `UNENDED` where the impactor has not let go within the limit, or
        `SHORT_ECHO` where `answer` does not reach as far; the state at the end, of shape `(9,)`;
        and force of the contact and on the plate and acceleration of front and rear, `(4, n)`.
    """
    state, k1, k2, k3, k4 = np.zeros(9), np.empty(9), np.empty(9), np.empty(9), np.empty(9)
    seen, unused, there = np.empty(5), np.empty(5), np.empty(9)
    state[1] = state[3] = speed
    share = 1.0 if f[REAR_1_KG] == 0 else f[FRONT_KG] / (f[FRONT_KG] + 1 / f[REAR_1_KG])
    history = np.empty((4, 1024))
    deepest, peak, last, count = 0.0, 0.0, 0, 0
    now = soon = 0.0  # echoes at this step and at the next
    while count <= limit:
        _motion(state, deepest, f, soon, k1, seen)
        if count == history.shape[1]:
            longer = np.empty((4, 2 * count))
            longer[:, :count] = history
            history = longer
        for row in range(4):
            history[row, count] = seen[row]
        count += 1
        if answer.size > 0:
            if count >= answer.size:
                return SHORT_ECHO, state, history[:, :count]
            # Trapezoid rule: the force begins at 0, and goes on as it did.
            plate = history[1]
            former_force_n = plate[count - 2] if count > 1 else seen[1]
            now = _echo(answer, plate, count, 0) - 0.5 * answer[0] * seen[1]
            soon = _echo(answer, plate, count, 1) + 0.5 * answer[0] * (2 * seen[1] - former_force_n)
        peak, deepest = max(peak, seen[0]), max(deepest, seen[4])
        if seen[0] > CREEPING * peak:
            last = count
        if count % _LOOK == 0:
            if answer.size > 0:
                over = count > _APART * last
            else:  # bounced back, or pressing no more for a good while
                moving = share * state[1] + (1 - share) * state[3]
                over = (seen[0] == 0 and moving < 0) or count > _PRESSED * last
            if over:
                return count, state, history[:, :count]
        middle = (now + soon) / 2
        _moved(state, step / 2, k1, there)
        _motion(there, deepest, f, middle, k2, unused)
        _moved(state, step / 2, k2, there)
        _motion(there, deepest, f, middle, k3, unused)
        _moved(state, step, k3, there)
        _motion(there, deepest, f, soon, k4, unused)
        for i in range(_STATES):
            state[i] += step / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i])
    return UNENDED, state, history[:, :count]
