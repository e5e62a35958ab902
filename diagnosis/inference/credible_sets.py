"""Which effects stand for each other: sets of which at least one acts, by the posterior over sets
of effects.

As the credible sets of SuSiE (Wang et al., J. R. Stat. Soc. B 82 (2020) 1273), read off the
posterior of a search over subsets: two effects that these runs cannot tell apart seldom act in the
same likely set, and together they almost always do.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

#: Effects are added to a set until at least one of them acts with this probability.
_COVERED = 0.9
#: Two effects stand for each other where they act together less often than this share of what
#: chance would give.
_APART = 0.5
#: An effect that adds less to the probability of a set is not worth a name in it.
_LEAST = 0.1
#: A set is established where at least one of its effects acts with this probability. Of the sets of
#: that probability on development campaigns nine in ten had an effect that acted
#: (`benchmarks/diagnosis_maps.py` has the campaigns).
ESTABLISHED = 0.7

#: Sets of effects that may act, with their probabilities.
Weighted = Sequence[tuple[frozenset[str], float]]


def inclusion(weighted: Weighted, effects: Collection[str]) -> float:
    """The probability that at least one of some effects acts."""
    return float(sum(weight for acting, weight in weighted if not acting.isdisjoint(effects)))


def credible_sets(weighted: Weighted, least: float = ESTABLISHED) -> list[tuple[str, ...]]:
    """Disjoint sets of which at least one effect acts with a probability of `least` and more, the
    likeliest effect of each first; an effect that is sure by itself is a set of one."""
    inclusions = {name: inclusion(weighted, {name}) for acting, _ in weighted for name in acting}
    order = sorted(inclusions, key=lambda name: (-inclusions[name], name))
    grouped_effects: set[str] = set()
    sets = []
    for first in order:
        if first not in grouped_effects:
            members = _completed(
                weighted, first, [name for name in order if name not in grouped_effects]
            )
            if inclusion(weighted, members) >= least:
                grouped_effects.update(members)
                sets.append(tuple(sorted(members, key=order.index)))
    return sets


def _completed(weighted: Weighted, first: str, others: Iterable[str]) -> set[str]:
    """An effect and those that act where it does not, the most probable first, until one of them
    almost surely acts."""
    members, candidates = {first}, [name for name in others if name != first]
    covered = inclusion(weighted, members)
    while covered < _COVERED:
        options = []
        for name in candidates:
            alone, union = inclusion(weighted, {name}), inclusion(weighted, members | {name})
            together = alone + covered - union
            if (
                name not in members
                and union - covered >= _LEAST
                and together < _APART * alone * covered
            ):
                options.append((union, name))
        if not options:
            break
        covered, name = max(options, key=lambda option: option[0])  # of equals the likelier one
        members.add(name)
    return members
