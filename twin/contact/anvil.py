"""Impacts on an anvil: a mass on the spring of its joint, between the tip and the plate.

The force on the plate is the joint's. A tip that is stiffer than the joint leaves the anvil moving
before the plate has felt much of it, and may strike it again.

The compiled motion of an impactor, an anvil and the plate below it, in an impact's own units
(`integrate_contact.py`).

xi indentation, eta the impactor's velocity, nu the anvil's, d how far the joint is pressed: the
contact's force phi follows from xi and the rate of approach eta - nu as on a plate, eta' = -phi,
nu' = (phi - j) / M, d' = nu - Y j, with the joint's force j = (K d + C nu) / (1 + C Y). The steps
are those of the classical Runge-Kutta method of order 4.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numba import njit

from ...array_types import Floats
from ..contact_interface import ForcePulses
from .impacts import Impacts
from .integrate_contact import Numbers, own_time, scales
from .kernel import Law, rates, unloading

#: Share of critical damping of an anvil on its joint: bolted joints have a few hundredths.
_JOINT_DAMPING = 0.05
#: Most periods of the joint in a contact's own time: stiffer ones follow the contact, and would
#: take very many steps.
_PERIODS = 40.0


def anvil_pulses(
    impacts: Impacts,
    anvil_mass_kg: Floats,
    joint_stiffness_n_m: Floats,
    plate_mobility_m_n_s: Floats,
    phases: int,
    *,
    at_tip: bool = False,
) -> ForcePulses:
    """Forces on the plate (n, phases) at equal phases of the pulse about the highest peak, which
    ends at 0.5 % of it.

    `at_tip`: forces between tip and anvil, as the load cell of a hammer feels them.
    `plate_mobility_m_n_s` (n,) is that of the plate below the joint; `impacts` have what the
    contact itself loses. A joint whose period is shorter than a fortieth of the contact is taken to
    have that period.
    """

    numbers = Numbers.of(impacts)
    length, force = scales(impacts)
    velocity = impacts.bodies.impact_velocity_m_s
    contact = own_time(numbers) * length / velocity
    lighter = np.minimum(anvil_mass_kg, impacts.mass_kg)
    joint_stiffness_n_m = np.minimum(
        joint_stiffness_n_m, lighter * (2 * np.pi * _PERIODS / contact) ** 2
    )
    damping = 2 * _JOINT_DAMPING * np.sqrt(joint_stiffness_n_m * anvil_mass_kg)
    figures = [
        *(getattr(numbers, item.name) for item in fields(numbers)),
        own_time(numbers),
        anvil_mass_kg / impacts.mass_kg,
        joint_stiffness_n_m * length / force,
        damping * velocity / force,
        plate_mobility_m_n_s * force / velocity,
    ]
    solved, course = struck_anvils(np.stack(figures, axis=1), at_tip, phases)
    time = solved[:, 0] * length / velocity
    turn = np.clip(solved[:, 1], 0.01 * solved[:, 0], 0.999 * solved[:, 0]) * length / velocity
    return ForcePulses(time, course * force[:, None], turn)


#: Steps of the contact's own time, and of a period of the anvil on its joint.
_OF_CONTACT, _OF_PERIOD = 24.0, 16.0
#: Most steps, and the share of the peak force at which a pulse ends, as measured ones do.
_MOST, _END = 20_000, 0.005


@njit(cache=True, nogil=True, error_model="numpy")
def _flow(law, mass, stiffness, damping, mobility, depth, velocity, anvil, joint):  # type: ignore[no-untyped-def]
    """Rates of the four states, the joint's force and the contact's."""
    now = rates(law, depth, velocity - anvil)
    force = now.force if now.force > 0.0 else 0.0
    carried = (stiffness * joint + damping * anvil) / (1.0 + damping * mobility)
    return (
        now.indentation,
        -force,
        (force - carried) / mass,
        anvil - mobility * carried,
        carried,
        force,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _history(row, at_tip, time, force):  # type: ignore[no-untyped-def]
    """The joint's force, or the contact's `at_tip`, after each step into `time` and `force`.

    Returns how many, and when the indentation first turns: less than 0 where it does not.
    """
    loading = Law(row[0], 1.0, 0.0, row[5], row[1], row[2], row[3], row[4], row[6])
    own_time, mass, stiffness, damping, mobility = row[7], row[8], row[9], row[10], row[11]
    period = 2.0 * np.pi * np.sqrt(min(mass, 1.0) / stiffness)
    slow = period / _OF_PERIOD
    if mobility > 0.0:  # the joint relaxes on the plate, too: longer steps would not be stable
        slow = min(slow, 1.5 * (1.0 + damping * mobility) / (stiffness * mobility))
    fast = min(slow, own_time / _OF_CONTACT)
    law, unloaded, deepest, turn = loading, False, 0.0, -1.0
    depth, velocity, anvil, joint = 0.0, 1.0, 0.0, 0.0
    time[0], force[0] = 0.0, 0.0
    peak, count = 0.0, 1
    x1, v1, a1, j1, carried, contact = _flow(
        law, mass, stiffness, damping, mobility, depth, velocity, anvil, joint
    )
    while count < _MOST:
        size = fast if contact > 0.0 or depth >= -0.01 * deepest else slow
        half = 0.5 * size
        x2, v2, a2, j2, _, _ = _flow(law, mass, stiffness, damping, mobility, depth + half * x1,
        velocity + half * v1,
                                     anvil + half * a1, joint + half * j1)  # fmt: skip
        x3, v3, a3, j3, _, _ = _flow(law, mass, stiffness, damping, mobility, depth + half * x2,
        velocity + half * v2,
                                     anvil + half * a2, joint + half * j2)  # fmt: skip
        x4, v4, a4, j4, _, _ = _flow(law, mass, stiffness, damping, mobility, depth + size * x3,
        velocity + size * v3,
                                     anvil + size * a3, joint + size * j3)  # fmt: skip
        sixth = size / 6.0
        depth += sixth * (x1 + 2.0 * (x2 + x3) + x4)
        velocity += sixth * (v1 + 2.0 * (v2 + v3) + v4)
        anvil += sixth * (a1 + 2.0 * (a2 + a3) + a4)
        joint += sixth * (j1 + 2.0 * (j2 + j3) + j4)
        if unloaded and depth > deepest:
            law, unloaded = loading, False
        x1, v1, a1, j1, carried, contact = _flow(
            law, mass, stiffness, damping, mobility, depth, velocity, anvil, joint
        )
        if not unloaded and x1 <= 0.0 and depth > deepest:
            deepest, unloaded = depth, True
            law = unloading(loading, deepest)
            if turn < 0.0:
                turn = time[count - 1] + size
            x1, v1, a1, j1, carried, contact = _flow(
                law, mass, stiffness, damping, mobility, depth, velocity, anvil, joint
            )
        time[count], force[count] = time[count - 1] + size, contact if at_tip else carried
        peak = max(peak, force[count])
        count += 1
        if unloaded and force[count - 1] < _END * peak and contact <= _END * peak:
            break
    return count, turn


@njit(cache=True, nogil=True, error_model="numpy")
def struck_anvils(figures, at_tip, phases):  # type: ignore[no-untyped-def]
    """Pulses below anvils of `figures` (n, 12): the columns of `Numbers`, the contact's own time,
    M, K, C and Y.

    Returns (n, 3) length of the pulse, time of the turn, peak force, and the force (n, phases) at
    equal phases of it.
    """
    n = len(figures)
    pulses, forces = np.empty((n, 3)), np.zeros((n, phases))
    time, force = np.empty(_MOST), np.empty(_MOST)
    for i in range(n):
        count, turn = _history(figures[i], at_tip, time, force)
        top = 0
        for k in range(count):
            if force[k] > force[top]:
                top = k
        least = _END * force[top]
        first, last = top, top
        while first > 0 and force[first - 1] > least:
            first -= 1
        while last < count - 1 and force[last] > least:
            last += 1
        begin = time[first - 1] if first > 0 else time[first]
        end = time[last]
        if last > top and force[last] < least:
            end -= (
                (least - force[last])
                / (force[last - 1] - force[last])
                * (time[last] - time[last - 1])
            )
        length = end - begin
        pulses[i, 0], pulses[i, 1], pulses[i, 2] = (
            length,
            (time[top] if turn < 0.0 else turn) - begin,
            force[top],
        )
        k = max(first - 1, 0)
        for p in range(1, phases - 1):
            at = begin + length * p / (phases - 1)
            while k < last - 1 and time[k + 1] <= at:
                k += 1
            share = (at - time[k]) / (time[k + 1] - time[k])
            value = force[k] + share * (force[k + 1] - force[k])
            forces[i, p] = value if value > 0.0 else 0.0
    return pulses, forces
