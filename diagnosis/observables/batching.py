"""Sets of effects of the same kinds as one set with arrays, so that one call simulates them all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from ...array_types import Floats, Rows
from ...twin.effects import Effect

E = TypeVar("E", bound=Effect)


def batched_changes(sets: Sequence[Sequence[Effect]], observed: Callable[[Sequence[Effect], int], Floats]) -> Floats:
    """(k, C, d): by how much each of k sets of effects moves what is observed; nothing for an empty set.

    `observed` takes effects whose parameters are one value or go with n x C cases, set by set, and n, and gives
    (n C, d).
    """
    nominal = observed((), 1)
    changes = np.zeros((len(sets), *nominal.shape))
    groups: dict[tuple[str, ...], list[int]] = {}
    for row, effects in enumerate(sets):
        if effects:
            groups.setdefault(tuple(sorted(effect.id for effect in effects)), []).append(row)
    for rows in groups.values():
        together = stacked([sets[row] for row in rows], len(nominal))
        changes[rows] = observed(together, len(rows)).reshape(len(rows), *nominal.shape) - nominal
    return changes


def stacked(sets: Sequence[Sequence[Effect]], count: int) -> list[Effect]:
    """Effects for k x `count` cases, set by set, of k sets of the same kinds; parameters are one value or `count`."""
    ordered = [sorted(effects, key=lambda effect: effect.id) for effects in sets]
    return [
        replace(
            same[0],
            **{
                item.name: np.concatenate([np.broadcast_to(getattr(effect, item.name), (count,)) for effect in same])
                for item in same[0].parameters()
            },
        )
        for same in zip(*ordered, strict=True)
    ]


def at_rows(effects: Sequence[E], rows: Rows) -> tuple[E, ...]:
    """Effects whose parameters are one value or one for each case (n,), for the cases `rows` (k,), each as often as it
    is named. (Cases are impacts, shots, or configurations of which runs are wanted.)"""

    def values(effect: E) -> dict[str, Floats]:
        arrays = {item.name: np.asarray(getattr(effect, item.name)) for item in effect.parameters()}
        return {name: array[rows] for name, array in arrays.items() if array.ndim}

    return tuple(replace(effect, **values(effect)) for effect in effects)
