"""The learning curve of a registered version: its error on held-out pulses by the number of shots
that it learned from. It costs several trainings, so that it is a job, and is stored with the
version."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ...figures.figure import (
    DIMENSIONLESS,
    Figure,
    LineSeries,
    Plot,
    PlotAxis,
    PointSeries,
    ReferenceLine,
    as_floats,
    category,
)
from ..fields import Seed, request_field
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Progress, Result, ResultTable
from ..sentence import Number, Sentence, sentence
from ..twin_fields import Word
from .promote import NamedVersion
from .wording import metric_cell, metric_number

if TYPE_CHECKING:
    from ....training.registry.records import Version

_METRIC = "force_nrmse"
#: Relative fall of the error from the third to the last point below which more shots hardly help.
_FLAT = 0.05


class CurveRequest(NamedVersion):
    """The version whose learning curve is computed."""

    split: Word | None = request_field(
        None,
        help="Judge on the held-out pulses of this split. [default: that of the version in use]",
    )
    seed: Seed = request_field(
        0, help="Set the seed of the order in which configurations are taken."
    )


@dataclass(frozen=True)
class VersionCurve(Result):
    """The points of a learning curve as plain data, the fewest shots first."""

    label: str
    split: str
    points: Sequence[Mapping[str, Any]]

    def sentences(self) -> Sequence[Sentence]:
        """How much the error fell, and whether more shots are likely to help."""
        return tuple(curve_sentences(self.points))

    def tables(self) -> Sequence[ResultTable]:
        """A row for each part of the configurations."""
        title = f"Learning curve of {self.label}, split {self.split}"
        return (ResultTable(title, curve_rows(self.points)),)

    def figures(self) -> Sequence[Figure]:
        """Error over shots."""
        return (curve_figure(self.points),)

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock models learning-curve --json` prints it."""
        return {"model": self.label, "split": self.split, "points": list(self.points)}

    def address(self) -> str:
        """The page of the version."""
        name, _, number = self.label.partition("@")
        return f"/models/{quote(name, safe='')}/{number}?split={quote(self.split, safe='')}"

    def summary(self) -> str:
        """The curve in a sentence."""
        return " ".join(map(str, self.sentences()))


def curve_rows(points: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The points as rows of a table."""
    return [
        {
            "configurations": point["configurations"],
            "share of all": Number("share", point["share"], "share").cell,
            "shots": point["pulses"],
            "force error": metric_cell(_METRIC, point["error"]),
            "from": metric_cell(_METRIC, point["low"]),
            "to": metric_cell(_METRIC, point["high"]),
            "trainings": f"{point['orders']} of {point['orders'] + point['failed']}",
        }
        for point in points
    ]


def curve_sentences(points: Sequence[Mapping[str, Any]]) -> Iterator[Sentence]:
    """How far the error fell, and whether it still falls."""
    if len(points) < 2:
        return
    first, last = points[0], points[-1]
    yield sentence(
        "From {few} to {all} shots, the force error on the same held-out pulses goes from {before} "
        "to {after}.",
        few=Number("pulses", first["pulses"], "count"),
        all=Number("pulses", last["pulses"], "count"),
        before=metric_number(_METRIC, first["error"]),
        after=metric_number(_METRIC, last["error"]),
    )
    previous = points[-2]
    if previous["error"] <= 0:
        return
    fall = 1 - last["error"] / previous["error"]
    shown = {
        "before": metric_number(_METRIC, previous["error"]),
        "after": metric_number(_METRIC, last["error"]),
        "from_": Number("pulses", previous["pulses"], "count"),
    }
    words = "The last shots, from {from_} on, brought it from {before} to {after}: " + (
        "the error still falls, so that further configurations may make the model better."
        if fall > _FLAT
        else "it hardly falls any more, so that further shots of this kind would change little."
    )
    yield sentence(words, **shown)


def curve_figure(points: Sequence[Mapping[str, Any]], repeatability: float | None = None) -> Plot:
    """Force error over the shots that were learned from, with 90 % intervals, and the error that
    repeated impacts have."""
    shots = as_floats([point["pulses"] for point in points])
    error = 100 * as_floats([point["error"] for point in points])
    low, high = (
        100 * as_floats([point["error"] if point[end] is None else point[end] for point in points])
        for end in ("low", "high")
    )
    labels = tuple(f"{point['configurations']} configurations" for point in points)
    lines = (
        ()
        if repeatability is None
        else (ReferenceLine("y", 100 * repeatability, "repeated impacts of the bench"),)
    )
    return Plot(
        "Learning curve",
        PlotAxis("shots that were learned from", DIMENSIONLESS, whole=True, from_zero=True),
        PlotAxis("force error", "%", from_zero=True),
        (
            LineSeries(shots, error, role=category(0), silent=True),
            PointSeries(
                shots,
                error,
                y_low=low,
                y_high=high,
                labels=labels,
                name="held-out pulses",
                role=category(0),
            ),
        ),
        lines,
    )


def _run(request: CurveRequest, laboratory: Laboratory, progress: Progress) -> VersionCurve:
    import numpy as np

    from ...common.model_registry import models_extra, needed, reader_of

    with models_extra():
        from ....training.evaluation.learning_curve import learning_curve
        from ....training.models.training_task import rng_of
        from ....training.registry.listing import chosen

        registry = needed(laboratory.db)
        version = chosen(registry.versions(), request.label, request.split)
        stored, table = (
            registry.held_out(version),
            reader_of(laboratory.store)(version.dataset.hash),
        )
        training = table.take(np.isin(table.key, stored.trained_on))
        held_out = table.take(np.isin(table.key, stored.keys))
        if len(held_out) != len(stored.keys):
            raise ValueError(
                f"the store has {len(held_out)} of the {len(stored.keys)} held-out pulses of "
                f"{version.label}: restore the store, or train it again"
            )
        rng = rng_of("learning curve", version.dataset.hash, version.split, request.seed)
        points = learning_curve(
            registry.load(version).model, training, held_out, rng, step=progress
        )
        rows = [point.as_json() for point in points]
        registry.keep_learning_curve(version, rows)
    return VersionCurve(version.label, version.split, rows)


def check(request: CurveRequest, laboratory: Laboratory) -> None:
    """Raises `LookupError` for a version that there is not."""
    from ...common.model_registry import models_extra, needed

    with models_extra():
        from ....training.registry.listing import chosen

        version: Version = chosen(needed(laboratory.db).versions(), request.label, request.split)
    if request.split is not None and version.split != request.split:
        raise LookupError(f"{version.label} was not judged on the split {request.split!r}")


LEARNING_CURVE: Operation[CurveRequest, VersionCurve] = Operation(
    name="learning-curve",
    request=CurveRequest,
    run=_run,
    check=check,
    help="""Show how the error of a model falls with the number of shots that it learned from.

    The model is trained again on a quarter, a half and three quarters of its configurations, in
    three orders each, and on all of them, and judged on the same held-out pulses. The curve says
    whether further shots are likely to make the model better. It is stored with the version, whose
    page shows it.""",
    example="""pyroshock train rehearsal-pulses --models linear --split configurations
pyroshock models learning-curve linear@1 --split configurations""",
    command=("models", "learning-curve"),
    route=("POST", "/models/{model}/{version}/learning-curve"),
    long=True,
    changes_elsewhere=True,
    steps="trainings",
    label=lambda request: str(request.label),
    form=FormPage(
        "/models/{model}/{version}",
        "learning-curve",
        "/models/{model}/{version}/learning-curve",
    ),
)
