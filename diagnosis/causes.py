"""From weighed hypotheses to the entries of a report."""

from __future__ import annotations

from collections.abc import Mapping

from ..twin.effects import Effect
from .confusion import Group, groups
from .evidence.weighing import Weighed
from .fits import fitted_parameters
from .verdict import NONE, UNKNOWN, Cause

#: Hypotheses below this probability are not listed; what is listed sums to one.
_LISTED = 1e-3


def causes(weighed: Weighed, probability: Mapping[str, float]) -> tuple[Cause, ...]:
    """Groups of hypotheses by falling probability; none and unknown are always listed."""
    kept = {name: p for name, p in probability.items() if p >= _LISTED or name in (NONE, UNKNOWN)}
    total = sum(kept.values())
    return tuple(_cause(weighed, group) for group in groups(weighed, {name: p / total for name, p in kept.items()}))


def fits(weighed: Weighed, found: tuple[Cause, ...]) -> dict[str, tuple[Effect, ...]]:
    """Every listed hypothesis as it was fitted by itself."""
    names = [name for cause in found for name in cause.effects if name not in (NONE, UNKNOWN)]
    return {name: weighed.effects(name) for name in names}


def _cause(weighed: Weighed, group: Group) -> Cause:
    first = group.members[0]
    share = group.probability or 1.0
    return Cause(
        effects=group.members,
        probability=group.probability,
        parameters=fitted_parameters(weighed, first),
        split=tuple(each / share for each in group.each),
        fitted=weighed.effects(first),
    )
