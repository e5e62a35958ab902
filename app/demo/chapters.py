"""Chapters 3 to 5 of the demo: a contact model, its validation, and a gap that a diagnosis shrinks.

Each chapter calls the service of the command of its name, and makes one figure of the answer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...schema.session import Store
from ..common.quantities import display_of
from ..figures.figure import (
    BarSeries,
    ColourRole,
    Plot,
    PlotAxis,
    PlotGrid,
    PointSeries,
    as_floats,
    equal_line,
)
from .virtual_campaign import CHANGED, EFFECT, REHEARSAL, STRENGTH

if TYPE_CHECKING:
    from ...training.registry.records import Version
    from ..common.progress import Step
    from ..operations.diagnose.service import GapDiagnosis
    from ..operations.train.service import PromotionDecision
    from ..operations.validate.service import TwinValidation

#: Of the families, Gaussian processes learn most from so few pulses.
DATASET, MODEL = "rehearsal-pulses", "gp"
SPLIT, METRIC = "configurations", "force_nrmse"
REASON = "the first model of the virtual bench"
#: Two folds and twenty draws, the fewest that a validation takes: it is over in seconds.
FOLDS, DRAWS = 2, 20


@dataclass(frozen=True)
class TrainedModel:
    """A version, and whether it was put in use; `pulses` are those of the dataset."""

    version: Version
    decision: PromotionDecision
    pulses: int

    def as_json(self) -> dict[str, Any]:
        metrics = self.version.metrics.items()
        return {
            "model": self.version.label,
            "dataset": DATASET,
            "pulses": self.pulses,
            "held_out": {
                name: {"mean": estimate.mean, "ci90": [estimate.low, estimate.high]}
                for name, estimate in metrics
            },
            "promoted": self.decision.promoted,
            "verdict": self.decision.decision.verdict,
            "decision": self.decision.sentence,
        }


def train_model(store: Store, url: str, step: Step) -> TrainedModel:
    """Freeze the pulses of the rehearsal, train a model on them, and promote it if it is good
    enough.

    Raises `MissingExtraError` where the libraries for training are not installed.
    """
    from ...dataset.snapshot import build_snapshot
    from ..operations.laboratory import Laboratory
    from ..operations.train.promote import PROMOTE, Promoting
    from ..operations.train.train import TRAIN, Training

    laboratory = Laboratory(store, url)
    snapshot = build_snapshot(store, DATASET, [REHEARSAL.name]).snapshot
    training = Training(dataset=snapshot.name, models=(MODEL,), split=(SPLIT,))
    (version,) = TRAIN.answer(training, laboratory, step).versions
    step(0, 0, "promoting")
    promoting = Promoting(model=version.name, version=version.version, reason=REASON)
    decision = PROMOTE.answer(promoting, laboratory, step)
    return TrainedModel(version, decision, len(snapshot.table))


def model_figure(store: Store, url: str, model: TrainedModel) -> PlotGrid:
    """Peak force and contact time that the model predicts for pulses that it has not seen, over the
    measured ones."""
    from ..common.model_registry import reader_of, registry_of
    from ..operations.train.figures import held_out_figures

    points = held_out_figures(registry_of(url), model.version, reader_of(store))["points"]
    pair = (
        _against_plot(points["peak_force_n"], "peak_force_n"),
        _against_plot(points["contact_time_s"], "contact_time_s"),
    )
    title = f"{model.version.label}: pulses of configurations that it has not seen"
    return PlotGrid(f"{title}, with 90 % intervals", (pair,))


def _against_plot(columns: dict[str, Any], quantity: str) -> Plot:
    display = display_of(quantity)
    measured, predicted = (
        display.scale * as_floats(columns[name]) for name in ("measured", "predicted")
    )
    low, high = (
        None if columns[name] is None else display.scale * as_floats(columns[name])
        for name in ("low", "high")
    )
    points = PointSeries(
        *(measured, predicted),
        y_low=low,
        y_high=high,
        detail="pulses",
        role=ColourRole.MODEL,
    )
    x, y = (PlotAxis(f"{word} {display.label}", display.unit) for word in ("measured", "predicted"))
    return Plot(display.label, x, y, (equal_line("", measured), points))


def validate_model(store: Store, url: str, step: Step) -> TwinValidation:
    """The rehearsal's shots, each beside a prediction of a twin that has not learned from its
    configuration."""
    from ..operations.validate.request import ValidationRequest
    from ..operations.validate.service import validate_twin

    request = ValidationRequest(campaign=REHEARSAL.name, folds=FOLDS, draws=DRAWS)
    return validate_twin(store, url, request, step)


def validation_json(validation: TwinValidation) -> dict[str, Any]:
    """Verdict and scores, as `validate --json` names them."""
    data = validation.to_json()
    return {
        name: data[name]
        for name in ("verdict", "calibrated", "quantities", "failures", "seen", "folds")
    }


def validation_figure(validation: TwinValidation) -> Plot:
    """The share of shots inside the 90 % band of each quantity."""
    title = "Shots that the twin has not seen; line: 90 %, bars: 95 % intervals"
    return replace(validation.figure(), title=title)


def diagnose_gap(store: Store, url: str, step: Step) -> GapDiagnosis:
    """The diagnosis of the campaign with the effect; the one that the store keeps, where it has
    one."""
    from ..operations.diagnose.make import DIAGNOSE
    from ..operations.diagnose.request import DiagnosisRequest
    from ..operations.diagnose.service import GapDiagnosis
    from ..operations.diagnose.stored import kept_verdict, list_diagnoses
    from ..operations.laboratory import Laboratory

    with store.reading() as session:
        kept = [row["id"] for row in list_diagnoses(session, CHANGED.name) if row["complete"]]
        if kept:
            return GapDiagnosis(kept_verdict(session, kept[0]), kept[0])
    request = DiagnosisRequest(campaign=CHANGED.name)
    return DIAGNOSE.answer(request, Laboratory(store, url), step)


def diagnosis_json(diagnosis: GapDiagnosis) -> dict[str, Any]:
    """Cause, effects and path, as `diagnose --json` names them, with what the virtual bench
    switched on."""
    data = diagnosis.to_json()
    names = ("campaign", "simulator", "gap", "causes", "effects", "path", "shrinkage")
    return {
        "switched_on": {EFFECT: STRENGTH},
        "sentence": diagnosis.sentence,
        "held_out_fraction": diagnosis.fraction,
        **{name: data[name] for name in names},
    }


def diagnosis_figure(diagnosis: GapDiagnosis) -> PlotGrid:
    """Left: the shares of the gap by effect. Right: what is left of it as the effects are added."""
    shares = replace(diagnosis.figure(), title="Which effects cause the gap")
    return PlotGrid(
        f"Diagnosis of {diagnosis.verdict.campaign}", ((shares, _path_plot(diagnosis)),)
    )


def _path_plot(diagnosis: GapDiagnosis) -> Plot:
    from ..operations.diagnose.report_charts import path_rows

    rows = path_rows(diagnosis.verdict)
    bars = tuple(
        BarSeries(
            np.array([float(place)]),
            np.array([row.end]),
            np.array([row.start]),
            horizontal=True,
            labels=(row.value,),
            detail=row.name,
            role=row.role,
        )
        for place, row in enumerate(rows)
    )
    names = PlotAxis("step", categories=tuple(row.name for row in rows) or ("none",), reversed=True)
    title = "What is left on configurations not fitted"
    return Plot(title, PlotAxis("gap", "tolerances", from_zero=True), names, bars)
