"""Cross-validation of the twin: it predicts the shots of each fold from those of the other
configurations, with a registered model as it would be without them; and the scores as rows and
lines for people."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ....dataset.build_table import configuration_text
from ....dataset.rows import levels_of
from ....dataset.snapshot import SnapshotError, read_snapshot
from ....parallel.phases import WHOLE, Phases
from ....training.evaluation.unseen_configurations import without_configurations
from ....training.models.training_task import rng_of
from ....training.registry.contact_stage import RegisteredContact
from ....training.tuning.folds import grouped_folds
from ....twin.measured_shots import MeasuredShots
from ....twin.plate.stage import PlateStage
from ....twin.prediction import ShotDraws
from ....validation.prediction_scores.failure_rules import PredictionFailure
from ....validation.prediction_scores.quantity_score import QuantityScore
from ....validation.prediction_scores.shot_comparison import (
    QuantityComparison,
    compared_shots,
    line_rows,
    shot_rows,
)
from ...common.number_format import NOTHING as NOTHING_KNOWN
from ...common.number_format import finite, number, percent
from ...twins.adopted_effects import adopted_for
from ...twins.building import BuiltTwin, TwinRequest, twin_of
from ...twins.learning import MOST_SHOTS
from ...twins.measured_shots import read_measured_shots, struck_plate
from .verdict import (
    error_number,
    independent_values,
    is_calibrated,
    joint_interval,
    prediction_deviation,
    quantity_words,
    verdict_text,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from sqlalchemy.orm import Session

    from ....dataset.table import PulseTable
    from ....schema.session import Store
    from .request import ValidationRequest


#: What learning one twin, and one draw of a prediction, cost a processor in seconds.
_LEARNING_S, _DRAW_S = 10.0, 0.003
#: Of one row of `quantities`: 90 % bands that hold what they promise are near this share.
COLUMNS = ("quantity", "shots", "configurations", "independent values", "inside 50 % band",
           "inside 90 % band", "at least", "at most", "median error",
           "mean deviation of the prediction", "width of 90 % band", "CRPS")  # fmt: skip
#: Those of the columns that a telephone shows first.
MAIN_COLUMNS = ("quantity", "shots", "inside 90 % band", "median error")


def score_rows(data: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A row for each quantity; errors of logarithms as per cent of the measured value. The interval
    of the share inside the 90 % band is the one that the verdict rests on."""
    for row in data["quantities"]:
        unit = row["unit"]
        low, high = joint_interval(row, len(data["quantities"]))
        cells = (
            quantity_words(row["name"]),
            row["shots"],
            row.get("configurations", NOTHING_KNOWN),
            independent_values(row),
            percent(row["coverage50"]),
            percent(row["coverage90"]),
            percent(low),
            percent(high),
            str(error_number(row["median_abs_error"], unit)),
            prediction_deviation(row["bias"], unit),
            _width(row["sharpness90"], unit),
            f"{number(row['crps'])} {unit}",
        )
        yield dict(zip(COLUMNS, cells, strict=True))


def adopted_lines(data: Mapping[str, Any]) -> list[str]:
    """What effects that diagnoses left to the bench do to the errors; nothing where none is
    adopted."""
    adopted = data.get("adopted")
    if not adopted:
        return []
    errors = [
        f"{quantity_words(row['name'])}: median error {error_number(row['without'], row['unit'])} "
        f"without and {error_number(row['with'], row['unit'])} with the adopted effects."
        for row in adopted["errors"]
    ]
    lines = [*adopted["sentences"], *(f"{line[:1].upper()}{line[1:]}" for line in errors)]
    if adopted["fitted_to_these_shots"]:
        lines.append(
            "The effects were fitted to these shots: errors with them are "
            "smaller than those of new shots."
        )
    return lines


def adopted_rows(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The errors without and with adopted effects, a row for each quantity."""
    adopted = data.get("adopted") or {}
    return [
        {
            "quantity": quantity_words(row["name"]),
            "median error without": str(error_number(row["without"], row["unit"])),
            "median error with": str(error_number(row["with"], row["unit"])),
        }
        for row in adopted.get("errors", ())
    ]


def reason_lines(reasons: Sequence[str]) -> list[str]:
    """Why shots are not compared, each reason once with its number: "no recording (5)"."""
    counts = Counter(reason.partition(": ")[2] or reason for reason in reasons)
    return [
        f"{reason} ({count})" if count > 1 else reason for reason, count in counts.most_common()
    ]


def _width(value: float, unit: str) -> str:
    """Upper over lower end of the band, or their distance in dB."""
    return f"{value:.1f} dB" if unit == "dB" else f"factor {math.exp(value):.3g}"


#: What a prediction's model had seen of the shots that it is compared with.
NOTHING, REFITTED, SEEN = "nothing", "refitted", "seen"


@dataclass(frozen=True, eq=False)
class UnseenContact:
    """Takes configurations out of the registered model of `contact`, whose version is in the
    registry beside `db`."""

    store: Store
    db: str
    contact: RegisteredContact

    def without(self, configurations: Sequence[int]) -> tuple[RegisteredContact, str]:
        """The model refitted to the pulses of all other configurations, in whatever campaign they
        were recorded.

        And what it had seen: `NOTHING` where it had learned from none of these configurations and
        is as it was, `REFITTED`, or `SEEN` where it cannot be refitted (its pulses are gone, or
        nothing would be left). What a model tuned on all its pulses (length scales, widths of
        bands) is kept.
        """
        if self._learned is None:
            return self.contact, SEEN
        with self.store.reading() as session:
            names = configuration_names(session, configurations)
        registered = self.contact.registered
        version = registered.version
        rng = rng_of("validate", version.dataset.hash, version.split, version.seed)
        try:
            model = without_configurations(registered.model, self._learned, list(names), rng)
        except ValueError:
            return self.contact, SEEN
        if model is registered.model:
            return self.contact, NOTHING
        return replace(self.contact, registered=replace(registered, model=model)), REFITTED

    @cached_property
    def _learned(self) -> PulseTable | None:
        """The pulses that the model was trained on; None where the store has them no longer."""
        from ...common.model_registry import registry_of

        version = self.contact.registered.version
        keys = registry_of(self.db).held_out(version).trained_on
        try:
            with self.store.reading() as session:
                table = read_snapshot(session, version.dataset.hash).table
        except (LookupError, SnapshotError):
            return None
        return table.take(np.isin(table.key, keys))


def configuration_names(session: Session, configurations: Sequence[int]) -> Collection[str]:
    """Configurations of the store (by key) as a dataset names them."""
    return {configuration_text(words) for words, _ in levels_of(session, configurations).values()}


Step = Callable[[int, int, str], None]
#: A twin that has not learned from these configurations, for plates of this material.
TwinWithout = Callable[[Sequence[int], str], BuiltTwin]


def _silent(*_: object) -> None:
    pass


def _twin(
    request: ValidationRequest,
    without: Sequence[int] = (),
    plate: str | None = None,
    *,
    adopted: bool = False,
) -> TwinRequest:
    """The twin of the campaign's bench that has not learned from some configurations, with adopted
    effects or without."""
    return TwinRequest(
        campaign=request.campaign,
        contact=request.contact,
        plate=plate,
        adopted=adopted,
        learn=True,
        without_configurations=frozenset(without),
    )


@dataclass(frozen=True)
class AdoptedErrors:
    """What adopted effects do to predictions of shots: `sentences` on each version, whether one of
    them was `fitted_to_these_shots`, and by quantity its unit and the median errors without and
    with them."""

    sentences: tuple[str, ...]
    fitted_to_these_shots: bool
    errors: Mapping[str, tuple[str, float, float]]

    def as_json(self) -> dict[str, Any]:
        errors = [
            {"name": name, "unit": unit, "without": a, "with": b}
            for name, (unit, a, b) in self.errors.items()
        ]
        return {
            "sentences": list(self.sentences),
            "fitted_to_these_shots": self.fitted_to_these_shots,
            "errors": errors,
        }


@dataclass(frozen=True, eq=False)
class Validation:
    """What a campaign says of the twin. `seen` says in words what the predictions had seen,
    `left_out` which shots were not compared and why; `folds` is 0 where nothing could be learned
    from other configurations. `notes` are those of the first fold's twin. `adopted` is None where
    no effects are adopted for the bench."""

    campaign: str
    shots: MeasuredShots
    comparisons: tuple[QuantityComparison, ...]
    failures: tuple[PredictionFailure, ...]
    folds: int
    seen: str
    left_out: tuple[str, ...]
    notes: tuple[str, ...]
    seconds: float
    adopted: AdoptedErrors | None = None

    @property
    def scores(self) -> list[QuantityScore]:
        return [comparison.score for comparison in self.comparisons]

    def as_json(self) -> dict[str, Any]:
        """Plain data of `validate --json`; what is not known is null."""
        plain = finite(
            {
                "campaign": self.campaign,
                "verdict": "",
                "calibrated": True,
                "quantities": self._quantities(),
                "failures": [failure.as_json() for failure in self.failures],
                "seen": self.seen,
                "folds": self.folds,
                "left_out": list(self.left_out),
                "notes": list(self.notes),
                "adopted": None if self.adopted is None else self.adopted.as_json(),
                "seconds": self.seconds,
                "shots": list(shot_rows(self.shots, list(self.comparisons))),
                "lines": {c.measure.name: line_rows(c) for c in self.comparisons if c.is_spectrum},
            }
        )
        assert isinstance(plain, dict)
        return plain | {"verdict": verdict_text(plain), "calibrated": is_calibrated(plain)}

    def _quantities(self) -> list[dict[str, Any]]:
        """Scores, with the interval that the verdict rests on."""
        scores = self.scores
        return [
            {
                **score.as_json(),
                "coverage90_joint_ci95": list(score.coverage90.interval(len(scores))),
            }
            for score in scores
        ]


def run_validation(
    store: Store, db: str, request: ValidationRequest, step: Step = _silent
) -> Validation:
    """Raises `LookupError` for a campaign that the store does not have, `ValueError` where no shot
    can be compared."""
    begun = time.perf_counter()
    step(0, 0, "reading the measured shots")
    untaught = twin_of(store, db, replace(_twin(request), learn=False))
    shots, left_out = campaign_shots(store, request.campaign, untaught)
    if not len(shots):
        reasons = "; ".join(reason_lines(left_out)[:3]) or "it has no shots and no impacts"
        raise ValueError(
            f"campaign {request.campaign!r} has no measured shot to compare with: {reasons}"
        )
    contacts = _UnseenContacts(store, db)
    notes: list[str] = []

    def twin_without(
        configurations: Sequence[int], plate: str, *, adopted: bool = False
    ) -> BuiltTwin:
        built = twin_of(store, db, _twin(request, configurations, plate, adopted=adopted), shots)
        if not notes:
            notes.extend(note for note in built.notes if note)
        twin = contacts.unseen(built, configurations)
        return twin if np.isfinite(shots.peak_acceleration_m_s2).any() else _without_plate(twin)

    folds, draws, missing = predicted_folds(shots, twin_without, request, step)
    rng = np.random.default_rng([request.seed, 1])
    comparisons = compared_shots(shots, draws, rng)
    if not comparisons:
        raise ValueError(
            f"no shot of {request.campaign!r} can be compared: "
            f"{'; '.join(missing[:3]) or 'no quantity'}"
        )

    def with_adopted() -> list[QuantityComparison]:
        _, adopted_draws, _ = predicted_folds(
            shots, partial(twin_without, adopted=True), request, step
        )
        return compared_shots(shots, adopted_draws, np.random.default_rng([request.seed, 1]))

    return Validation(
        campaign=request.campaign,
        shots=shots,
        comparisons=tuple(comparisons),
        failures=tuple(
            failure for comparison in comparisons for failure in comparison.failures(shots, rng)
        ),
        folds=folds,
        seen="; ".join(
            filter(None, (_folds_words(folds, shots), _force_words(shots), contacts.words))
        ),
        left_out=(*left_out, *missing),
        notes=tuple(notes),
        seconds=time.perf_counter() - begun,
        adopted=_adopted_errors(store, request.campaign, comparisons, with_adopted),
    )


def _adopted_errors(
    store: Store,
    campaign: str,
    without: Sequence[QuantityComparison],
    with_adopted: Callable[[], Sequence[QuantityComparison]],
) -> AdoptedErrors | None:
    """Errors without adopted effects and with them; None where none is adopted, and then nothing is
    predicted anew."""
    with store.reading() as session:
        versions = adopted_for(session, campaign)
    if not versions:
        return None
    errors = {own.score.as_json()["name"]: own.score.as_json() for own in without}
    after = {
        own.score.as_json()["name"]: own.score.as_json()["median_abs_error"]
        for own in with_adopted()
    }
    return AdoptedErrors(
        tuple(version.sentence for version in versions),
        any(version.campaign == campaign for version in versions),
        {
            name: (row["unit"], row["median_abs_error"], after[name])
            for name, row in errors.items()
            if name in after
        },
    )


def campaign_shots(
    store: Store, campaign: str, built: BuiltTwin
) -> tuple[MeasuredShots, tuple[str, ...]]:
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
    shots: MeasuredShots,
    twin_without: TwinWithout,
    request: ValidationRequest,
    step: Step = _silent,
) -> tuple[int, dict[int, ShotDraws], list[str]]:
    """How many folds of configurations were left out in turn, the draws of each shot (by its row),
    and why some shots have none. A single configuration is predicted by a twin that has learned
    from none.
    """
    several = len(np.unique(shots.configuration)) > 1
    rng = np.random.default_rng([request.seed, 0])
    everything = [np.ones(len(shots), dtype=bool)]
    folds = grouped_folds(shots.configuration, request.folds, rng) if several else everything
    generators = rng.spawn(len(shots))
    draws: dict[int, ShotDraws] = {}
    missing: list[str] = []
    phases = Phases(step, _fold_costs(shots, folds, request.draws))
    for fold_number, held_out in enumerate(folds, 1):
        twins: dict[str, BuiltTwin] = {}
        configurations = np.unique(shots.configuration[held_out]).tolist()
        words = f"fold {fold_number} of {len(folds)}"
        plates = len(_plates_of(shots, held_out))
        learning, predicting = phases.of(f"learning {fold_number}"), phases.of(f"{fold_number}")
        learning(0, plates, words)
        rows = np.flatnonzero(held_out).tolist()
        for done, row in enumerate(rows, 1):
            setting = shots.settings[row]
            try:
                if setting.plate.name not in twins:
                    twins[setting.plate.name] = twin_without(configurations, setting.plate.name)
                    learning(len(twins), plates, words)
                twin = twins[setting.plate.name].twin
                force = shots.given_force(row)
                prediction = twin.predict(
                    setting, draws=request.draws, rng=generators[row], measured_force=force
                )
                draws[row] = prediction.draws
            except (ValueError, LookupError) as error:
                missing.append(f"shot {row + 1} is not predicted: {error}")
            if len(twins) == plates:
                predicting(done, len(rows), words)
    step(WHOLE, WHOLE, "scoring")
    return len(folds) if several else 0, dict(sorted(draws.items())), missing


def _plates_of(shots: MeasuredShots, held_out: NDArray[np.bool_]) -> set[str]:
    """The plates that the shots of a fold hit: each has a twin of its own."""
    return {shots.settings[row].plate.name for row in np.flatnonzero(held_out).tolist()}


def _fold_costs(
    shots: MeasuredShots, folds: Sequence[NDArray[np.bool_]], draws: int
) -> dict[str, float]:
    """Seconds of each fold for its twins, which learn from all other shots, and for its
    predictions, as measured on a campaign of 36 shots."""
    costs: dict[str, float] = {}
    for fold_number, held_out in enumerate(folds, 1):
        costs[f"learning {fold_number}"] = _LEARNING_S * len(_plates_of(shots, held_out))
        costs[f"{fold_number}"] = _DRAW_S * draws * int(np.sum(held_out))
    return costs


def _without_plate(built: BuiltTwin) -> BuiltTwin:
    """Of a campaign without a measured acceleration: what no shot is compared with takes most of
    the time."""
    return replace(built, twin=replace(built.twin, plate=PlateStage({}), calibration=None))


class _UnseenContacts:
    """Takes the configurations of a fold out of registered models, and says afterwards what those
    had seen."""

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
        return (
            "had been trained on these shots and could not be refitted without "
            "them: its figures are too good"
        )
    if REFITTED in seen:
        return (
            "was refitted without the configurations of each fold; what it tuned once (length "
            "scales, widths of bands) was tuned on all its pulses"
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
    parts = (
        "each configuration"
        if folds == configurations
        else f"each of {folds} folds of configurations"
    )
    return f"the twin predicted {parts} after it had learned from the shots of the others alone"
