"""What the registry takes and gives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING, Any

from ...dataset.domain import Domain
from ...dataset.table import Inputs, Predictor
from ...dataset.validity_limits import OutOfRange
from ..estimators.base import FitReport
from ..evaluation.summary import Estimate
from ..models.base import ContactModel, ContactPrediction
from ..models.serialization import Packed
from ..models.training_task import TrainingTask

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class DatasetName:
    """Which pulses: a snapshot's name and hash, and the predictor set ("hammer", "gun") it was made
    with.

    `bench_kind` is the kind of campaigns that the set is for, `velocity_kind` that of the impact
    velocities (`schema.velocity_kinds`); None where an older version does not state it.
    """

    name: str
    hash: str
    predictor_set: str
    bench_kind: str | None = None
    velocity_kind: str | None = None


@dataclass(frozen=True, eq=False)
class HeldOutPredictions:
    """Predicted pulses that the model was not trained on, by their keys (n,), and the keys it was
    trained on."""

    keys: NDArray[np.str_]
    prediction: ContactPrediction
    trained_on: NDArray[np.str_]


@dataclass(frozen=True)
class Cost:
    """What a training took, on this machine at that time."""

    seconds: float
    peak_memory_mb: float


@dataclass(frozen=True, eq=False)
class Trained:
    """A finished training, to be registered: it can be sent between processes. `figures` are files
    (PNG) by name."""

    task: TrainingTask
    dataset: DatasetName
    packed: Packed
    predictors: tuple[Predictor, ...]
    domain: Domain
    held_out: HeldOutPredictions
    metrics: Mapping[str, Estimate]
    cost: Cost
    figures: Mapping[str, bytes]
    fit_report: FitReport = field(default_factory=FitReport)


@dataclass(frozen=True)
class Version:
    """A registered model's version as judged on one split; `metrics` are means over its held-out
    pulses with 90 % intervals.

    A version is a training. It has a record for each split that it was judged on, and each record
    has the model that was fitted without the split's held-out pulses. The model of the first split
    is the one that is put in use: its record has an empty `model_id`, the others have the id of
    their own logged model.

    `files`: the SHA-256 of each file of the model and its run, by name (`file_hashes.py`); empty
    for versions of software that recorded none.

    `order` rises with each registration, whatever the clock says that `registered_at` was read
    from; 0 before there was one. `promoted_at` is the time of its last promotion as text that
    sorts; empty before the first.
    """

    name: str
    version: int
    dataset: DatasetName
    split: str
    seed: int
    metrics: Mapping[str, Estimate]
    cost: Cost
    task_key: str
    run_id: str
    sha256: str
    registered_at: datetime
    champion_of: str | None = None
    order: int = 0
    promoted_at: str = ""
    model_id: str = ""
    files: Mapping[str, str] = field(default_factory=dict, repr=False)

    @property
    def is_served(self) -> bool:
        """Whether its model is the one that is put in use with the version."""
        return not self.model_id

    @property
    def label(self) -> str:
        """As the command line takes it."""
        return f"{self.name}@{self.version}"


@dataclass(frozen=True)
class Answer:
    """A prediction, and for each impact what of it lies outside the model's validity domain."""

    prediction: ContactPrediction
    outside: tuple[tuple[OutOfRange, ...], ...]


@dataclass(frozen=True, eq=False)
class RegisteredModel:
    """A model that was read back, with what it may be asked."""

    version: Version
    model: ContactModel
    predictors: tuple[Predictor, ...]
    domain: Domain
    about: Mapping[str, Any]

    @property
    def shots(self) -> int:
        """How many pulses it was trained on; 0 where its files do not say."""
        return int(self.about.get("pulses", 0))

    def predict(self, inputs: Inputs) -> Answer:
        """Pulses of impacts.

        Parameters:
            inputs: The impacts, with the predictors that the model learned from.

        Returns:
            The prediction, and for each impact what of it lies outside the validity domain.

        Raises:
            ValueError: For inputs of other predictors.
        """
        if inputs.predictors != self.predictors:
            wanted, given = (
                [p.name for p in predictors] for predictors in (self.predictors, inputs.predictors)
            )
            raise ValueError(
                f"{self.version.label} is asked with {given}; it knows, with these units: {wanted}"
            )
        outside = self.domain.outside(inputs)
        return Answer(
            self.model.predict(inputs), tuple(tuple(row_limits) for row_limits in outside)
        )


@dataclass(frozen=True)
class Decision:
    """A promotion, or its refusal: kept with who asked, when, and on which figures.

    `figures` have the scores on `pulses` of unseen configurations: of the candidate
    ("crps.candidate"), of the model or law that it was `judged_against` ("crps.reference"), and of
    a first candidate's contact law before any shot ("crps.prior"); and shares inside the 90 % bands
    ("coverage90.candidate.peak_force"). `verdict` is one of `evaluation.gate.Verdict`. Decisions of
    older software have neither `judged_against` nor a verdict: "".
    """

    candidate: str
    champion: str | None
    predictor_set: str
    promoted: bool
    forced: bool
    reason: str
    judged_on: str
    pulses: int
    figures: Mapping[str, float]
    who: str
    when: datetime
    judged_against: str = ""
    verdict: str = ""
