"""In which part of the factor space the gap lies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..observables.base import Observable
from ..record import Configuration
from ..verdict import Region
from .means import Floats
from .rules import Rule, rules
from .search import Search, benjamini_hochberg, searched
from .stage_gaps import StageGaps

PERMUTATIONS = 999
#: A region is named where this share of such searches without any region would have found as much.
LEVEL = 0.05
#: The gap "lies in" a region that leaves less than this part of its size outside, and no more than a background or the
#: smaller part. More: it is everywhere, and only larger there.
OUTSIDE, FAR_BELOW = 0.4, 0.2
#: In tolerances: gaps below the first need no region, and a background is no larger than the second.
_SMALL, _NEAR = 0.5, 1.5
_FEWEST = 4


def factor_regions(
    residual: Floats,
    configuration: NDArray[np.intp],
    configurations: Sequence[Configuration],
    observables: Sequence[Observable],
    rng: np.random.Generator,
    permutations: int = PERMUTATIONS,
) -> tuple[Region, ...]:
    """Regions that hold the gap, by rising p-value; none where it is everywhere, or nowhere. Levels of other factors
    that hold for the same configurations are regions, too: nothing tells which of them it is.

    Residuals (R, d) of runs, NaN allowed. Each stage's mean residuals are reduced to scores: their main signed
    direction (a singular vector, which permuting configurations does not change) on a scale that is logarithmic beyond
    a tolerance, since an effect's size differs within its region, and the logarithm of their size. Each score is split
    by every rule of one condition, and of at most two; the largest |t| over all of them is compared with that of
    permuted configurations, so that p pays for the search (Westfall and Young, Resampling-Based Multiple Testing,
    1993), and p of all searches is corrected after Benjamini and Hochberg (1995). A second condition must earn its
    place (`_chosen`). Only stages whose gap is at least half the largest one's are searched, which permuting does not
    change either. `excess` is the stage's rms gap inside less that outside, in floors: standard errors that repetitions
    leave of a configuration's mean.
    """
    searches: list[Search] = []
    for table in _loud(residual, configuration, len(configurations), observables):
        found = rules([configurations[i] for i in table.kept], least=max(2, len(table.kept) // 10))
        if found and len(table.kept) >= _FEWEST:
            searches += searched(table, found, rng, permutations)
    return _named(searches)


def _loud(
    residual: Floats, configuration: NDArray[np.intp], configurations: int, observables: Sequence[Observable]
) -> list[StageGaps]:
    """The stages that are worth a search."""
    tables = []
    for stage in dict.fromkeys(item.stage for item in observables):
        columns = [i for i, item in enumerate(observables) if item.stage == stage]
        own = [observables[i] for i in columns]
        tables.append(StageGaps.of(residual[:, columns], configuration, configurations, own))
    sizes = [table.size for table in tables]
    return [each for each, size in zip(tables, sizes, strict=True) if size > 0 and size >= 0.5 * max(sizes)]


def _named(searches: Sequence[Search]) -> tuple[Region, ...]:
    """By rising p; of equals first the one that leaves less of the gap outside, then the smaller one."""
    corrected = benjamini_hochberg(np.array([each.p_value for each in searches]))
    best: dict[str, tuple[tuple[float, float, int], Region]] = {}
    for i in np.argsort(corrected, kind="stable"):
        rule, table = searches[i].rule, searches[i].table
        if corrected[i] <= LEVEL and rule is not None and _holds_gap(rule, table):
            order = (float(corrected[i]), round(table.rms(~rule.inside), 1), int(rule.inside.sum()))
            for text in (rule.text, *rule.same):
                best.setdefault(text, (order, Region(text, table.excess(rule.inside), float(corrected[i]))))
    return tuple(region for _, region in sorted(best.values(), key=lambda each: each[0]))


def _holds_gap(rule: Rule, table: StageGaps) -> bool:
    inside, outside = table.rms(rule.inside), table.rms(~rule.inside)
    return inside > _SMALL and outside < OUTSIDE * inside and outside < max(_NEAR, FAR_BELOW * inside)
