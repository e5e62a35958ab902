"""Cross-validation of the twin: it predicts the shots of each fold from those of the other configurations."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...training.models.contact_stage import RegisteredContact
from ...training.tuning.folds import grouped_folds
from ...twin.measured_shots import MeasuredShots
from ...twin.plate.stage import PlateStage
from ...twin.prediction import ShotDraws
from ...validation.prediction_scores.failure_rules import PredictionFailure
from ...validation.prediction_scores.quantity_score import QuantityScore
from ...validation.prediction_scores.shot_comparison import (
    PredictionVerdict,
    QuantityComparison,
    compared_shots,
    line_rows,
    shot_rows,
    verdict,
)
from ..finite import finite
from ..twins.building import BuiltTwin, TwinRequest, twin_of
from ..twins.learning import MOST_SHOTS
from ..twins.measured_shots import read_measured_shots, struck_plate
from .tables import reason_lines
from .unseen_contact import REFITTED, SEEN, UnseenContact

if TYPE_CHECKING:
    from ...schema.session import Store

FOLDS, DRAWS = 5, 64
Step = Callable[[int, int, str], None]
#: A twin that has not learned from these configurations, for plates of this material.
TwinWithout = Callable[[Sequence[int], str], BuiltTwin]


def _silent(*_: object) -> None:
    pass


@dataclass(frozen=True)
class ValidationRequest:
    """As the options of `pyroshock validate`. Effects that diagnoses left to the bench do not act: they were fitted to
    the shots that are to be predicted."""

    campaign: str
    folds: int = FOLDS
    draws: int = DRAWS
    seed: int = 0
    contact: str | None = None

    def __post_init__(self) -> None:
        if self.folds < 2 or self.draws < 20:
            raise ValueError(f"folds = {self.folds}, draws = {self.draws}: expected 2 folds and 20 draws at least")

    def twin(self, without: Sequence[int] = (), plate: str | None = None) -> TwinRequest:
        """The twin of the campaign's bench that has not learned from some configurations."""
        return TwinRequest(
            campaign=self.campaign,
            contact=self.contact,
            plate=plate,
            adopted=False,
            learn=True,
            without_configurations=frozenset(without),
        )


@dataclass(frozen=True, eq=False)
class Validation:
    """What a campaign says of the twin. `seen` says in words what the predictions had seen, `left_out` which shots were
    not compared and why; `folds` is 0 where nothing could be learned from other configurations. `notes` are those of
    the first fold's twin."""

    campaign: str
    shots: MeasuredShots
    comparisons: tuple[QuantityComparison, ...]
    failures: tuple[PredictionFailure, ...]
    verdict: PredictionVerdict
    folds: int
    seen: str
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    seconds: float

    @property
    def scores(self) -> list[QuantityScore]:
        return [comparison.score for comparison in self.comparisons]

    def as_json(self) -> dict[str, Any]:
        """Plain data of `validate --json`; what is not known is null."""
        plain = finite(
            {
                "campaign": self.campaign,
                "verdict": self.verdict.sentence,
                "calibrated": self.verdict.calibrated,
                "quantities": [score.as_json() for score in self.scores],
                "failures": [failure.as_json() for failure in self.failures],
                "seen": self.seen,
                "folds": self.folds,
                "left_out": list(self.left_out),
                "notes": list(self.notes),
                "seconds": self.seconds,
                "shots": list(shot_rows(self.shots, list(self.comparisons))),
                "lines": {c.measure.name: line_rows(c) for c in self.comparisons if c.is_spectrum},
            }
        )
        assert isinstance(plain, dict)
        return plain


def validated(store: Store, db: str, request: ValidationRequest, step: Step = _silent) -> Validation:
    """Raises `LookupError` for a campaign that the store does not have, `ValueError` where no shot can be compared."""
    begun = time.perf_counter()
    step(0, 0, "reading the measured shots")
    untaught = twin_of(store, db, replace(request.twin(), learn=False))
    shots, left_out = campaign_shots(store, request.campaign, untaught)
    if not len(shots):
        reasons = "; ".join(reason_lines(left_out)[:3]) or "it has no shots and no impacts"
        raise ValueError(f"campaign {request.campaign!r} has no measured shot to compare with: {reasons}")
    contacts = _UnseenContacts(store, db)
    notes: list[str] = []

    def twin_without(configurations: Sequence[int], plate: str) -> BuiltTwin:
        built = twin_of(store, db, request.twin(configurations, plate), shots)
        if not notes:
            notes.extend(note for note in built.notes if note)
        twin = contacts.unseen(built, configurations)
        return twin if np.isfinite(shots.peak_acceleration_m_s2).any() else _without_plate(twin)

    folds, draws, missing = predicted_folds(shots, twin_without, request, step)
    rng = np.random.default_rng([request.seed, 1])
    comparisons = compared_shots(shots, draws, rng)
    if not comparisons:
        raise ValueError(f"no shot of {request.campaign!r} can be compared: {'; '.join(missing[:3]) or 'no quantity'}")
    return Validation(
        campaign=request.campaign,
        shots=shots,
        comparisons=tuple(comparisons),
        failures=tuple(failure for comparison in comparisons for failure in comparison.failures(shots, rng)),
        verdict=verdict([comparison.score for comparison in comparisons]),
        folds=folds,
        seen="; ".join(filter(None, (_folds_words(folds, shots), _force_words(shots), contacts.words))),
        left_out=(*left_out, *missing),
        notes=tuple(notes),
        seconds=time.perf_counter() - begun,
    )


def campaign_shots(store: Store, campaign: str, built: BuiltTwin) -> tuple[MeasuredShots, tuple[str, ...]]:
    """The campaign's shots at the twin's lines and sensors, and why some are left out."""
    with store.reading() as session:
        return read_measured_shots(
            session,
            campaign,
            frequency_hz=built.twin.frequency_hz,
            q=built.twin.q,
            sensors=built.twin.sensor_names,
            material=built.material,
            plate=struck_plate(built.bench),
            most=MOST_SHOTS,
        )


def predicted_folds(
    shots: MeasuredShots, twin_without: TwinWithout, request: ValidationRequest, step: Step = _silent
) -> tuple[int, dict[int, ShotDraws], list[str]]:
    """How many folds of configurations were left out in turn, the draws of each shot (by its row), and why some shots
    have none. A single configuration is predicted by a twin that has learned from none.
    """
    several = len(np.unique(shots.configuration)) > 1
    rng = np.random.default_rng([request.seed, 0])
    everything = [np.ones(len(shots), dtype=bool)]
    folds = grouped_folds(shots.configuration, request.folds, rng) if several else everything
    generators = rng.spawn(len(shots))
    draws: dict[int, ShotDraws] = {}
    missing: list[str] = []
    for number, fold in enumerate(folds, 1):
        twins: dict[str, BuiltTwin] = {}
        configurations = np.unique(shots.configuration[fold]).tolist()
        for row in np.flatnonzero(fold).tolist():
            setting = shots.settings[row]
            step(len(draws) + len(missing), len(shots), f"fold {number} of {len(folds)}")
            try:
                if setting.plate.name not in twins:
                    twins[setting.plate.name] = twin_without(configurations, setting.plate.name)
                twin = twins[setting.plate.name].twin
                force = shots.given_force(row)
                prediction = twin.predict(setting, draws=request.draws, rng=generators[row], measured_force=force)
                draws[row] = prediction.draws
            except (ValueError, LookupError) as error:
                missing.append(f"shot {row + 1} is not predicted: {error}")
    step(len(shots), len(shots), "scoring")
    return len(folds) if several else 0, dict(sorted(draws.items())), missing


def _without_plate(built: BuiltTwin) -> BuiltTwin:
    """Of a campaign without a measured acceleration: what no shot is compared with takes most of the time."""
    return replace(built, twin=replace(built.twin, plate=PlateStage({}), calibration=None))


class _UnseenContacts:
    """Takes the configurations of a fold out of registered models, and says afterwards what those had seen."""

    def __init__(self, store: Store, db: str) -> None:
        self._store, self._db = store, db
        self._models: dict[str, UnseenContact] = {}
        self._seen: dict[str, set[str]] = {}

    def unseen(self, built: BuiltTwin, configurations: Sequence[int]) -> BuiltTwin:
        contact = built.twin.contact
        if not isinstance(contact, RegisteredContact):
            return built
        label = contact.label
        model = self._models.setdefault(label, UnseenContact(self._store, self._db, contact))
        without, seen = model.without(configurations)
        self._seen.setdefault(label, set()).add(seen)
        return replace(built, twin=replace(built.twin, contact=without))

    @property
    def words(self) -> str:
        return "; ".join(f"{label} {_model_words(seen)}" for label, seen in self._seen.items())


def _model_words(seen: set[str]) -> str:
    if SEEN in seen:
        return "had been trained on these shots and could not be refitted without them: its figures are too good"
    if REFITTED in seen:
        return (
            "was refitted without the configurations of each fold; what it tuned once (length scales, widths of bands) "
            "was tuned on all its pulses"
        )
    return "was not trained on these configurations"


def _force_words(shots: MeasuredShots) -> str:
    given_shots = int(shots.force_is_given.sum())
    which = "every shot" if given_shots == len(shots) else f"{given_shots} of {len(shots)} shots"
    why = "since the mass or the velocity of the impactor is not known"
    what = "and only the peak accelerations and spectra of these shots are compared"
    return f"it was given the measured force of {which}, {why}, {what}" if given_shots else ""


def _folds_words(folds: int, shots: MeasuredShots) -> str:
    configurations = len(np.unique(shots.configuration))
    if not folds:
        return "the shots are of one configuration, and the twin had learned from none of them"
    parts = "each configuration" if folds == configurations else f"each of {folds} folds of configurations"
    return f"the twin predicted {parts} after it had learned from the shots of the others alone"
