"""The theme of the genetic search: evaluations of candidates by us and by scikit-learn, as in `benchmarks.genetic`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from .figures import Figure
from .genetic import FOLDS, MARGIN, STEPS, WAYS, Fold, campaign, errors, folds_of
from .limits import multiplying
from .measuring import Spread, interleaved, ratio

THEME = f"Genetic search: candidates evaluated by {FOLDS} folds of 1,440 pulses, {STEPS} steps each"
QUESTION = "an evaluation of the genetic search"
#: From the narrow preset up; the widest of `benchmarks.genetic` takes most of its time.
QUICK = ((25,), (100,), (10, 10, 10), (50, 50))


def measure_networks(
    _folder: Path, candidates: Sequence[tuple[int, ...]] = QUICK, repeats: int = 3
) -> Iterator[Figure]:
    """All candidates at once, as the search has them; then how good what they learned from some starts is."""
    x, y, groups = campaign()
    folds = folds_of(x, y, groups)
    kept: dict[str, list[float]] = {name: [] for name in WAYS}
    bounds, product = list[float](), multiplying(_flops(folds, candidates), np.float32)

    def learn(name: str) -> None:
        found = WAYS[name](folds, candidates, len(kept[name]))
        kept[name].append(float(np.mean([errors(forces, folds, y)[1] for forces in found])))

    ways = {name: partial(learn, name) for name in WAYS}
    taken = interleaved({**ways, "bound": lambda: bounds.append(product())}, repeats)
    ours, theirs = (taken[name] for name in WAYS)
    own, other = (Spread.of(seconds).text(" s", 1 / len(candidates)) for seconds in (ours, theirs))
    limit = Spread.of(bounds[1:]).text(" s", 1 / len(candidates))
    sizes = ", ".join("x".join(map(str, layers)) for layers in candidates)
    yield Figure(
        THEME, f"seconds for one of {sizes}", own, other, ratio(ours, theirs), limit=1.0, question=QUESTION,
        nature=f"one gradient a step at the rate of a product of matrices: {limit}", near=ratio(ours, bounds[1:]),
        rival="scikit-learn, joblib",
    )  # fmt: skip
    ours, theirs = kept.values()
    yield Figure(
        THEME, f"error of left-out pulses (NRMSE), mean of the candidates, {len(ours)} starts",
        Spread.of(ours).text(), Spread.of(theirs).text(), ratio(ours, theirs), limit=MARGIN, of="quality",
        rival="scikit-learn, joblib", nature="the noise of the pulses",
    )  # fmt: skip


def _flops(folds: Sequence[Fold], candidates: Sequence[tuple[int, ...]]) -> float:
    """Two operations a weight and row for the answer, four for the slope; one evaluation a step is the least."""
    inputs, outputs = folds[0].x.shape[1], folds[0].y.shape[1]
    weights = [sum(a * b for a, b in pairwise((inputs, *layers, outputs))) for layers in candidates]
    return 6.0 * STEPS * float(sum(weights)) * sum(len(fold.x) for fold in folds)
