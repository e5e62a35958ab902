"""What datasets, trainings, comparisons and promotions come to, at every door."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from ...common.frames import frame_of, titled_table, with_units
from ...figures.figure import (
    DIMENSIONLESS,
    Figure,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    as_floats,
)
from ...figures.matplotlib_renderer import plot_on
from ..operation import Result, ResultTable
from ..sentence import Sentence
from .charts import difference_series

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ....dataset.snapshot import Snapshot
    from ....training.registry.records import Decision, Version
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
class FrozenDataset(Result):
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

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock dataset show --json` prints it."""
        from .datasets import snapshot_as_json

        return snapshot_as_json(self.snapshot)

    def splits(self, *, seed: int = 0) -> pd.DataFrame:
        """The ways in which the pulses can be parted for training, with the number of pulses on
        either side.

        Parameters:
            seed: Seed of the random splits.
        """
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
class TrainingRuns(Result):
    """Models that were trained, or were found trained already, each judged on pulses that it has
    not seen.

    `failures` are the models that could not learn from the dataset, with the reason; `floors` by
    split what repeated impacts differ by, as the registry keeps it; `remarks` what the training
    told.
    """

    versions: tuple[Version, ...]
    failures: dict[str, str]
    trained: int
    floors: Mapping[str, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def notes(self) -> Sequence[str]:
        """What the training told, which models are not usable, and how many were trained."""
        earlier = len(self.versions) - self.trained
        return (
            *self.remarks,
            *(str(row["not_usable"]) for row in self.to_json() if row["not_usable"]),
            f"{_models(self.trained)} trained now; {_models(earlier)} registered already",
        )

    def tables(self) -> Sequence[ResultTable]:
        """The models, the best first, with their figures on every split."""
        from .tables import table_of

        return (ResultTable("", table_of(self.versions, self.floors), "nothing was trained"),)

    def to_json(self) -> list[dict[str, Any]]:
        """A row for each version, as `pyroshock train --json` prints it."""
        from .tables import json_row

        return [json_row(version, self.floors) for version in self.versions]

    def fault(self) -> str:
        """The models that could not learn from the dataset."""
        words = "; ".join(f"{model}: {reason}" for model, reason in self.failures.items())
        return f"not trained: {words}" if words else ""

    def address(self) -> str:
        """The page of models."""
        return "/models"

    def summary(self) -> str:
        """How many were trained, and which failed."""
        earlier = len(self.versions) - self.trained
        failed = ", ".join(model.partition(" ")[0] for model in self.failures)
        words = f"{self.trained} trained, {earlier} found as they were trained before"
        return f"{words}; not trained: {failed}" if failed else words

    def next_command(self) -> Sequence[str]:
        """A comparison of several models; the promotion of a usable one."""
        if not self.versions:
            return ()
        last, dataset = self.versions[-1], self.versions[0].dataset.name
        if len({version.name for version in self.versions}) > 1:
            return ("compare", "--dataset", dataset, "--split", last.split)
        if not any(row["not_usable"] for row in self.to_json()):
            return ("promote", last.label)
        return ("train", dataset)

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

    def figures(self) -> Sequence[Figure]:
        """The errors of the versions."""
        return (self.figure(),) if self.versions else ()

    def plot(self, ax: Axes | None = None, *, metric: str = "force_nrmse") -> Axes:
        """The error of each version with its 90 % interval, the best one at the top.

        Parameters:
            ax: The axes to draw on; by default new ones.
            metric: The name of the error, one of `training.evaluation.metrics.METRICS`.
        """
        return plot_on(self.figure(metric=metric), ax)

    def figure(self, *, metric: str = "force_nrmse") -> Plot:
        """The error of each version with its 90 % interval, as a figure.

        Parameters:
            metric: The name of the error, one of `training.evaluation.metrics.METRICS`.
        """
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
class ModelComparison(Result):
    """Versions on the held-out pulses that none of them was trained on, and the differences of each
    pair. `metric` is the one that is asked for, or "all"; `remarks` what was left out, and which
    pulses were withdrawn."""

    comparisons: Comparisons
    metric: str
    remarks: tuple[str, ...] = ()

    @property
    def metrics(self) -> tuple[str, ...]:
        """Those that sentences and tables are about."""
        from ....training.evaluation.metrics import METRICS

        return METRICS if self.metric == "all" else (self.metric,)

    @cached_property
    def plain(self) -> dict[str, Any]:
        """The comparison as plain data (`Comparisons.as_plain`)."""
        return self.comparisons.as_plain()

    def notes(self) -> Sequence[str]:
        """What was left out, and which pulses were withdrawn."""
        return self.remarks

    def sentences(self) -> Sequence[Sentence]:
        """Which version is usable, which is better, by how much, where, and whether that is beyond
        chance."""
        from .wording import comparison_sentences

        return tuple(comparison_sentences(self.plain, self.metrics))

    def tables(self) -> Sequence[ResultTable]:
        """Mean errors, differences, and the settings of each training."""
        from .wording import comparison_tables

        settings = self.plain["settings"]
        of_settings = [ResultTable("Settings of each training", settings)] if settings else []
        return [*comparison_tables(self.plain, self.metrics), *of_settings]

    def to_json(self) -> list[dict[str, Any]]:
        """The models, then the differences of each pair, as `pyroshock compare --json` prints
        them."""
        models = [
            {key: value for key, value in model.items() if key != "label"}
            for model in self.plain["models"]
        ]
        differences = self.plain["differences"]
        return [*models, *(row for row in differences if row["metric"] in self.metrics)]

    def to_network_json(self) -> dict[str, Any]:
        """Models, differences, settings and what can be promoted, in one object."""
        return self.plain

    def next_command(self) -> Sequence[str]:
        """A promotion where the comparison on unseen configurations allows it, else a training that
        would decide."""
        from .wording import UNSEEN_SPLITS, common_split

        if (label := self.plain["promotable"]) is not None:
            return ("promote", label)
        if common_split(self.plain) in UNSEEN_SPLITS:
            return ()
        versions = self.comparisons.versions
        names = ",".join(dict.fromkeys(version.name for version in versions))
        dataset = versions[0].dataset.name
        return ("train", dataset, "--models", names, "--split", "configurations")

    def to_frame(self) -> pd.DataFrame:
        """The mean errors of each version in every metric, the best first."""
        from ....training.evaluation.metrics import METRICS

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

    def figures(self) -> Sequence[Figure]:
        """The first pair: all metrics over all pulses, and the first metric by group."""
        from .charts import comparison_figure

        return (comparison_figure(self.comparisons.comparisons[0], self.metrics[0]),)

    def plot(self, ax: Axes | None = None) -> Axes:
        """The difference of the first pair with its 90 % interval, over all pulses and by group.

        Parameters:
            ax: The axes to draw on; by default new ones.
        """
        return plot_on(self.figure(), ax)

    def figure(self) -> Plot:
        """The difference of the first pair, over all pulses and by group, as a figure."""
        comparison, metric = self.comparisons.comparisons[0], self.metrics[0]
        rows = [
            comparison.of(metric),
            *(row for row in comparison.by_group if row.metric == metric),
        ]
        names = tuple(
            "all pulses" if row.group is None else f"{row.group[0]} = {row.group[1]}"
            for row in rows
        )
        quantity = f"{metric} of {comparison.a} minus that of {comparison.b}"
        return _rows_plot(quantity, quantity, names, difference_series(rows))

    def __repr__(self) -> str:
        return "\n".join(map(str, self.sentences()))

    def _repr_html_(self) -> str:
        lines = [str(claim) for claim in self.sentences()]
        return titled_table(lines[0], self.to_frame()) + "".join(
            f"<p>{escape(line)}</p>" for line in lines
        )


@dataclass(frozen=True)
class PromotionDecision(Result):
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

    @property
    def exit_code(self) -> int:
        """1 of a refusal, 3 where there was not enough to judge."""
        if self.promoted:
            return 0
        return 3 if self.decision.verdict == "not enough to judge" else 1

    def notes(self) -> Sequence[str]:
        """What was decided, and why."""
        return (self.sentence,)

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock promote --json` prints it."""
        return decision_json(self.decision)

    def address(self) -> str:
        """The page of the version, with the decision at its top."""
        name, _, number = self.decision.candidate.partition("@")
        return f"/models/{quote(name, safe='')}/{number}?decided=true"

    def next_command(self) -> Sequence[str]:
        """A prediction with the promoted version; a comparison of a refused one with that in
        use."""
        if self.promoted:
            return ("predict",)
        if (champion := self.decision.champion) is None:
            return ()
        return ("compare", self.decision.candidate, champion, "--split", "configurations")

    def __repr__(self) -> str:
        return self.sentence


def decision_json(decision: Decision) -> dict[str, Any]:
    """A decision on a promotion as plain data, its time as text.

    Parameters:
        decision: The decision as the registry keeps it.
    """
    return {**asdict(decision), "when": decision.when.isoformat(timespec="seconds")}


def _models(count: int) -> str:
    return f"{count} model{'' if count == 1 else 's'}"


def versions_frame(versions: Iterable[Version]) -> pd.DataFrame:
    """Registered versions, a row each.

    Parameters:
        versions: The versions, in the order of the rows.

    Returns:
        Mean and ends of the 90 % interval of each metric, and the duration of the training in s.
    """
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
