"""What a two-level design cannot tell apart: main effects and interactions of two factors that go together."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..space import Space

#: Beyond, a table of aliases is read by nobody.
_MOST_AXES, _MOST_RUNS = 40, 20_000
_DIGITS = 1e-9


@dataclass(frozen=True)
class Alias:
    """Two effects, interactions written "a*b", and the correlation of their columns: 1 or -1 if one hides the other."""

    effect: str
    other: str
    correlation: float

    @property
    def full(self) -> bool:
        return abs(self.correlation) > 1 - _DIGITS


def aliases(space: Space, treatments: NDArray[np.int64]) -> tuple[Alias, ...]:
    """Main effects with each other and with two-factor interactions, and these with each other, that correlate.

    Empty for a design that has an axis at three levels or more, more than 40 axes, or more than 20,000 runs. (Box,
    Hunter and Hunter, chapter 6; pyDOE3's `fracfact_aliasing` gives the same groups, but neither opposite signs nor
    parts.) Raises as `Space.checked` does.
    """
    rows = space.checked(treatments)
    used = [np.unique(rows[:, index]) for index in range(rows.shape[1])]
    varied = [index for index, levels in enumerate(used) if len(levels) > 1]
    if len(rows) > _MOST_RUNS or not 1 < len(varied) <= _MOST_AXES or any(len(used[index]) > 2 for index in varied):
        return ()
    signs = np.stack([np.where(rows[:, index] == used[index][1], 1.0, -1.0) for index in varied], axis=1)
    pairs = list(itertools.combinations(range(len(varied)), 2))
    effects = np.hstack([signs, np.stack([signs[:, a] * signs[:, b] for a, b in pairs], axis=1)])
    names = [f"({name})" if "+" in name else name for name in (space.axes[index].name for index in varied)]
    words = [*names, *(f"{names[a]}*{names[b]}" for a, b in pairs)]
    cosines = effects.T @ effects / len(rows)  # of columns of 1 and -1
    first, second = np.nonzero(np.triu(np.abs(cosines) > _DIGITS, 1))
    aliases = (Alias(words[a], words[b], float(cosines[a, b])) for a, b in zip(first, second, strict=True))
    return tuple(sorted(aliases, key=lambda alias: -abs(alias.correlation)))


def alias_lines(found: tuple[Alias, ...]) -> list[str]:
    """Aliases as a person reads them: a line for each group that is one, and one for what is aliased in part."""
    groups: dict[str, list[str]] = {}
    for alias in found:
        if alias.full:
            groups.setdefault(alias.effect, []).append(f"{'-' if alias.correlation < 0 else ''}{alias.other}")
    listed = {other.lstrip("-") for others in groups.values() for other in others}
    lines = [" = ".join([effect, *others]) for effect, others in groups.items() if effect not in listed]
    part = [abs(alias.correlation) for alias in found if not alias.full]
    if part:
        lines.append(f"{len(part)} pairs of effects are aliased in part, by up to {max(part):.2f}")
    return lines
