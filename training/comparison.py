"""Which of two models is better, where, and whether that is beyond chance.

Both have predicted the same held-out pulses. What is compared is the difference of their errors, pulse by pulse, summed
by configuration: repetitions of a configuration are no independent evidence.

- Interval: bootstrap of whole configurations (`metrics/clusters.py`), 90 %.
- p-value: two-sided sign-flip test (Fisher's randomisation; Good, Permutation, Parametric and Bootstrap Tests of
  Hypotheses, 3rd ed. 2005). Were the models alike, each configuration's difference could as well have the other sign.
  Exact where all 2^k signs can be tried, else by random ones with (1 + hits) / (1 + draws), which never is zero
  (Phipson and Smyth, Stat. Appl. Genet. Mol. Biol. 9, 2010, 39). Unlike a bootstrap's it keeps its level with few
  configurations.
- Groups are many, so their p-values are Holm's, over all groups of one metric.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .difference import Difference
from .metrics.clusters import bootstrap_interval, clustered
from .metrics.errors import METRICS, PulseErrors
from .metrics.significance import holm, sign_flip_p


@dataclass(frozen=True)
class Comparison:
    """`overall`: one difference a metric; `by_group`: one a metric and label of each grouping."""

    a: str
    b: str
    overall: tuple[Difference, ...]
    by_group: tuple[Difference, ...]

    def of(self, metric: str) -> Difference:
        """Over all pulses. Raises `LookupError` that names the metrics there are."""
        for row in self.overall:
            if row.metric == metric:
                return row
        raise LookupError(f"no metric {metric!r}; there are: {', '.join(row.metric for row in self.overall)}")

    def where(self, metric: str) -> tuple[Difference, ...]:
        """The groups in which the models differ beyond chance, in the metric."""
        return tuple(row for row in self.by_group if row.metric == metric and row.beyond_chance)

    def rows(self) -> list[dict[str, Any]]:
        """All differences, as commands print them in JSON; those over all pulses first."""
        return [row.row() for row in self.overall + self.by_group]


def compare(
    a: PulseErrors,
    b: PulseErrors,
    configuration: NDArray[Any],
    groups: Mapping[str, NDArray[Any]],
    rng: np.random.Generator,
    *,
    names: tuple[str, str] = ("A", "B"),
    resamples: int = 2000,
    draws: int = 4999,
) -> Comparison:
    """Compare the errors of two models on the same n pulses, row by row.

    `configuration` (n,) tells what is drawn together; `groups` gives labels (n,) by grouping (`comparison_groups`). The
    same generator state gives mirrored numbers when a and b change places. Raises `ValueError` where lengths differ.
    """
    sizes = {len(a), len(b), len(configuration), *(len(labels) for labels in groups.values())}
    if len(sizes) != 1:
        raise ValueError(f"{len(a)} errors of {names[0]}, {len(b)} of {names[1]}: compare them on the same pulses")
    errors = (_stack(a), _stack(b))
    overall = tuple(_differences(errors, configuration, rng, names, resamples, draws))
    by_group: list[Difference] = []
    for grouping, labels in groups.items():
        for label in np.unique(labels):
            rows = labels == label
            part = (errors[0][rows], errors[1][rows])
            differences = _differences(part, configuration[rows], rng, names, resamples, draws)
            by_group += [replace(row, group=(grouping, str(label))) for row in differences]
    return Comparison(*names, overall, _corrected(by_group))


def _stack(errors: PulseErrors) -> Floats:
    return np.stack([getattr(errors, name) for name in METRICS], axis=1)


def _differences(
    errors: tuple[Floats, Floats],
    configuration: NDArray[Any],
    rng: np.random.Generator,
    names: tuple[str, str],
    resamples: int,
    draws: int,
) -> Iterator[Difference]:
    clusters = clustered(errors[0] - errors[1], configuration)
    low, high = bootstrap_interval(clusters, rng, resamples)
    p_values = sign_flip_p(clusters, rng, draws)
    means = [part.mean(axis=0) for part in errors]
    for i, metric in enumerate(METRICS):
        yield Difference(
            *names,
            metric=metric,
            mean_a=float(means[0][i]),
            mean_b=float(means[1][i]),
            low=float(low[i]),
            high=float(high[i]),
            p_value=float(p_values[i]),
            pulses=len(errors[0]),
            configurations=len(clusters),
        )


def _corrected(rows: list[Difference]) -> tuple[Difference, ...]:
    """The same with p-values for as many questions as there are groups, metric by metric."""
    corrected = list(rows)
    for metric in METRICS:
        places = [i for i, row in enumerate(rows) if row.metric == metric]
        for i, p_value in zip(places, holm(np.array([rows[i].p_value for i in places])), strict=True):
            corrected[i] = replace(rows[i], p_value=float(p_value))
    return tuple(corrected)
