"""Versions of models chosen by name and compared pair by pair on the pulses in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from ....dataset.table import PulseTable
from ....training.estimators.base import SettingValue
from ....training.evaluation.comparison import Comparison, for_all_pairs
from ....training.evaluation.metrics import METRICS
from ....training.registry.evaluate import Evaluation, compared, evaluate_held_out
from ....training.registry.intact_models import intact_versions
from ....training.registry.listing import chosen, finite, in_order, newest, of_dataset
from ....training.registry.records import Version
from ....training.registry.registry import Registry
from .searches import searched_settings
from .tables import USUAL_SPLITS, floors_by_ground, json_row
from .wording import common_split, difference_sentence, promotable

#: Of so many versions every pair is compared, which takes a tenth of a second each; of more, the
#: best with all others.
MOST_EACH_WITH_EACH = 8
#: So many pairs are told in sentences, and group by group.
_TOLD_WHERE = 3


@dataclass(frozen=True, eq=False)
class Comparisons:
    """`versions` on the same pulses, the best first, and their comparisons.

    `settings` by label: those of each version's training; empty for a version of older software.
    `searched` by label: which of them a search chose. `rows` by label: each version as
    `tables.json_row` gives it.
    """

    versions: tuple[Version, ...]
    judged: Evaluation
    comparisons: tuple[Comparison, ...]
    settings: Mapping[str, Mapping[str, SettingValue]]
    searched: Mapping[str, Sequence[str]]
    rows: Mapping[str, Mapping[str, Any]]

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
        setting. The first row says which of them a search chose."""
        names = dict.fromkeys(
            name for version in self.versions for name in self.settings[version.label]
        )
        if not names:
            return []
        chosen_by_search = {
            version.label: ", ".join(self.searched[version.label]) or "none"
            for version in self.versions
        }
        searched: list[dict[str, Any]] = [{"setting": "chosen by a search", **chosen_by_search}]
        return searched + [
            {
                "setting": name,
                **{
                    version.label: self.settings[version.label].get(name)
                    for version in self.versions
                },
            }
            for name in names
        ]

    def as_plain(self) -> dict[str, Any]:
        """Versions with their mean errors on the `pulses` in common, the `differences` of each pair
        in every metric, the `settings`, and which version is `promotable`."""
        differences = [
            {
                **comparison.of(metric).row(),
                "p_value": finite(comparison.of(metric).p_value),
                "least_p_value": comparison.of(metric).least_p,
                "configurations": comparison.of(metric).configurations,
                "where": [group.row() for group in comparison.where(metric)],
            }
            for metric in METRICS
            for comparison in self.comparisons
        ]
        models = [self._model_row(version) for version in self.versions]
        plain = {
            "pulses": len(self.judged.pulses),
            "models": models,
            "differences": differences,
            "settings": self.settings_table(),
        }
        plain["promotable"] = promotable(plain, "force_nrmse")
        for row in differences:
            means = {model["label"]: model["metrics"][row["metric"]] for model in models}
            row["verdict"] = difference_sentence(row, means, common_split(plain)).text
        return plain

    def _model_row(self, version: Version) -> dict[str, Any]:
        errors = self.judged.errors[version.label]
        means = {metric: float(getattr(errors, metric).mean()) for metric in METRICS}
        row = self.rows[version.label]
        own = {
            key: value
            for key, value in row.items()
            if key not in ("ci90", "coverage90", "floor", "thesis")
        }
        pulses, settings = len(self.judged.pulses), dict(self.settings[version.label])
        own |= {"metrics": means, "pulses": pulses, "settings": settings}
        return {"label": version.label, **own}


def versions_named(
    versions: Sequence[Version], names: Sequence[str], dataset: str | None, split: str | None
) -> tuple[Version, ...]:
    """Those named, as they were judged on `split`; without a split, on the first one that all have
    in common. Without a name the newest of every model of the split, of the dataset trained on
    last.

    Raises `LookupError` for what there is not, `ValueError` for fewer than two.
    """
    if not versions:
        raise LookupError("no models yet; train some: pyroshock train DATASET")
    of_it = of_dataset(versions, dataset) if dataset is not None else list(versions)
    usual = split or _usual_split(versions)
    if names:
        labels = [
            chosen(versions if "@" in name else of_it, name, usual).label
            for name in dict.fromkeys(names)
        ]
        named = _on_split(versions, dict.fromkeys(labels), split)
    else:
        last = dataset or in_order(of_it)[0].dataset.hash
        newest_first = newest(
            version for version in of_dataset(of_it, last) if version.split == usual
        )
        named = list({version.name: version for version in reversed(newest_first)}.values())
    if len(named) < 2:
        labels = [version.label for version in named]
        if names:
            raise ValueError(
                f"a comparison needs two models, and {', '.join(labels)} alone is named; choose "
                "two or more of one dataset and split: MODEL or MODEL@VERSION"
            )
        raise ValueError(
            f"a comparison needs two models of split {usual!r}, and there is "
            f"{', '.join(labels) or 'none'}; train another one on the same dataset, or name two: "
            "MODEL or MODEL@VERSION"
        )
    return tuple(named)


def _on_split(
    versions: Sequence[Version], labels: Iterable[str], split: str | None
) -> list[Version]:
    """The records of these versions on a split, or on the first that all have in common."""
    records = [
        {version.split: version for version in versions if version.label == label}
        for label in labels
    ]
    usual = (*USUAL_SPLITS, *sorted(records[0]))
    common = [name for name in usual if all(name in of_version for of_version in records)]
    chosen_split = split or next(iter(common), None)
    return [
        of_version.get(chosen_split or "")
        or next(record for record in of_version.values() if record.is_served)
        for of_version in records
    ]


def _usual_split(versions: Sequence[Version]) -> str:
    splits = [version.split for version in versions]
    return "repetitions" if "repetitions" in splits or not splits else splits[0]


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
    searched = {version.label: searched_settings(registry.searches(version)) for version in ranked}
    floors = floors_by_ground(registry, ranked)
    rows = {v.label: json_row(v, floors[v.dataset.hash, v.seed]) for v in ranked}
    return Comparisons(tuple(ranked), judged, comparisons, settings, searched, rows)
