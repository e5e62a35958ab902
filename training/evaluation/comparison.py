"""Which of two models is better, where, and whether that is beyond chance.

Both have predicted the same held-out pulses. What is compared is the difference of their errors,
pulse by pulse, summed by configuration: repetitions of a configuration are no independent evidence.

- Interval: bootstrap of whole configurations (`summary.bootstrap_interval`), 90 %.
- p-value: two-sided sign-flip test (Fisher's randomisation; Good, Permutation, Parametric and
  Bootstrap Tests of Hypotheses, 3rd ed. 2005). Were the models alike, each configuration's
  difference could as well have the other sign. Exact where all 2^k signs can be tried, else by
  random ones with (1 + hits) / (1 + draws), which never is zero (Phipson and Smyth, Stat. Appl.
  Genet. Mol. Biol. 9, 2010, 39). Unlike a bootstrap's it keeps its level with few configurations.
- Groups are many, so their p-values are Holm's, over all groups of one metric. So are the pairs of
  a comparison of several models (`for_all_pairs`).

Where models may differ: labels of pulses by what lies in a contact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import Inputs, PulseTable, Texts
from .metrics import METRICS, PulseErrors
from .summary import bootstrap_interval, clustered, holm, least_p_value, sign_flip_p

#: Below which a difference is told to be beyond chance.
LEVEL = 0.05


@dataclass(frozen=True)
class Difference:
    """Mean error of `a` minus that of `b` in one metric, over all pulses or over those of a group.

    `low` to `high` is the 90 % interval (NaN with a single configuration); `p_value` of a group is
    corrected for their number. `least_p` is the least p-value that so many configurations can give.
    `group` is ("tip_material", "steel"), None for all pulses.
    """

    a: str
    b: str
    metric: str
    mean_a: float
    mean_b: float
    low: float
    high: float
    p_value: float
    pulses: int
    configurations: int
    group: tuple[str, str] | None = None
    least_p: float = 0.0

    @property
    def difference(self) -> float:
        """Below zero where `a` is the better one."""
        return self.mean_a - self.mean_b

    @property
    def beyond_chance(self) -> bool:
        """Whether chance alone would hardly have made it."""
        return self.p_value < LEVEL

    def row(self) -> dict[str, Any]:
        """As commands print it in JSON."""
        finite = np.isfinite([self.low, self.high]).all()
        named: dict[str, Any] = {
            "a": self.a,
            "b": self.b,
            "metric": self.metric,
            "difference": self.difference,
        }
        named |= {"ci90": [self.low, self.high] if finite else None, "p_value": self.p_value}
        return named | ({"group": {self.group[0]: self.group[1]}} if self.group else {})


@dataclass(frozen=True)
class Comparison:
    """`overall`: one difference a metric; `by_group`: one a metric and label of each grouping."""

    a: str
    b: str
    overall: tuple[Difference, ...]
    by_group: tuple[Difference, ...]

    def of(self, metric: str) -> Difference:
        """The difference over all pulses.

        Parameters:
            metric: A metric of `METRICS`, such as "force_nrmse".

        Raises:
            LookupError: For an unknown metric, with those there are.
        """
        for row in self.overall:
            if row.metric == metric:
                return row
        raise LookupError(
            f"no metric {metric!r}; there are: {', '.join(row.metric for row in self.overall)}"
        )

    def where(self, metric: str) -> tuple[Difference, ...]:
        """The groups in which the models differ beyond chance.

        Parameters:
            metric: A metric of `METRICS`, such as "force_nrmse".
        """
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

    Parameters:
        a: The errors of the first model.
        b: The errors of the second model.
        configuration: The configuration (n,) of each pulse: what is drawn together.
        groups: Labels (n,) by grouping, as `comparison_groups` gives them.
        rng: The generator of draws. The same state gives mirrored numbers when a and b change
            places.
        names: The labels of both models; by default "A" and "B".
        resamples: How often configurations are drawn for an interval; by default 2000 times.
        draws: The number of combinations of signs that are drawn for a p-value; by default 4999.

    Raises:
        ValueError: Where lengths differ.
    """
    sizes = {len(a), len(b), len(configuration), *(len(labels) for labels in groups.values())}
    if len(sizes) != 1:
        raise ValueError(
            f"{len(a)} errors of {names[0]}, {len(b)} of {names[1]}: compare "
            f"them on the same pulses"
        )
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
            least_p=least_p_value(len(clusters)),
        )


def _corrected(rows: list[Difference]) -> tuple[Difference, ...]:
    """The same with p-values for as many questions as there are groups, metric by metric."""
    corrected = list(rows)
    for metric in METRICS:
        places = [i for i, row in enumerate(rows) if row.metric == metric]
        for i, p_value in zip(
            places, holm(np.array([rows[i].p_value for i in places])), strict=True
        ):
            corrected[i] = replace(rows[i], p_value=float(p_value))
    return tuple(corrected)


def for_all_pairs(comparisons: Sequence[Comparison]) -> tuple[Comparison, ...]:
    """The same comparisons with p-values for as many questions as there are pairs. Those over all
    pulses are Holm's, metric by metric; those of groups, which are Holm's within their pair, are
    multiplied by the number of pairs.

    Parameters:
        comparisons: What `compare` gave for each pair of models.
    """
    pairs = len(comparisons)
    if pairs < 2:
        return tuple(comparisons)
    overall = [list(comparison.overall) for comparison in comparisons]
    for place in range(len(overall[0])):
        p_values = holm(np.array([rows[place].p_value for rows in overall]))
        for rows, p_value in zip(overall, p_values.tolist(), strict=True):
            rows[place] = replace(
                rows[place], p_value=p_value, least_p=min(1.0, pairs * rows[place].least_p)
            )
    return tuple(
        Comparison(
            comparison.a,
            comparison.b,
            tuple(rows),
            tuple(
                replace(row, p_value=min(1.0, pairs * row.p_value)) for row in comparison.by_group
            ),
        )
        for comparison, rows in zip(comparisons, overall, strict=True)
    )


#: From slow to fast, a third of the pulses each.
SPEEDS = ("slow", "middle", "fast")


def comparison_groups(pulses: PulseTable) -> dict[str, Texts]:
    """Labels (n,) by tip, target, every predictor that is a category, and tercile of the impact
    velocity.

    Groupings with one label only are left out: they tell nothing that all pulses together do not.

    Parameters:
        pulses: The n pulses on which models are compared.
    """
    named: dict[str, Texts] = {
        "tip_material": pulses.tip_material,
        "target_material": pulses.target_material,
    }
    named |= {p.name: level_names(pulses, p.name) for p in pulses.predictors if p.levels}
    named["impact_velocity"] = speed_terciles(pulses)
    return {name: labels for name, labels in named.items() if len(np.unique(labels)) > 1}


def level_names(inputs: Inputs, name: str) -> Texts:
    """The levels (n,) of a category by their names.

    Parameters:
        inputs: The impacts.
        name: The name of the predictor.

    Raises:
        LookupError: For a predictor that is no category.
    """
    levels = next((p.levels for p in inputs.predictors if p.name == name), ())
    if not levels:
        raise LookupError(f"predictor {name!r} has no levels")
    return np.array(levels)[inputs.column(name).astype(np.int64)]


def speed_terciles(inputs: Inputs) -> Texts:
    """Slow, middle or fast (n,), by thirds of these impacts.

    Parameters:
        inputs: The impacts, with the predictor `impact_velocity`.
    """
    velocity = inputs.column("impact_velocity")
    return np.array(SPEEDS)[np.searchsorted(np.quantile(velocity, [1 / 3, 2 / 3]), velocity)]
