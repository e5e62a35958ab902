"""Datasets, trainings, comparisons and promotions as notebooks and the command line call them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...dataset.catalog import list_withdrawals
from ..common.frames import frame_of, titled_table, with_units
from ..common.model_registry import (
    context_of,
    models_extra,
    pulses_on,
    reader_of,
    registry_of,
    splits_of,
    usual_splits,
    withdrawn_words,
)
from ..figures.figure import (
    DIMENSIONLESS,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    as_floats,
)
from ..figures.matplotlib_renderer import plot_on
from .charts import difference_series
from .registered_figures import RegisteredFigures

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ...dataset.snapshot import Snapshot
    from ...parallel.executor import ExecutorConfig
    from ...schema.session import Store
    from ...training.fitting.session import Progress, Session
    from ...training.models.catalogue import Budget
    from ...training.registry.records import Decision, Version
    from .comparing import Comparisons

#: Metric of a registered model -> title of its column.
_METRICS = (
    "force_nrmse",
    "contact_time_error",
    "impulse_error",
    "cost",
    "force_covered",
    "time_covered",
)


@dataclass(frozen=True, eq=False)
class FrozenDataset:
    """Pulses of campaigns, frozen for training: the same name and hash always hold the same
    pulses."""

    snapshot: Snapshot

    @property
    def name(self) -> str:
        """Under which it was frozen."""
        return self.snapshot.name

    @property
    def hash(self) -> str:
        """SHA-256 of its content."""
        return self.snapshot.hash

    def __len__(self) -> int:
        return len(self.snapshot.table)

    def to_frame(self) -> pd.DataFrame:
        """A pulse in each row: key, configuration, predictors (categories by name), mass of the
        impactor and thickness of the plate, contact time, force points: what `StoredModel.predict`
        takes."""
        import pandas as pd

        from .datasets import dataset_columns

        return with_units(pd.DataFrame(dataset_columns(self.snapshot.table)))

    def splits(self, *, seed: int = 0) -> pd.DataFrame:
        """The ways in which the pulses can be parted for training, with the number of pulses on
        either side."""
        from .datasets import snapshot_as_json

        return frame_of(snapshot_as_json(self.snapshot, seed)["splits"])

    def __repr__(self) -> str:
        return f"<dataset {self.name}: {len(self)} pulses, hash {self.hash[:12]}>"

    def _repr_html_(self) -> str:
        from .datasets import range_rows

        return titled_table(
            f"dataset {self.name}: {len(self)} pulses", frame_of(range_rows(self.snapshot))
        )


@dataclass(frozen=True, eq=False)
class TrainingRuns:
    """Models that were trained, or were found trained already, each judged on pulses that it has
    not seen.

    `failures` are the models that could not learn from the dataset, with the reason.
    """

    versions: tuple[Version, ...]
    failures: dict[str, str]
    trained: int

    def __iter__(self) -> Any:
        return iter(self.labels)

    def __len__(self) -> int:
        return len(self.versions)

    @property
    def labels(self) -> list[str]:
        """ "hybrid@3" and so on, as `compare` and `promote` take them."""
        return [version.label for version in self.versions]

    def to_frame(self) -> pd.DataFrame:
        """A version in each row: errors on the held-out pulses with 90 % intervals, coverage,
        seconds."""
        return versions_frame(self.versions)

    def plot(self, ax: Axes | None = None, *, metric: str = "force_nrmse") -> Axes:
        """The error of each version with its 90 % interval, the best one at the top."""
        return plot_on(self.figure(metric=metric), ax)

    def figure(self, *, metric: str = "force_nrmse") -> Plot:
        """The error of each version with its 90 % interval, as a figure."""
        ranked = sorted(self.versions, key=lambda version: version.metrics[metric].mean)
        estimates = [version.metrics[metric] for version in ranked]
        errors = PointSeries(
            as_floats([estimate.mean for estimate in estimates]),
            np.arange(len(ranked), dtype=np.float64),
            x_low=as_floats([estimate.low for estimate in estimates]),
            x_high=as_floats([estimate.high for estimate in estimates]),
            detail="error",
        )
        quantity = f"{metric} on held-out pulses, with its 90 % interval"
        names = tuple(f"{version.label} ({version.split})" for version in ranked)
        return _rows_plot("Errors of the versions", quantity, names, (errors,))

    def __repr__(self) -> str:
        return f"<{self._sentence()}: {', '.join(self.labels)}>"

    def _repr_html_(self) -> str:
        return titled_table(self._sentence(), self.to_frame())

    def _sentence(self) -> str:
        failed = f", {len(self.failures)} not trained" if self.failures else ""
        return f"{self.trained} trained, {len(self.versions) - self.trained} trained before{failed}"


@dataclass(frozen=True, eq=False)
class ModelComparison:
    """Versions on the held-out pulses that none of them was trained on, and the differences of each
    pair."""

    comparisons: Comparisons
    metric: str

    @property
    def sentences(self) -> list[str]:
        """Which version is better, by how much, where, and whether that is beyond chance."""
        from .comparing import comparison_sentences

        return list(comparison_sentences(self.comparisons, (self.metric,)))

    def to_frame(self) -> pd.DataFrame:
        """The mean errors of each version in every metric, the best first."""
        from ...training.evaluation.metrics import METRICS

        return frame_of(self.comparisons.table(METRICS))

    def differences(self) -> pd.DataFrame:
        """The difference of each pair in every metric, over all pulses and by group, with interval
        and p-value."""
        return frame_of(
            row for comparison in self.comparisons.comparisons for row in comparison.rows()
        )

    def settings(self) -> pd.DataFrame:
        """What each version's training searched and found: a row for each setting, a column for
        each version."""
        return frame_of(
            self.comparisons.settings_table(),
            ("setting", *(v.label for v in self.comparisons.versions)),
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """The difference of the first pair with its 90 % interval, over all pulses and by group."""
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The difference of the first pair, over all pulses and by group, as a figure."""
        comparison = self.comparisons.comparisons[0]
        rows = [
            comparison.of(self.metric),
            *(row for row in comparison.by_group if row.metric == self.metric),
        ]
        names = tuple(
            "all pulses" if row.group is None else f"{row.group[0]} = {row.group[1]}"
            for row in rows
        )
        quantity = f"{self.metric} of {comparison.a} minus that of {comparison.b}"
        return _rows_plot(quantity, quantity, names, difference_series(rows))

    def __repr__(self) -> str:
        return "\n".join(self.sentences)

    def _repr_html_(self) -> str:
        return titled_table(self.sentences[0], self.to_frame()) + "".join(
            f"<p>{line}</p>" for line in self.sentences
        )


@dataclass(frozen=True)
class PromotionDecision:
    """Whether a version was put in use, why, and on which figures."""

    decision: Decision

    @property
    def promoted(self) -> bool:
        """Whether the version is now in use."""
        return self.decision.promoted

    @property
    def sentence(self) -> str:
        """ "hybrid@3 is now in use for the gun (none before)", with the reason and what it was
        judged on."""
        decision = self.decision
        kind, candidate, champion = decision.predictor_set, decision.candidate, decision.champion
        why = f": {decision.reason}" if decision.reason else ""
        judged = (
            f" (judged on {decision.pulses} pulses, {decision.judged_on})"
            if decision.pulses
            else ""
        )
        if not decision.promoted:
            stays = f"{champion} stays in use" if champion else "no model is in use"
            if decision.verdict == "not enough to judge":
                return (
                    f"{candidate} is not promoted, {stays} for the {kind}: not "
                    f"enough to judge{why}{judged}"
                )
            return f"{candidate} is refused, {stays} for the {kind}{why}{judged}"
        if champion == candidate:
            return f"{candidate} is in use for the {kind}, as before"
        before = f"{champion} before" if champion else "none before"
        return f"{candidate} is now in use for the {kind} ({before}){why}{judged}"

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock promote --json` prints it."""
        return asdict(self.decision)

    def __repr__(self) -> str:
        return self.sentence


def train_models(
    store: Store,
    url: str,
    dataset: str,
    models: Sequence[str],
    splits: str | None,
    *,
    seed: int = 0,
    budget: Budget = "reduced",
    retrain: bool = False,
    executor: ExecutorConfig | None = None,
    progress: Progress | None = None,
) -> tuple[Session, dict[str, str]]:
    """Train models on splits of a dataset and register them: the session, and the repeatability
    floor by split.

    `splits` is a comma list; None: repetitions and configurations, as far as the dataset can be
    split so. Raises as `model_catalogue.models_of`, `splits_of` and `read_snapshot`.
    """
    from ...parallel.executor import HERE
    from ...training.fitting import session as training_session
    from ...training.models.catalogue import models_of
    from ..common.registered_models import note_registered

    names = models_of(",".join(models))
    registry = registry_of(url)
    context = context_of(store, dataset, registry, seed, budget, RegisteredFigures())
    wanted = splits_of(context.table, usual_splits(context.table) if splits is None else splits)
    with models_extra():
        session = training_session.train(
            registry,
            context,
            names,
            wanted,
            retrain=retrain,
            executor=executor or HERE,
            progress=progress or training_session.Progress(),
        )
        note_registered(store, registry)
        return session, registry.floors(context.dataset.hash, seed)


def training_runs(session: Session) -> TrainingRuns:
    """What a session came to, as a notebook sees it."""
    failures = {
        f"{failure.model} ({failure.split})": failure.reason for failure in session.failures
    }
    return TrainingRuns(tuple(session.versions), failures, session.trained)


def versions_frame(versions: Iterable[Version]) -> pd.DataFrame:
    """Registered versions, a row each."""
    rows = []
    for version in versions:
        row: dict[str, Any] = {
            "model": version.label,
            "split": version.split,
            "in_use": version.champion_of or "",
            "dataset": version.dataset.name,
        }
        for metric in _METRICS:
            if metric in version.metrics:
                estimate = version.metrics[metric]
                row |= {
                    metric: estimate.mean,
                    f"{metric}_low": estimate.low,
                    f"{metric}_high": estimate.high,
                }
        rows.append(
            row | {"duration_s": version.cost.seconds, "registered_at": version.registered_at}
        )
    return frame_of(rows, ("model", "split", "in_use", "dataset"))


def compare_versions(
    store: Store,
    url: str,
    names: Sequence[str],
    *,
    dataset: str | None = None,
    split: str | None = None,
    metric: str = "force_nrmse",
    note: Callable[[str], None] = lambda _: None,
) -> Comparisons:
    """Versions compared on the held-out pulses they have in common, each with each; without names,
    the best of the split with all others. Without `split` it is repetitions, or that of the newest
    model where none was judged on repetitions. `note` is told what was left out and which pulses
    were withdrawn.

    Raises as `comparing.versions_named` and `comparing.comparisons_of`.
    """
    from .comparing import comparisons_of, served, versions_named

    with models_extra():
        registry = registry_of(url)
        registered = registry.versions()
        versions = served(
            registry,
            versions_named(registered, names, dataset, split or _usual_split(registered)),
            names,
            note,
        )
        for words in withdrawn_words(store.read(list_withdrawals), versions):
            note(words)
        return comparisons_of(
            registry, versions, metric, each_with_each=bool(names), read=reader_of(store)
        )


def _usual_split(versions: Sequence[Version]) -> str:
    splits = [version.split for version in versions]
    return "repetitions" if "repetitions" in splits or not splits else splits[0]


def promote_version(
    store: Store,
    url: str,
    model: str,
    *,
    on: str | None = None,
    force: bool = False,
    reason: str = "",
) -> PromotionDecision:
    """Put "hybrid@3" in use, or refuse it. Raises `ValueError` for a model without its version."""
    from ...training.registry.listing import chosen
    from ...training.registry.promotion import promote

    name, at, number = model.partition("@")
    if not at or not number.isdecimal():
        raise ValueError(f"model is {model!r}; expected MODEL@VERSION, such as hybrid@3")
    with models_extra():
        registry = registry_of(url)
        candidate = chosen(registry.versions(), model)
        other = None if on is None else (on, pulses_on(store, on, candidate))
        return PromotionDecision(
            promote(
                registry,
                name,
                int(number),
                reader_of(store),
                other=other,
                forced=force,
                reason=reason,
            )
        )


def _rows_plot(
    title: str, quantity: str, names: tuple[str, ...], series: tuple[PlotSeries, ...]
) -> Plot:
    """Points with intervals, a row for each name."""
    return Plot(
        title,
        PlotAxis(quantity, DIMENSIONLESS),
        PlotAxis("", categories=names, reversed=True),
        series,
        (ReferenceLine("x", 0.0, dash="solid"),),
        height=96 + 30 * max(len(names), 2),
    )
