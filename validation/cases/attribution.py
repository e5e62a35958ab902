"""How much of a case's gap each of its effects makes, on the virtual bench itself.

Glossary: Delta(S) the change (C, d) that the effects S make together, in tolerances; |.|^2 its mean
square.

- left out: |Delta(all) - Delta(all but e)|^2, the squared gap that is left when every effect but e
  is modelled;
- Shapley: of the game v(S) = |Delta(all)|^2 - |Delta(all) - Delta(S)|^2, the squared gap that the
  effects S take away (Shapley, A value for n-person games, 1953). Exact up to five effects of a
  stage, otherwise the mean over pairs of a random order and its reverse (Castro, Gomez and Tejada,
  Comput. Oper. Res. 36 (2009) 1726).

Both are divided by their sum over the effects. A stage is worked out by itself, given what was
measured upstream of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations
from math import factorial

import numpy as np

from ...array_types import Floats
from .case import STAGES, TOLERANCES, ActingCause
from .effect_size import changed_stage

Table = dict[str, dict[str, float]]

#: Effects that a stage can feel, by the beginning of their names; others do not change it.
_FELT: Mapping[str, tuple[str, ...]] = {
    "gun": ("gun.", "sensor.pressure", "sensor.velocity"),
    "contact": ("contact.", "sensor.force", "sensor.velocity"),
    "plate": ("plate.", "sensor.force", "sensor.acceleration", "sensor.mount", "sensor.zero"),
}
_EXACT = 5
_PAIRS_OF_ORDERS = 4


@dataclass(frozen=True)
class Attribution:
    """Of each stage and effect the mean square in tolerances: what is left when it is left out, and
    its Shapley value.

    Effects that a stage cannot feel are not in its table.
    """

    left_out: Table
    shapley: Table


def attribution(kind: str, number: int, cause: ActingCause) -> Attribution:
    """Of the effects of the catalogue that act in a cause. A cause without effects has empty
    tables."""
    left_out: Table = {}
    shapley: Table = {}
    for stage in STAGES[kind]:
        names = [name for name, _ in cause.strengths if name.startswith(_FELT[stage])]
        change = _remembered(kind, number, cause, stage)
        whole = change(frozenset(names))
        if not np.all(np.isfinite(whole)):
            continue
        left_out[stage] = {n: _square(whole - change(frozenset(names) - {n})) for n in names}
        shapley[stage] = shapley_values(
            names,
            lambda some, w=whole, c=change: -_square(w - c(some)),  # type: ignore[misc]
        )
    return Attribution(left_out, shapley)


def shapley_values(
    names: Sequence[str], value: Callable[[frozenset[str]], float]
) -> dict[str, float]:
    """Mean gain of each name over the orders in which all of them can join."""
    gains = dict.fromkeys(names, 0.0)
    orders = _orders(names)
    for order in orders:
        members: frozenset[str] = frozenset()
        before = value(members)
        for name in order:
            members = members | {name}
            now = value(members)
            gains[name] += (now - before) / len(orders)
            before = now
    return gains


def _orders(names: Sequence[str]) -> list[tuple[str, ...]]:
    if len(names) <= _EXACT:
        orders = list(permutations(names))
        assert len(orders) == factorial(len(names))
        return orders
    rng = np.random.default_rng([len(names), *"+".join(names).encode()])
    drawn = [tuple(names[i] for i in rng.permutation(len(names))) for _ in range(_PAIRS_OF_ORDERS)]
    return [sequence for order in drawn for sequence in (order, order[::-1])]


def _remembered(
    kind: str, number: int, cause: ActingCause, stage: str
) -> Callable[[frozenset[str]], Floats]:
    """Changes of a stage under some of a cause's effects, each set worked out once."""
    changes_by_set: dict[frozenset[str], Floats] = {}

    def change(names: frozenset[str]) -> Floats:
        if names not in changes_by_set:
            rows = changed_stage(stage, kind, number, cause.restricted(names))
            changes_by_set[names] = rows / TOLERANCES[stage]
        return changes_by_set[names]

    return change


def _square(rows: Floats) -> float:
    return float(np.mean(rows**2))


def shares(table: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """Of each effect over all stages, summing to one: all stages count the same, as in the report's
    metric. Empty without a gap."""
    total: dict[str, float] = {}
    for values in table.values():
        for name, value in values.items():
            total[name] = total.get(name, 0.0) + value
    whole = sum(total.values())
    return {name: value / whole for name, value in total.items()} if whole > 0 else {}
