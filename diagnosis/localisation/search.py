"""The search for a region, and what it costs: permuted configurations are searched alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .means import Floats
from .rules import Rule
from .stage_gaps import StageGaps


@dataclass(frozen=True, eq=False)
class Search:
    """One score of one stage: its best rule, and the p-value of the search for it."""

    rule: Rule | None
    table: StageGaps
    p_value: float


def searched(table: StageGaps, found: Sequence[Rule], rng: np.random.Generator, permutations: int) -> list[Search]:
    """Two for each score: among rules of one condition, which are few, and among all."""
    masks = np.array([rule.inside for rule in found], dtype=np.float64)
    families = [[i for i, rule in enumerate(found) if rule.conditions <= most] for most in (1, 2)]
    families = [each for at, each in enumerate(families) if each and each not in families[:at]]
    observed = _splits(table.scores, masks)
    largest = np.array([observed[each].max(axis=0) for each in families]) * (1 - 1e-9)
    count = np.zeros(largest.shape)
    for _ in range(permutations):
        split = _splits(rng.permutation(table.scores), masks)
        count += np.array([split[each].max(axis=0) for each in families]) >= largest
    p_values = (1 + count) / (1 + permutations)
    return [
        Search(_chosen([found[i] for i in each], observed[each, q], table), table, float(p_values[at, q]))
        for at, each in enumerate(families)
        for q in range(table.scores.shape[1])
    ]


def _splits(scores: Floats, masks: Floats) -> Floats:
    """(K, q): squared t of the mean inside against the mean outside."""
    cells = len(scores)
    inside = masks.sum(axis=1)[:, None]
    centred = scores - scores.mean(axis=0)
    between = (masks @ centred) ** 2 * cells / (inside * (cells - inside))
    total = np.maximum((centred**2).sum(axis=0), 1e-300)
    return np.asarray((cells - 2) * between / np.maximum(total - between, 1e-12 * total))


def _chosen(found: Sequence[Rule], squared_t: Floats, table: StageGaps) -> Rule | None:
    """The best rule. One with two conditions must lower the sum of squares by more than the search for it explains.

    C ln(SS1 / SS2) > 2 ln K + ln C, an extended Bayesian information criterion (Chen and Chen, Biometrika 95 (2008)
    759): otherwise chance always finds a second condition.
    """
    inside = [i for i, rule in enumerate(found) if table.rms(rule.inside) > table.rms(~rule.inside)]
    single = [i for i in inside if found[i].conditions == 1]
    if not inside:
        return None
    best = max(inside, key=lambda i: squared_t[i])
    if not single or best in single:
        return found[best]
    plain = max(single, key=lambda i: squared_t[i])
    cells = len(table.scores)
    gain = cells * np.log((1 + squared_t[best] / (cells - 2)) / (1 + squared_t[plain] / (cells - 2)))
    return found[best] if gain > 2 * np.log(len(found)) + np.log(cells) else found[plain]


def benjamini_hochberg(p_values: Floats) -> Floats:
    """Adjusted p-values (n,)."""
    order = np.argsort(p_values)[::-1]
    count = len(p_values)
    adjusted = np.minimum.accumulate(p_values[order] * count / (count - np.arange(count)))
    return np.asarray(np.minimum(adjusted, 1.0)[np.argsort(order)])
