"""Sets of effects of the same kinds as one set with arrays, so that one call simulates them all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect

Rows = NDArray[np.intp]
E = TypeVar("E", bound=Effect)


def by_kinds(sets: Sequence[Sequence[Effect]]) -> Iterator[list[int]]:
    """Rows of the sets that have the same kinds of effects; empty sets are left out."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for row, effects in enumerate(sets):
        if effects:
            groups.setdefault(tuple(sorted(effect.id for effect in effects)), []).append(row)
    yield from groups.values()


def stacked(sets: Sequence[Sequence[Effect]], count: int) -> list[Effect]:
    """Effects for k x `count` cases, set by set, of k sets of the same kinds; parameters are one value or `count`."""
    ordered = [sorted(effects, key=lambda effect: effect.id) for effects in sets]
    return [_joined(same, count) for same in zip(*ordered, strict=True)]


def _joined(same: Sequence[Effect], count: int) -> Effect:
    values = {item.name: [getattr(effect, item.name) for effect in same] for item in same[0].parameters()}
    return type(same[0])(
        **{
            name: np.concatenate([np.broadcast_to(np.asarray(value, dtype=np.float64), (count,)) for value in parts])
            for name, parts in values.items()
        }
    )


def at_rows(effects: Sequence[E], rows: Rows) -> tuple[E, ...]:
    """Effects whose parameters are one value or one for each case (n,), for the cases `rows` (k,), each as often as it
    is named. (Cases are impacts, shots, or configurations of which runs are wanted.)"""
    values = [
        {item.name: np.asarray(getattr(e, item.name), dtype=np.float64) for item in e.parameters()} for e in effects
    ]
    return tuple(
        replace(effect, **{name: value[rows] for name, value in parameters.items() if value.ndim})
        for effect, parameters in zip(effects, values, strict=True)
    )
