"""Sets of effects of the same kinds as one set with arrays, so that one call simulates them all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...twin.effects import Effect


def by_kinds(sets: Sequence[Sequence[Effect]]) -> Iterator[list[int]]:
    """Rows of the sets that have the same kinds of effects; empty sets are left out."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for row, effects in enumerate(sets):
        if effects:
            groups.setdefault(tuple(sorted(each.id for each in effects)), []).append(row)
    yield from groups.values()


def stacked(sets: Sequence[Sequence[Effect]], count: int) -> list[Effect]:
    """Effects for k x `count` cases, set by set, of k sets of the same kinds; parameters are one value or `count`."""
    ordered = [sorted(effects, key=lambda each: each.id) for effects in sets]
    return [_joined(same, count) for same in zip(*ordered, strict=True)]


def at_rows(effects: Sequence[Effect], rows: NDArray[np.intp]) -> tuple[Effect, ...]:
    """Effects whose parameters are one value or one for each configuration (C,), for runs of the configurations `rows`
    (R,)."""
    placed = []
    for effect in effects:
        values = {item.name: np.asarray(getattr(effect, item.name), dtype=np.float64) for item in effect.parameters()}
        placed.append(replace(effect, **{name: value[rows] for name, value in values.items() if value.ndim}))
    return tuple(placed)


def _joined(same: Sequence[Effect], count: int) -> Effect:
    names = [item.name for item in same[0].parameters()]
    return type(same[0])(
        **{
            name: np.concatenate(
                [np.broadcast_to(np.asarray(getattr(each, name), dtype=np.float64), (count,)) for each in same]
            )
            for name in names
        }
    )
