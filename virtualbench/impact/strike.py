"""One strike, or many at once: `strike` and `strike_many`.

What rings on when the contact is over: the rear of the impactor on its neck, the anvil on its
joint.

Nothing acts any more and all links are linear: the states follow from a matrix exponential,
exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...array_types import Floats
from ..effects import Effects
from .build import Impactor, ImpactTarget
from .chain import Chain
from .echoes import PlateEchoes
from .integrate import ImpactHistories, assemble, solve
from .kernel import CREEPING


def ringing(chain: Chain, state: Floats, duration_s: float, step_s: float) -> tuple[Floats, Floats]:
    """Acceleration (m/s2) of the rear and force (N) on the plate after the contact, both `(n,
    impacts)`.

    The acceleration is the one that slows the impactor down, and 0 for a rigid one.

    Parameters:
        chain: The impactors and their targets.
        state: The states at the end of the contact, of shape `(states, impacts)`, in SI.
        duration_s: How long both are followed, from `state` on.
        step_s: The time between two steps; the first step of both is this long after `state`.
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
    inverse = chain.inverse_rear_1_kg + np.where(
        chain.inverse_rear_1_kg > 0, 1 / chain.front_kg, 0.0
    )
    matrix = np.zeros((inverse.size, 2, 2))
    matrix[:, 0, 1] = 1.0
    matrix[:, 1, 0], matrix[:, 1, 1] = -inverse * chain.neck_n_m, -inverse * chain.neck_n_s_m
    return matrix


def _joint(chain: Chain) -> Floats:
    """(impacts, 2, 2) of the joint's compression and the anvil's velocity; the plate's end moves
    with joint / Z."""
    loss = 1 + chain.joint_n_s_m * chain.plate_mobility_m_n_s
    stiffness, damping = chain.joint_n_m / loss, chain.joint_n_s_m / loss
    matrix = np.zeros((loss.size, 2, 2))
    matrix[:, 0, 0] = -chain.plate_mobility_m_n_s * stiffness
    matrix[:, 0, 1] = 1 - chain.plate_mobility_m_n_s * damping
    matrix[:, 1, 0], matrix[:, 1, 1] = (
        -chain.inverse_anvil_1_kg * stiffness,
        -chain.inverse_anvil_1_kg * damping,
    )
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


#: Step of the grid on which a strike is reported: 2 MHz, far above any recorder of the bench.
STEP_S = 0.5e-6


@dataclass(frozen=True)
class ImpactTruth:
    """What happened in one impact; arrays are (n,) on a uniform grid from first contact.

    `force_n` acts between tip and target, `plate_force_n` is what of it reaches the resonant plate
    (the same without an anvil), `cell_force_n` what the load cell between tip and front mass feels.
    The acceleration is that at the impactor's rear, late by the wave's way there, and positive when
    it slows the impactor down. `restitution` is the speed at which the impactor flies back over
    that of the impact; an impactor that follows the plate has a negative one. An impact without
    rebound ends when the force has fallen to 0.5 % of its peak.
    """

    time_s: Floats
    force_n: Floats
    plate_force_n: Floats
    cell_force_n: Floats
    impactor_acceleration_m_s2: Floats
    contact_time_s: float
    restitution: float
    peak_force_n: float
    velocity_m_s: float
    mass_kg: float  # with what this strike's hand and the effects made of it
    contacts: int  # more than one when the impactor hit again at once


def strike(
    impactor: Impactor,
    target: ImpactTarget,
    effects: Effects,
    velocity_m_s: float,
    rng: np.random.Generator,
) -> ImpactTruth:
    """One impact.

    Parameters:
        impactor: What strikes.
        target: What is struck.
        effects: Which effects act, and how strongly.
        velocity_m_s: The speed of the impact, above 0.
        rng: Generator of random numbers, for the scatter of this strike.

    Raises:
        ValueError: As `strike_many` raises it.
    """
    return strike_many([impactor], [target], effects, [velocity_m_s], rng)[0]


def strike_many(
    impactors: Sequence[Impactor],
    targets: Sequence[ImpactTarget],
    effects: Effects,
    velocities_m_s: ArrayLike,
    rng: np.random.Generator,
    *,
    steps_per_contact: int = 250,
    tail_s: float = 4e-3,
    echoes: PlateEchoes | None = None,
) -> list[ImpactTruth]:
    """As many impacts as there are impactors.

    Parameters:
        impactors: What strikes.
        targets: What is struck by each impactor.
        effects: Which effects act, and how strongly.
        velocities_m_s: The speed of each impact, of shape `(impacts,)`, above 0.
        rng: Generator of random numbers, for the scatter of each strike.
        steps_per_contact: The number of time steps in the duration of an elastic contact with a
            rigid target, 20 or more; 250 by default. Where a link of the chain is quicker, the
            steps are shorter.
        tail_s: How long the records go on after contact, while hammer and anvil ring; 4 ms by
            default.
        echoes: Those of the plate at the point that all impactors strike. They act as far as
            `contact.plate_compliance` does, and no more once the impactor has let go. By default
            there are none: the plate has no edges while the impactors touch it.

    Raises:
        ValueError: For numbers of impactors, targets and speeds that differ, for speeds that are
            not above 0, and for too few steps or a negative time.
        RuntimeError: For an impact that does not end.
    """
    velocity = np.asarray(velocities_m_s, dtype=np.float64)
    if (
        not len(impactors) == len(targets) == velocity.size
        or velocity.ndim != 1
        or not len(impactors)
    ):
        raise ValueError(
            f"{len(impactors)} impactors, {len(targets)} targets, speeds of shape {velocity.shape}"
        )
    if not np.all((velocity > 0) & np.isfinite(velocity)):
        raise ValueError(f"velocities_m_s = {velocity.tolist()}: expected finite numbers above 0")
    if steps_per_contact < 20 or not 0 <= tail_s < np.inf:
        raise ValueError(
            f"steps_per_contact = {steps_per_contact!r}, tail_s = {tail_s!r}: "
            f"expected 20 or more, 0 or more"
        )
    chain = assemble(impactors, targets, effects, rng)
    solution = solve(chain, velocity, steps_per_contact=steps_per_contact, echoes=echoes)
    rear, plate = ringing(chain, solution.state, tail_s, STEP_S)
    return [
        _truth(
            index,
            impactor,
            float(velocity[index]),
            chain,
            solution,
            (rear[:, index], plate[:, index]),
        )
        for index, impactor in enumerate(impactors)
    ]


def _truth(
    index: int,
    impactor: Impactor,
    velocity: float,
    chain: Chain,
    solution: ImpactHistories,
    tail: tuple[Floats, Floats],
) -> ImpactTruth:
    step, end = float(solution.step_s[index]), int(solution.ends[index])
    force = solution.contact_force_n[:end, index]
    solved = step * np.arange(end)
    time = STEP_S * np.arange(int(solved[-1] / STEP_S) + tail[0].size)
    tail_time = solved[-1] + STEP_S * np.arange(1, tail[0].size + 1)

    def sampled(history: Floats, after: Floats, delay: float = 0.0) -> Floats:
        whole_history = np.concatenate([history[:end, index], after])
        return np.asarray(
            np.interp(time - delay, np.concatenate([solved, tail_time]), whole_history, left=0.0)
        )

    # In free flight the neck pulls front and rear with equal and opposite forces.
    inverse = float(chain.inverse_rear_1_kg[index])
    front_over_rear = -1 / (inverse * float(chain.front_kg[index])) if inverse else 0.0
    silence = np.zeros_like(tail[0])
    contact = sampled(solution.contact_force_n, silence)
    front = sampled(solution.front_m_s2, tail[0] * front_over_rear)
    duration, contacts = _contact(force, step, 1.0 if chain.relaxing[index] > 0 else 1.5)
    return ImpactTruth(
        time_s=np.asarray(time, dtype=np.float64),
        force_n=contact,
        plate_force_n=sampled(solution.plate_force_n, tail[1]),
        cell_force_n=contact - impactor.tip_mass_kg * front,
        impactor_acceleration_m_s2=sampled(solution.rear_m_s2, tail[0], impactor.wave_delay_s),
        contact_time_s=duration,
        restitution=-float(chain.velocity(solution.state)[index]) / velocity,
        peak_force_n=float(force.max()),
        velocity_m_s=velocity,
        mass_kg=float(chain.mass_kg[index]),
        contacts=contacts,
    )


def _contact(force: Floats, step: float, power: float) -> tuple[float, int]:
    """Duration (s) from first contact to the last instant of contact, and the number of separate
    contacts.

    An end at force 0 lies between two steps: there the force falls as (t_end - t)^power, 1.5 for an
    elastic contact and 1 for a relaxing one, which lets go before it has sprung back.
    """
    pressing = force > CREEPING * force.max()
    last = int(np.flatnonzero(pressing)[-1])
    contacts = int(np.count_nonzero(np.diff(pressing.astype(int)) > 0))
    quiet = np.flatnonzero(force[last:] == 0)
    if not quiet.size:
        return last * step, contacts
    before = last + int(quiet[0]) - 2
    earlier, later = force[before] ** (1 / power), force[before + 1] ** (1 / power)
    share = min(later / (earlier - later), 1.0) if earlier > later else 1.0
    return step * (before + 1 + share), contacts
