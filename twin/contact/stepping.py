"""Contacts on their way, and one step of all of them: the classical Runge-Kutta method of order 4 over arrays.

Glossary: s with t = T s^q, T each contact's own time. Force begins as t^p, and below a layer indentation as t^(1/p):
with q = 2 and q = 2 p both are smooth in s, which they are not in t.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .bodies import Floats
from .numbers import Numbers, Pace, Rates, Spring, pace, rates

Index = NDArray[np.intp]
#: Indentation and velocity, 2 x n; or other variables, one a row.
State = Floats

_CLOSER = 5  # steps of regula falsi: to the last digits


@dataclass(frozen=True, eq=False)
class Contacts:
    """Contacts `index` (k,) of a batch, in their own units, at time T s^q."""

    index: Index
    numbers: Numbers
    spring: Spring
    own_time: Floats  # T
    power: Floats  # q
    s: Floats
    state: State

    def __len__(self) -> int:
        return len(self.index)

    @property
    def time(self) -> Floats:
        return np.asarray(self.own_time * (self.s**2 if self.plain else self.s**self.power))

    @property
    def plain(self) -> bool:
        """Whether q = 2 for all of them: another power costs as much as all the rest."""
        return bool(np.all(self.power == 2))

    def rates(self, state: State | None = None) -> Rates:
        depth, velocity = self.state if state is None else state[:2]
        return rates(self.numbers, self.spring, depth, velocity)

    def pace(self, state: State) -> Pace:
        return pace(self.numbers, self.spring, *state)

    def at(self, s: Floats, state: State) -> Self:
        return replace(self, s=s, state=state)

    def at_time(self, time: Floats) -> Self:
        return replace(self, s=np.asarray((time / self.own_time) ** (1 / self.power)))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All of several batches, in the order of their index."""
        together = cls(
            np.concatenate([part.index for part in parts]),
            Numbers.joined([part.numbers for part in parts]),
            Spring.joined([part.spring for part in parts]),
            np.concatenate([part.own_time for part in parts]),
            np.concatenate([part.power for part in parts]),
            np.concatenate([part.s for part in parts]),
            np.concatenate([part.state for part in parts], axis=1),
        )
        return together.take(np.argsort(together.index))

    def take(self, chosen: Index) -> Self:
        return type(self)(
            self.index.take(chosen),
            self.numbers.take(chosen),
            self.spring.take(chosen),
            self.own_time.take(chosen),
            self.power.take(chosen),
            self.s.take(chosen),
            self.state.take(chosen, axis=1),
        )


def touch(numbers: Numbers) -> Contacts:
    """All contacts at the instant of touching."""
    n = len(numbers.exponent)
    state = np.stack([np.zeros(n), np.ones(n)])
    power = np.where(numbers.compliance > 0, np.clip(2 * numbers.exponent, 2.0, 4.0), 2.0)
    return Contacts(np.arange(n), numbers, Spring.loading(numbers), own_time(numbers), power, np.zeros(n), state)


def own_time(numbers: Numbers) -> Floats:
    """T (n,): about as long as the loading takes. It sets the steps, and nothing else."""
    p = numbers.exponent
    energy = 0.5 / (1 + numbers.damping / 2)
    with np.errstate(divide="ignore", over="ignore"):  # what there is next to nothing of asks for endless depths
        hertz = ((p + 1) * energy) ** (1 / (p + 1))
        soft = np.minimum(hertz**p, (2 * energy / numbers.compliance) ** 0.5)
        beta = numbers.compliance / (1 + numbers.stiffening * soft)  # about as stiff as under that force
        elastic = np.minimum(hertz, (2 * energy / beta) ** (0.5 / p))
        held = numbers.inelasticity ** (-1 / p)
    yielded = np.minimum(elastic, numbers.yield_depth)
    flow = np.where(elastic > yielded, np.sqrt(2 * energy / (p * yielded ** (p - 1))), 0.0)
    depth = np.minimum(np.maximum(elastic, yielded + flow), held)
    return np.asarray(1.4 * (depth + beta * depth**p))


def step(contacts: Contacts, size: Floats | float, now: Rates | None = None) -> Contacts:
    """All of them on by one step of s, or by steps (k,); `now` saves their rates, where they are known."""
    plain = contacts.plain
    unit = contacts.own_time * contacts.power

    def rate(s: Floats, state: State, known: Rates | None = None) -> State:
        at = known or contacts.pace(state)
        slowness = unit * (s if plain else s ** (contacts.power - 1))  # dt / ds
        return np.stack([slowness * at.indentation, -slowness * at.force])

    first = rate(contacts.s, contacts.state, now)
    return contacts.at(contacts.s + size, runge_kutta(rate, contacts.s, contacts.state, size, first))


def to_the_yield(contacts: Contacts, size: float) -> Contacts:
    """To the depth where they yield, which they pass in the next step: the force's slope has a kink there.

    The part of the step is found by regula falsi, the Illinois way: Newton's fails where the turn is near.
    """
    elastic = replace(contacts, spring=replace(contacts.spring, yield_depth=np.full(len(contacts), np.inf)))
    reach = contacts.numbers.yield_depth
    low, below = np.zeros(len(contacts)), contacts.state[0] - reach
    high = np.full(len(contacts), size)
    above = step(elastic, high).state[0] - reach
    last = np.full(len(contacts), -1)
    for _ in range(_CLOSER):
        part = np.where(above > below, (low * above - high * below) / (above - below), low)
        there = step(elastic, part)
        off = there.state[0] - reach
        short = off < 0
        half = np.where(short == last, 0.5, 1.0)  # for the end that stays where it is once more
        low, high = np.where(short, part, low), np.where(short, high, part)
        below, above = np.where(short, off, half * below), np.where(short, half * above, off)
        last = short
    return replace(there, spring=contacts.spring)


def to_the_turn(contacts: Contacts) -> Contacts:
    """To the deepest indentation, in one step of the rate of approach: Henon, Physica D 5 (1982) 412."""

    def rate(_: Floats, state: State) -> State:
        now = contacts.rates(state)
        return np.asarray(np.stack([now.indentation, -now.force, np.ones_like(now.force)]) / now.approach_rate)

    approach = contacts.rates().approach
    start = np.vstack([contacts.state, contacts.time])
    *state, time = runge_kutta(rate, approach, start, -approach)
    return replace(contacts, state=np.stack(state)).at_time(time)


def runge_kutta(
    rate: Callable[[Floats, State], State], at: Floats, state: State, size: Floats | float, first: State | None = None
) -> State:
    """One step of the classical method of order 4; `first` saves the rate at its begin, where it is known."""
    half = 0.5 * size
    first = rate(at, state) if first is None else first
    second = rate(at + half, state + half * first)
    third = rate(at + half, state + half * second)
    fourth = rate(at + size, state + size * third)
    return np.asarray(state + size / 6 * (first + 2 * (second + third) + fourth))
