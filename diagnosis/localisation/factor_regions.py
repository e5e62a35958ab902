"""In which part of the factor space the gap lies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Rows
from ...doe.factor_rules import SettingRule, rules
from ..gap import Means, floors, tolerances
from ..observables.base import Observable
from ..record import RunConfiguration
from ..verdict import Region

PERMUTATIONS = 999
#: A region is named where this share of such searches without any region would have found as much.
_LEVEL = 0.05
#: The gap "lies in" a region that leaves less than this part of its size outside, and no more than
#: a background or the smaller part. More: it is everywhere, and only larger there.
_OUTSIDE, _FAR_BELOW = 0.4, 0.2
#: In tolerances: gaps below the first need no region, and a background is no larger than the
#: second.
_SMALL, _NEAR = 0.5, 1.5
_FEWEST = 4


def factor_regions(
    residual: Floats,
    configuration: Rows,
    configurations: Sequence[RunConfiguration],
    observables: Sequence[Observable],
    rng: np.random.Generator,
    permutations: int = PERMUTATIONS,
) -> tuple[Region, ...]:
    """Regions that hold the gap, by rising p-value; none where it is everywhere, or nowhere. Levels
    of other factors that hold for the same configurations are regions, too: nothing tells which of
    them it is.

    Residuals (R, d) of runs, NaN allowed. Each stage's mean residuals are reduced to scores: their
    main signed direction (a singular vector, which permuting configurations does not change) on a
    scale that is logarithmic beyond a tolerance, since an effect's size differs within its region,
    and the logarithm of their size. Each score is split by every rule of one condition, and of at
    most two; the largest |t| over all of them is compared with that of permuted configurations, so
    that p pays for the search (Westfall and Young, Resampling-Based Multiple Testing, 1993), and p
    of all searches is corrected after Benjamini and Hochberg (1995). A second condition must earn
    its place (`_best_rule`). Only stages whose gap is at least half the largest one's are searched,
    which permuting does not change either. `excess` is the stage's rms gap inside less that
    outside, in floors: standard errors that repetitions leave of a configuration's mean.
    """
    tables = []
    for stage in dict.fromkeys(item.stage for item in observables):
        columns = [i for i, item in enumerate(observables) if item.stage == stage]
        items = [observables[i] for i in columns]
        tables.append(
            _StageGaps.of(residual[:, columns], configuration, len(configurations), items)
        )
    sizes = [table.rms(np.full(len(table.rows), fill_value=True)) for table in tables]
    searches: list[_Search] = []
    for table, size in zip(tables, sizes, strict=True):
        if size > 0 and size >= 0.5 * max(sizes) and len(table.rows) >= _FEWEST:
            candidates = rules(
                [configurations[i].factors for i in table.rows], least=max(2, len(table.rows) // 10)
            )
            searches += _search(table, candidates, rng, permutations) if candidates else []
    return _regions(searches) if searches else ()


@dataclass(frozen=True, eq=False)
class _StageGaps:
    """Mean gaps (C, d) of one stage in tolerances, and their variance (C, d), of the configurations
    of the record that have one, `rows` (C,)."""

    gap: Floats
    noise: Floats
    rows: Rows

    @classmethod
    def of(
        cls,
        residual: Floats,
        configuration: Rows,
        configurations: int,
        observables: Sequence[Observable],
    ) -> Self:
        """From residuals (R, d) of runs."""
        scale = tolerances(observables)
        means = Means.of(
            residual / scale, configuration, configurations, floors(observables) / scale
        )
        rows = np.flatnonzero(np.isfinite(means.mean).any(axis=1))
        return cls(means.mean[rows], means.variance[rows], rows)

    def rms(self, inside: NDArray[np.bool_]) -> float:
        """In tolerances, the scatter of the repetitions taken off; 0 where there is nothing."""
        square = (self.gap**2 - self.noise)[inside]
        return (
            float(np.sqrt(max(0.0, float(np.nanmean(square)))))
            if np.isfinite(square).any()
            else 0.0
        )

    def excess(self, inside: NDArray[np.bool_]) -> float:
        """Rms gap inside less that outside, in floors."""
        squares = self.gap**2 / np.maximum(self.noise, 1e-12)
        within, outside = (
            math.sqrt(max(0.0, float(np.nanmean(squares[part])) - 1)) for part in (inside, ~inside)
        )
        return within - outside

    def scores(self) -> Floats:
        """(C, 2): along the main direction, and in size; both logarithmic where they are large."""
        # Half a tolerance is the noise of a simulator: else one observable that scatters little
        # would be all there is.
        white = np.nan_to_num(self.gap / np.sqrt(self.noise + 0.25))
        direction = np.linalg.svd(white, full_matrices=False)[2][:1].T
        size = np.log(np.mean(white**2, axis=1, keepdims=True) + 0.25)
        return np.concatenate([np.arcsinh(white @ direction), size], axis=1)


#: The best rule by one score of a stage, the stage's gaps, and the p-value of the search for the
#: rule.
_Search = tuple[SettingRule | None, _StageGaps, float]


def _search(
    table: _StageGaps,
    candidates: Sequence[SettingRule],
    rng: np.random.Generator,
    permutations: int,
) -> list[_Search]:
    """Two for each score: among rules of one condition, which are few, and among all."""
    scores, masks = table.scores(), np.array([rule.inside for rule in candidates], dtype=np.float64)
    single = [i for i, rule in enumerate(candidates) if rule.conditions == 1]
    families = (
        [single, list(range(len(candidates)))]
        if 0 < len(single) < len(candidates)
        else [[*range(len(masks))]]
    )
    observed = _squared_t(scores, masks)
    largest = np.array([observed[family].max(axis=0) for family in families]) * (1 - 1e-9)
    count = np.zeros(largest.shape)
    for _ in range(permutations):
        permuted = _squared_t(rng.permutation(scores), masks)
        count += np.array([permuted[family].max(axis=0) for family in families]) >= largest
    p_values = (1 + count) / (1 + permutations)
    return [
        (
            _best_rule([candidates[i] for i in family], observed[family, q], table),
            table,
            float(p_values[at, q]),
        )
        for at, family in enumerate(families)
        for q in range(scores.shape[1])
    ]


def _squared_t(scores: Floats, masks: Floats) -> Floats:
    """(K, q): squared t of the mean inside against the mean outside."""
    cells = len(scores)
    inside = masks.sum(axis=1)[:, None]
    centred = scores - scores.mean(axis=0)
    between = (masks @ centred) ** 2 * cells / (inside * (cells - inside))
    total = np.maximum((centred**2).sum(axis=0), 1e-300)
    return np.asarray((cells - 2) * between / np.maximum(total - between, 1e-12 * total))


def _best_rule(
    candidates: Sequence[SettingRule], squared_t: Floats, table: _StageGaps
) -> SettingRule | None:
    """The best rule. One with two conditions must lower the sum of squares by more than the search
    for it explains.

    C ln(SS1 / SS2) > 2 ln K + ln C, an extended Bayesian information criterion (Chen and Chen,
    Biometrika 95 (2008) 759): otherwise chance always finds a second condition.
    """
    inside = [
        i for i, rule in enumerate(candidates) if table.rms(rule.inside) > table.rms(~rule.inside)
    ]
    if not inside:
        return None
    best = max(inside, key=lambda i: squared_t[i])
    plain = max(
        (i for i in inside if candidates[i].conditions == 1),
        key=lambda i: squared_t[i],
        default=best,
    )
    cells = len(table.rows)
    gain = cells * np.log(
        (1 + squared_t[best] / (cells - 2)) / (1 + squared_t[plain] / (cells - 2))
    )
    return candidates[best if gain > 2 * np.log(len(candidates)) + np.log(cells) else plain]


def _regions(searches: Sequence[_Search]) -> tuple[Region, ...]:
    """By rising p; of equals first the one that leaves less of the gap outside, then the smaller
    one."""
    from scipy.stats import false_discovery_control

    corrected = false_discovery_control([p_value for _, _, p_value in searches])
    best: dict[str, tuple[tuple[float, float, int], Region]] = {}
    for i in np.argsort(corrected, kind="stable"):
        (rule, table, _), p_value = searches[i], float(corrected[i])
        if p_value > _LEVEL or rule is None:
            continue
        inside, outside = table.rms(rule.inside), table.rms(~rule.inside)
        if (
            inside > _SMALL
            and outside < _OUTSIDE * inside
            and outside < max(_NEAR, _FAR_BELOW * inside)
        ):
            order = (p_value, round(outside, 1), int(rule.inside.sum()))
            for text in (rule.text, *rule.same):
                best.setdefault(text, (order, Region(text, table.excess(rule.inside), p_value)))
    return tuple(region for _, region in sorted(best.values(), key=lambda entry: entry[0]))
