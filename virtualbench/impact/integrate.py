"""The chain solved in time: Runge-Kutta of fourth order, a fixed step for each impact, all impacts abreast."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .assemble import hertz_time
from .chain import Chain
from .echoes import EchoHistory, PlateEchoes

__all__ = ["CREEPING", "ImpactHistories", "solve", "steps_for"]

#: Share of the peak force below which an impactor that no longer bounces but creeps along with the plate counts as
#: having let go: the threshold at which the thesis ends a pulse (section 4.1).
CREEPING = 0.005
_LONGEST = 60  # Hertz times, and
_CREEP = 12  # times m / Z, the pace of an impactor that a plate slows down; a later end means that something is wrong
_DAMPED_STEP = 1.2  # of the fastest time constant; the fourth-order method is stable up to 2.7
_SWINGING_STEP = 0.4  # of the radian of the fastest mode
LOOK = 16  # steps between two looks at what has ended
_APART = 1.5  # of the time until the last touch: a plate that rings may meet the impactor again until then


@dataclass(frozen=True)
class ImpactHistories:
    """Histories (steps, impacts) at j times `step_s` (impacts,).

    An impact is over after `ends` (impacts,) of the steps, in the state (states, impacts): what its history says
    later is of no use.
    """

    step_s: Floats
    ends: NDArray[np.int64]
    state: Floats
    contact_force_n: Floats
    plate_force_n: Floats
    front_m_s2: Floats
    rear_m_s2: Floats


def steps_for(chain: Chain, velocity_m_s: Floats, steps_per_contact: int) -> Floats:
    """Step (s, (impacts,)): a share of the Hertz time, less where a link of the chain is quicker."""
    rates = (
        steps_per_contact / hertz_time(chain, velocity_m_s),
        _pushed_plate(chain, velocity_m_s) / _DAMPED_STEP,
        chain.layer_rate / _DAMPED_STEP,
        1 / chain.relaxation_s / _DAMPED_STEP,
        np.sqrt(chain.joint_n_m * chain.inverse_anvil_1_kg) / _SWINGING_STEP,
        np.sqrt(chain.neck_n_m * (1 / chain.front_kg + chain.inverse_rear_1_kg)) / _SWINGING_STEP,
    )
    return np.asarray(1 / np.max(rates, axis=0))


def solve(
    chain: Chain, velocity_m_s: Floats, *, steps_per_contact: int, echoes: PlateEchoes | None = None
) -> ImpactHistories:
    """From first contact until every impactor has let go, of speeds (m/s, (impacts,)) above 0.

    `echoes` of the plate that all of them strike act on the contact; without them the plate has no edges.

    Raises `RuntimeError` when one is still pressing after a time that no impact takes.
    """
    step = steps_for(chain, velocity_m_s, steps_per_contact)
    limit = int(np.max(longest_s(chain, velocity_m_s) / step))
    state, deepest = chain.start(velocity_m_s), np.zeros_like(velocity_m_s)
    final, ends = np.zeros_like(state), np.zeros(velocity_m_s.size, dtype=np.int64)
    peak, last = np.zeros_like(deepest), np.zeros_like(deepest)
    history: list[tuple[Floats, ...]] = []
    echo_history = (
        EchoHistory(echoes, step, chain.plate_mobility_m_n_s * echoes.plate_impedance_n_s_m)
        if echoes is not None
        else None
    )
    echo: tuple[Floats | float, Floats | float] = (0.0, 0.0)
    while len(history) <= limit:
        rates, seen = chain.motion(state, deepest, echo[1])
        if echo_history is not None:
            echo = echo_history.add(seen.plate_force_n)
        history.append((seen.contact_force_n, seen.plate_force_n, seen.front_m_s2, seen.rear_m_s2))
        peak = np.maximum(peak, seen.contact_force_n)
        deepest = np.maximum(deepest, seen.indentation_m)
        last = np.where(seen.contact_force_n > CREEPING * peak, len(history), last)
        if len(history) % LOOK == 0:
            if echo_history is None:
                over = _let_go(chain, state, seen.contact_force_n, last, len(history))
            else:
                over = np.asarray(len(history) > _APART * last)
            now = (ends == 0) & over
            final[:, now], ends[now] = state[:, now], len(history)
            if np.all(ends > 0):
                return ImpactHistories(step, ends, final, *(np.array(column) for column in zip(*history, strict=True)))
        state = _stepped(chain, state, rates, deepest, step, echo)
    raise RuntimeError(f"an impact at {velocity_m_s[ends == 0].tolist()} m/s has not ended after {limit} steps")


def longest_s(chain: Chain, velocity_m_s: Floats) -> Floats:
    """A time (s, (impacts,)) that no impact takes."""
    creeping = _CREEP * chain.mass_kg * chain.plate_mobility_m_n_s
    return np.asarray(_LONGEST * hertz_time(chain, velocity_m_s) + creeping)


def _pushed_plate(chain: Chain, velocity_m_s: Floats) -> Floats:
    """How fast (1/s) the plate gives way to what pushes it: the joint of an anvil, or the contact at its stiffest."""
    law = chain.law
    deepest = velocity_m_s * np.maximum(
        hertz_time(chain, velocity_m_s) / 2.943, np.sqrt(2 * chain.mass_kg / np.maximum(law.plastic_slope, 1.0))
    )
    contact = (1 + chain.relaxing) * law.correction(deepest) * 1.5 * law.stiffness * np.sqrt(deepest)
    return np.asarray(np.where(chain.joint_n_m > 0, chain.joint_n_m, contact) * chain.plate_mobility_m_n_s)


def _let_go(chain: Chain, state: Floats, force: Floats, last: Floats, now: int) -> NDArray[np.bool_]:
    """Bounced back, or pressing no more for a good while."""
    return np.asarray(((force == 0) & (chain.velocity(state) < 0)) | (now > 1.3 * last))


def _stepped(
    chain: Chain,
    state: Floats,
    rates: Floats,
    deepest: Floats,
    step: Floats,
    echo: tuple[Floats | float, Floats | float],
) -> Floats:
    middle, end = (echo[0] + echo[1]) / 2, echo[1]
    second, _ = chain.motion(state + step / 2 * rates, deepest, middle)
    third, _ = chain.motion(state + step / 2 * second, deepest, middle)
    fourth, _ = chain.motion(state + step * third, deepest, end)
    return np.asarray(state + step / 6 * (rates + 2 * (second + third) + fourth))
