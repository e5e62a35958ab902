"""Contacts from touch to parting, with fixed steps of each contact's own time.

Loading and unloading march in s (`stepping.py`). Where the bodies are about to part freely, the last steps count the
way that is left, xi - xi_0 = d (1 - sigma)^2: the end is met exactly, and the force is smooth in sigma as it was in s.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .bodies import Floats
from .numbers import Numbers, Rates
from .stepping import Contacts, Index, State, runge_kutta, step, to_the_turn, to_the_yield, touch

#: Steps for each contact's own time, about those of the loading.
STEPS = 96
#: A contact that does not part by itself is left when its force has fallen to this share of that at the turn.
LEAST_FORCE = 1e-4
#: Bodies part freely when the rate of approach will change by less than this share on the way that is left.
_FREE = 0.3
#: Largest stiffness times way left for which the steps of the landing are short enough.
_STIFF = 2.0
#: Change of the rate of approach, relative, that is none.
_NEXT_TO_NOTHING = 1e-7
_LONGEST = 1000  # most steps of a contact, in those of its own time
_LANDING, _DRIFTING, _TOUCHING = 1, 2, 3


@dataclass(frozen=True, eq=False)
class Node:
    """What is kept of a step: contacts (k,) of the batch, and of each its time, force and the force's rate."""

    index: Index
    time: Floats
    force: Floats
    force_rate: Floats


@dataclass(frozen=True, eq=False)
class March:
    """n contacts in their own units; `nodes` in order of time for each of them."""

    contact_time: Floats
    compression_time: Floats  # until the deepest indentation
    deepest: Floats
    permanent: Floats
    velocity: Floats  # the impactor's at the end, negative when it comes back
    parted: NDArray[np.bool_]  # or left, still touching
    nodes: list[Node]


def march(numbers: Numbers, steps: int = STEPS) -> March:
    """Raises `ArithmeticError` where a contact does not come to an end."""
    nodes: list[Node] = []
    turn = _load(touch(numbers), 1 / steps, nodes)
    back = replace(turn, spring=turn.spring.unloading(turn.state[0]))
    end = _unload(back, steps, nodes)
    time, velocity = end.contacts.time, end.contacts.state[1].copy()
    for how, finish in ((_LANDING, _land), (_DRIFTING, _drift), (_TOUCHING, _leave)):
        chosen = np.flatnonzero(end.how == how)
        if len(chosen):
            time[chosen], velocity[chosen] = finish(end.contacts.take(chosen), steps, nodes)
    return March(time, turn.time, turn.state[0], back.spring.rest, velocity, end.how != _TOUCHING, nodes)


def _load(contacts: Contacts, size: float, nodes: list[Node]) -> Contacts:
    """All of them at their deepest indentation."""
    turning, yielding = _press(contacts, size, nodes)
    if yielding:
        # The step that crosses the depth of yield is done in two parts.
        before = Contacts.joined(yielding)
        there = to_the_yield(before, size)
        beyond = step(there, before.s + size - there.s)
        soon = beyond.rates().approach <= 0
        turning.append(there.take(np.flatnonzero(soon)))
        turning += _press(beyond.take(np.flatnonzero(~soon)), size, nodes)[0]
    return to_the_turn(Contacts.joined(turning))


def _press(contacts: Contacts, size: float, nodes: list[Node]) -> tuple[list[Contacts], list[Contacts]]:
    """All of them a step before they turn, or before they yield."""
    turning: list[Contacts] = []
    yielding: list[Contacts] = []
    now = contacts.rates()
    for _ in range(round(_LONGEST / size)):
        if not len(contacts):
            return turning, yielding
        nodes.append(_node(contacts, now))
        after = step(contacts, size, now)
        reach = contacts.numbers.yield_depth
        crossing = (contacts.state[0] < reach) & (after.state[0] > reach)
        now = after.rates()
        ending = crossing | (now.approach <= 0)
        if np.any(ending):
            for some, chosen in ((yielding, crossing), (turning, ending & ~crossing)):
                if np.any(chosen):
                    some.append(contacts.take(np.flatnonzero(chosen)))
            others = np.flatnonzero(~ending)
            after, now = after.take(others), now.take(others)
        contacts = after
    raise ArithmeticError(f"{len(contacts)} contacts do not come to their deepest indentation")


@dataclass(frozen=True, eq=False)
class _Ends:
    """Contacts from where their end is near enough for another way to it, and `how` (n,) each goes on."""

    contacts: Contacts
    how: NDArray[np.int8]


def _unload(contacts: Contacts, steps: int, nodes: list[Node]) -> _Ends:
    ends: list[Contacts] = []
    ways: list[NDArray[np.int8]] = []
    least = LEAST_FORCE * contacts.rates().force
    for _ in range(_LONGEST * steps):
        now = contacts.rates()
        ending = _ending(contacts, now, least[contacts.index])
        nodes.append(_node(contacts, now))
        if np.any(ending):
            ends.append(_back_to_least(contacts, now, ending, least[contacts.index]).take(np.flatnonzero(ending)))
            ways.append(ending[ending > 0])
            others = np.flatnonzero(ending == 0)
            contacts, now = contacts.take(others), now.take(others)
        if not len(contacts):
            order = np.argsort(np.concatenate([end.index for end in ends]))
            return _Ends(Contacts.joined(ends), np.concatenate(ways)[order])
        contacts = step(contacts, 1 / steps, now)
    raise ArithmeticError(f"{len(contacts)} contacts neither part nor come to rest")


def _ending(contacts: Contacts, now: Rates, least: Floats) -> NDArray[np.int8]:
    """How each goes on: 0 for another step."""
    speed, left = -now.approach, _left(contacts, now)
    stiffness = contacts.numbers.damping * now.static + contacts.numbers.inelasticity * now.slope
    change = np.abs(now.approach_rate) * left
    steady = (speed > 0) & (change < _FREE * speed**2)
    landing = steady & (stiffness * left < _STIFF * speed)
    drifting = (speed > 0) & (np.maximum(change, now.force * left) < _NEXT_TO_NOTHING * speed**2)
    touching = ~steady & (now.force < least)
    return np.asarray(np.select([landing, drifting, touching], [_LANDING, _DRIFTING, _TOUCHING], 0), dtype=np.int8)


def _back_to_least(contacts: Contacts, now: Rates, ending: NDArray[np.int8], least: Floats) -> Contacts:
    """The last step of those that stay went a little beyond their least force, which falls as an exponential."""
    stays = ending == _TOUCHING
    if not np.any(stays):
        return contacts
    # A force that has come down to nothing has no exponential to go back along.
    falls = stays & (now.force > 0) & (now.force_rate < 0)
    force, rate = np.where(falls, now.force, least), np.where(falls, now.force_rate, -1.0)
    excess = np.where(falls, np.log(least / force) * force / -rate, 0.0)
    return contacts.at_time(contacts.time - excess)


def _left(contacts: Contacts, now: Rates) -> Floats:
    """Way until the bodies part."""
    return np.asarray(contacts.state[0] - contacts.spring.rest + contacts.numbers.layer(now.static))


def _land(contacts: Contacts, steps: int, nodes: list[Node]) -> tuple[Floats, Floats]:
    """Time and velocity (k,) at the end, in steps of the way left."""
    rest, left = contacts.spring.rest, contacts.state[0] - contacts.spring.rest
    size = 1 / max(steps // 3, 1)

    def rate(sigma: Floats, state: State) -> State:
        now = contacts.rates(np.stack([rest + left * (1 - sigma) ** 2, state[1]]))
        slowness = -2 * left * (1 - sigma) / now.indentation
        return np.asarray(np.stack([slowness, -now.force * slowness]))

    state = np.stack([contacts.time, contacts.state[1]])
    for sigma in np.arange(0, 1 - size / 2, size):
        state = runge_kutta(rate, np.asarray(sigma), state, size)
        now = contacts.rates(np.stack([rest + left * (1 - sigma - size) ** 2, state[1]]))
        nodes.append(Node(contacts.index, state[0], now.force, now.force_rate))
    return state[0], state[1]


def _drift(contacts: Contacts, _steps: int, nodes: list[Node]) -> tuple[Floats, Floats]:
    """The same where there is next to no force left: with the velocity that they have."""
    now = contacts.rates()
    time = contacts.time - _left(contacts, now) / now.approach
    nodes.append(Node(contacts.index, time, np.zeros_like(time), np.zeros_like(time)))
    return time, contacts.state[1]


def _leave(contacts: Contacts, _steps: int, _nodes: list[Node]) -> tuple[Floats, Floats]:
    """The same where they stay together: here, with the least force."""
    return contacts.time, contacts.state[1]


def _node(contacts: Contacts, now: Rates) -> Node:
    return Node(contacts.index, contacts.time, now.force, now.force_rate)
