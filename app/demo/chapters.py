"""Chapters 3 to 5 of the demo: a contact model, its validation, and a gap that a diagnosis shrinks.

Each chapter calls the service of the command of its name, and draws one picture of the answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...schema.session import Store
from ..common.plots import MEASURED, QUIET, new_figure, save
from ..common.plots import MODEL as PREDICTED
from .virtual_campaign import REHEARSAL, VirtualCampaign

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


def draw_model(store: Store, url: str, model: TrainedModel, path: Path) -> None:
    """Peak force and contact time that the model predicts for pulses that it has not seen, over the
    measured ones."""
    from ..common.model_registry import reader_of, registry_of
    from ..operations.train.figures import held_out_figures

    points = held_out_figures(registry_of(url), model.version, reader_of(store))["points"]
    figure = new_figure(11, 4.2)
    force_axes, time_axes = figure.subplots(1, 2)
    _draw_against(force_axes, points["peak_force_n"], 1e-3, "peak force (kN)")
    _draw_against(time_axes, points["contact_time_s"], 1e3, "contact time (ms)")
    figure.suptitle(
        f"{model.version.label}: pulses of configurations that it has not seen, with 90 % intervals"
    )
    save(figure, path)


def _draw_against(axes: Any, columns: dict[str, Any], scale: float, what: str) -> None:
    measured, predicted = (
        [scale * value for value in columns[name]] for name in ("measured", "predicted")
    )
    ends = [min(measured), max(measured)]
    axes.plot(ends, ends, color=QUIET)
    if columns["low"] is not None:
        axes.vlines(
            measured,
            [scale * v for v in columns["low"]],
            [scale * v for v in columns["high"]],
            color=PREDICTED,
        )
    axes.plot(measured, predicted, "o", color=PREDICTED)
    axes.set(xlabel=f"measured {what}", ylabel=f"predicted {what}")


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


def draw_validation(validation: TwinValidation, path: Path) -> None:
    """The share of shots inside the 90 % band of each quantity."""
    figure = new_figure(8, 4.2)
    axes = figure.subplots()
    validation.plot(axes)
    axes.set_title("Shots that the twin has not seen; line: 90 %, bars: 95 % intervals")
    save(figure, path)


#: The effect that chapter 5 switches on: the valve passes less gas, and opens more slowly, than it
#: usually does.
EFFECT, STRENGTH = "gun.valve_flow", 3.0
CHANGED = VirtualCampaign("slow-valve", runs=12, repetitions=2, seed=2, effects={EFFECT: STRENGTH})


def diagnose_gap(store: Store, url: str, step: Step) -> GapDiagnosis:
    """The diagnosis of the campaign with the effect; the one that the store keeps, where it has
    one."""
    from ..operations.diagnose.service import diagnose_campaign, kept_diagnosis
    from ..operations.diagnose.stored import list_diagnoses

    with store.reading() as session:
        kept = [row["id"] for row in list_diagnoses(session, CHANGED.name) if row["complete"]]
    if kept:
        return kept_diagnosis(store, kept[0])
    return diagnose_campaign(store, url, CHANGED.name, step)


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


def draw_diagnosis(diagnosis: GapDiagnosis, path: Path) -> None:
    """Left: the shares of the gap by effect. Right: what is left of it as the effects are added."""
    figure = new_figure(13, 4.2)
    share_axes, path_axes = figure.subplots(1, 2)
    diagnosis.plot(share_axes)
    share_axes.set_title("Which effects cause the gap")
    _draw_path(path_axes, diagnosis)
    save(figure, path)


def _draw_path(axes: Any, diagnosis: GapDiagnosis) -> None:
    from ..operations.diagnose.report_charts import path_rows

    colours = {"bar-error": PREDICTED, "bar-gone": MEASURED}
    rows: Sequence[Any] = path_rows(diagnosis.verdict)[::-1]
    for place, row in enumerate(rows):
        axes.barh(place, row.end - row.start, left=row.start, color=colours.get(row.kind, QUIET))
    axes.set_yticks(range(len(rows)), [row.name for row in rows])
    axes.set(xlabel="gap, in tolerances", title="What is left on configurations not fitted")
