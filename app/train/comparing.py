"""`compare`: versions chosen, compared pair by pair, told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from ...dataset.table import PulseTable
from ...training.estimators.base import SettingValue
from ...training.evaluation.comparison import Comparison, Difference, for_all_pairs
from ...training.evaluation.metrics import METRICS
from ...training.registry.evaluate import Evaluation, evaluate_held_out
from ...training.registry.intact_models import intact_versions
from ...training.registry.listing import chosen, finite, in_order, newest, of_dataset, row_of
from ...training.registry.promotion import compared
from ...training.registry.records import Version
from ...training.registry.registry import Registry
from ...training.registry.usability import usability
from .tables import floors_by_ground

#: Splits whose held-out pulses are of configurations that a model has not seen: what a promotion
#: rests on.
UNSEEN_SPLITS = ("configurations", "treatments")
#: So many pairs are told in sentences, and group by group.
_TOLD_WHERE = 3


@dataclass(frozen=True, eq=False)
class Comparisons:
    """`versions` on the same pulses, the best first, and their comparisons.

    `settings` by label: what each version's training searched and found; empty for a version of
    older software. `not_usable` by label: why a version is no prediction, of those that are none.
    """

    versions: tuple[Version, ...]
    judged: Evaluation
    comparisons: tuple[Comparison, ...]
    settings: Mapping[str, Mapping[str, SettingValue]]
    not_usable: Mapping[str, str]

    @property
    def split(self) -> str:
        """On which the versions were judged; empty where it is not the same for all."""
        splits = {version.split for version in self.versions}
        return splits.pop() if len(splits) == 1 else ""

    def promotable(self, metric: str) -> str | None:
        """The version that is better than the one in use (else than all others) on unseen
        configurations, beyond chance, in a metric; None where there is none, as on repetitions."""
        best = self.versions[0].label
        if (
            self.split not in UNSEEN_SPLITS
            or best in self.not_usable
            or self.versions[0].champion_of
        ):
            return None
        pairs = [item.of(metric) for item in self.comparisons if best in (item.a, item.b)]
        in_use = {version.label for version in self.versions if version.champion_of}
        against = [row for row in pairs if not in_use or {row.a, row.b} & in_use]
        return best if against and all(row.beyond_chance for row in against) else None

    def table(self, metrics: Sequence[str]) -> list[dict[str, Any]]:
        """The mean errors, for people."""
        errors = self.judged.errors
        return [
            {"model": version.label, "split": version.split}
            | {metric: float(getattr(errors[version.label], metric).mean()) for metric in metrics}
            for version in self.versions
        ]

    def settings_table(self) -> list[dict[str, Any]]:
        """Rows with `setting` and a column for each version; None where a version has no such
        setting."""
        names = dict.fromkeys(
            name for version in self.versions for name in self.settings[version.label]
        )
        return [
            {"setting": name}
            | {version.label: self.settings[version.label].get(name) for version in self.versions}
            for name in names
        ]


def metrics_named(text: str) -> tuple[str, ...]:
    """Raises `ValueError` that names those there are."""
    if text == "all":
        return METRICS
    if text not in METRICS:
        raise ValueError(f"no metric {text!r}; there are: {', '.join(METRICS)}, or all")
    return (text,)


def versions_named(
    versions: Sequence[Version], names: Sequence[str], dataset: str | None, split: str
) -> tuple[Version, ...]:
    """Those named; without a name the newest of every model of the split, of the dataset trained on
    last."""
    if not versions:
        raise ValueError("no models yet; train some: pyroshock train DATASET")
    of_it = of_dataset(versions, dataset) if dataset is not None else list(versions)
    if names:
        chosen_versions = [
            chosen(versions if "@" in name else of_it, name, split) for name in names
        ]
    else:
        last = dataset or in_order(of_it)[0].dataset.hash
        newest_first = newest(
            version for version in of_dataset(of_it, last) if version.split == split
        )
        chosen_versions = list(
            {version.name: version for version in reversed(newest_first)}.values()
        )
    chosen_versions = list({version.label: version for version in chosen_versions}.values())
    if len(chosen_versions) < 2:
        labels = ", ".join(version.label for version in chosen_versions)
        raise ValueError(
            f"a comparison needs two models of split {split!r}, and there is "
            f"{labels or 'none'}; train "
            "another one on the same dataset, or name two: MODEL or MODEL@VERSION"
        )
    return tuple(chosen_versions)


def served(
    registry: Registry,
    versions: Sequence[Version],
    names: Sequence[str],
    tell: Callable[[str], None],
) -> list[Version]:
    """Without a name, those whose files are whole: one that is damaged stops no comparison that did
    not ask for it.

    Raises `ValueError` where fewer than two are left.
    """
    intact = list(versions) if names else intact_versions(registry, versions, tell)
    if len(intact) < 2:
        raise ValueError(
            f"{len(intact)} of {len(versions)} models have their files; train the others again"
        )
    return intact


def comparisons_of(
    registry: Registry,
    versions: Sequence[Version],
    metric: str,
    *,
    each_with_each: bool,
    read: Callable[[str], PulseTable],
) -> Comparisons:
    """Every pair, or the best in `metric` with every other. Raises as `evaluate_held_out`."""
    judged = evaluate_held_out(registry, versions, read)
    ranked = sorted(
        versions, key=lambda each: float(getattr(judged.errors[each.label], metric).mean())
    )
    labels = [version.label for version in versions]
    best = ranked[0].label
    pairs = (
        list(combinations(labels, 2)) if each_with_each else [(best, v.label) for v in ranked[1:]]
    )
    groups = len(pairs) <= _TOLD_WHERE
    comparisons = for_all_pairs(
        [compared(judged, a, b, groups or number == 0) for number, (a, b) in enumerate(pairs)]
    )
    settings = {version.label: registry.fit_settings(version) for version in ranked}
    return Comparisons(tuple(ranked), judged, comparisons, settings, _not_usable(registry, ranked))


def _not_usable(registry: Registry, versions: Sequence[Version]) -> dict[str, str]:
    floors = floors_by_ground(registry, versions)
    reasons = {v.label: usability([v], floors[v.dataset.hash, v.seed]) for v in versions}
    return {label: reason for label, reason in reasons.items() if reason}


def rows_of(comparisons: Comparisons, metrics: Sequence[str]) -> list[dict[str, Any]]:
    """JSON: the models as `train` lists them, on the common pulses; then a row for each pair and
    metric."""
    rows = []
    for version in comparisons.versions:
        errors = comparisons.judged.errors[version.label]
        means = {metric: float(getattr(errors, metric).mean()) for metric in METRICS}
        own = {
            key: value
            for key, value in row_of(version).items()
            if key not in ("ci90", "coverage90")
        }
        settings = dict(comparisons.settings[version.label])
        own |= {"not_usable": comparisons.not_usable.get(version.label)}
        rows.append(
            own | {"metrics": means, "pulses": len(comparisons.judged.pulses), "settings": settings}
        )
    for metric in metrics:
        for comparison in comparisons.comparisons:
            row = comparison.of(metric)
            count = {"least_p_value": row.least_p, "configurations": row.configurations}
            rows.append(
                row.row() | {"p_value": finite(row.p_value), "verdict": row.verdict} | count
            )
            rows[-1]["where"] = [row.row() for row in comparison.where(metric)]
    return rows


def comparison_sentences(comparisons: Comparisons, metrics: Sequence[str]) -> Iterator[str]:
    """Sentences: which version is not usable; which is better in each metric, and each one's lead
    in the groups where it is beyond chance."""
    yield from (f"{reason}." for reason in comparisons.not_usable.values())
    for comparison in comparisons.comparisons:
        for metric in metrics:
            yield comparison.of(metric).verdict
            groups = comparison.where(metric)
            for name, sign in ((comparison.a, -1), (comparison.b, 1)):
                leads = [_lead(row) for row in groups if row.difference * sign > 0]
                if leads:
                    yield f"  {name} is better where: {', '.join(leads)}"


def _lead(row: Difference) -> str:
    assert row.group is not None
    return f"{row.group[0]}={row.group[1]} ({abs(row.difference):.2g})"
