"""Models and the twin of a server: they are asked there, and their answers are read here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.errors import InvalidValueError, StorageError, raises_library_errors
from ..operations.faults import read_arguments
from ..operations.predict.described_twin import DescribedTwin
from ..operations.predict.request import (
    BandDraws,
    DrawnShot,
    PredictionsRequest,
    TwinOptions,
    effects_of,
)
from .laboratory_twin import LaboratoryTwin
from .server_answers import ServerAnswers, argument_words, body_of
from .server_connection import ServerConnection, part

if TYPE_CHECKING:
    from ...array_types import Floats
    from ...dataset.table import Inputs, Predictor
    from ...training.registry.records import Answer, Version
    from ...twin.srs.target import Target
    from ..common.progress import Step
    from ..operations.predict.batch import ShotRow
    from ..operations.predict.request import EffectsLike
    from ..operations.predict.service import ShotPrediction
    from ..operations.tune.request import SpectrumSearch
    from ..operations.tune.service import TunedSettings

#: Of one request, so that the bar moves.
_SHOTS_AT_ONCE = 20


@dataclass(frozen=True, eq=False)
class RemoteModel:
    """A version of a server's registry. What it predicts from is known here, the model is there."""

    connection: ServerConnection
    version: Version
    predictors: tuple[Predictor, ...]
    shots: int

    def predict(self, inputs: Inputs) -> Answer:
        """The pulses of impacts, and what of each lies outside of the model's domain."""
        body = {
            "x": _plain(inputs.x),
            "mass": _plain(inputs.impactor_mass_kg),
            "thickness": _plain(inputs.plate_thickness_m),
        }
        label = part(self.version.label)
        answer: Answer = self.connection.ask(f"/api/library/models/{label}/pulses", body)
        return answer


def _plain(numbers: Floats) -> Any:
    """Numbers as JSON; null stands for what is not known."""
    plain_numbers = numbers.astype(object)
    plain_numbers[np.isnan(numbers)] = None
    return plain_numbers.tolist()


class RemoteTwin(LaboratoryTwin):
    """The twin of a bench, which a server builds and keeps. It predicts and tunes there."""

    def __init__(
        self, answers: ServerAnswers, options: TwinOptions, described: DescribedTwin
    ) -> None:
        self._answers, self._options, self._described = answers, options, described

    def __getattr__(self, name: str) -> Any:
        if name in ("built", "request"):
            raise AttributeError(
                f"the twin is built on {self._answers.connection.address}, not here"
            )
        raise AttributeError(f"a twin has no attribute {name!r}")

    def _predict(self, shot: DrawnShot) -> ShotPrediction:
        from ..operations.predict.predict import PREDICT

        shot_fields = {**_fields(self._options), **_fields(shot)}
        prediction: ShotPrediction = self._answers.answer(
            PREDICT, PredictionsRequest.model_construct(set(shot_fields), **shot_fields)
        )
        return prediction

    def _predict_rows(
        self,
        rows: Sequence[ShotRow],
        draws: int,
        seed: int,
        jobs: int,  # noqa: ARG002  how many at once the server decides
        step: Step,
    ) -> tuple[list[dict[str, Any]], Sequence[str]]:
        figures: list[dict[str, Any]] = []
        notes: list[str] = []
        drawn = read_arguments(BandDraws, {"draws": draws, "seed": seed})
        for some_rows in _slices(rows, _SHOTS_AT_ONCE):
            body = {
                "twin": body_of(self._options),
                "draws": body_of(drawn),
                "rows": [_row_body(row) for row in some_rows],
            }
            with argument_words(self._options):
                answer = self._answers.connection.ask("/api/library/predictions", body)
            figures += answer["figures"]
            notes += answer["notes"]
            step(len(figures), len(rows), "")
        return figures, tuple(dict.fromkeys(notes))

    def _search(self, target: Target, search: SpectrumSearch, progress: bool) -> TunedSettings:
        from ..operations.tune.request import Tuning
        from ..operations.tune.tuning import TUNE

        own = {name: value for name, value in _fields(self._options).items() if name != "effects"}
        lost = own.keys() - Tuning.model_fields.keys()
        if self._options.effects or lost:
            names = ", ".join([*sorted(lost), *(["effects"] if self._options.effects else [])])
            raise InvalidValueError(
                f"tune on {self._answers.connection.address} takes no {names} of its twin; adopt "
                "the effects of a diagnosis, or tune where the store is"
            )
        search_fields = {**own, **_fields(search), **_target_fields(target)}
        request = Tuning.model_construct(set(search_fields), **search_fields)
        return self._answers.ask(TUNE, request).result(progress=progress)

    @raises_library_errors
    def with_effects(self, effects: EffectsLike) -> LaboratoryTwin:
        """The same twin with further effects, which take the place of those with the same id."""
        added = effects_of(effects, "effects")
        own = {effect.id for effect in added}
        effects_in_use = [
            effect
            for effect in effects_of(self._options.effects, "effects")
            if effect.id not in own
        ]
        twin_fields = {**_fields(self._options), "effects": (*effects_in_use, *added)}
        return remote_twin(self._answers, read_arguments(TwinOptions, twin_fields))


def remote_twin(answers: ServerAnswers, options: TwinOptions) -> RemoteTwin:
    """The twin of these options, built by the server.

    Parameters:
        answers: The server.
        options: What is asked of the twin.

    Raises:
        LookupError: For an unknown campaign, material, effect or contact model.
        ValueError: For a value that is out of its bounds.
    """
    with argument_words(options):
        described = answers.connection.ask("/api/library/twin", body_of(options))
    if not isinstance(described, DescribedTwin):
        raise StorageError(f"{answers.connection.address} has described no twin")
    return RemoteTwin(answers, options, described)


def _fields(request: Any) -> dict[str, Any]:
    return {name: getattr(request, name) for name in request.model_fields_set}


def _row_body(row: ShotRow) -> dict[str, Any]:
    return {
        "labels": dict(row.labels),
        "shot": body_of(row.shot),
        "plate": row.plate,
        "chain_height_m": row.chain_height_m,
    }


def _slices(rows: Sequence[ShotRow], size: int) -> list[Sequence[ShotRow]]:
    return [rows[start : start + size] for start in range(0, len(rows), size)]


def _target_fields(target: Target) -> dict[str, Any]:
    """A spectrum as the text of a file, and its tolerance, that are read as the same again.

    Raises `InvalidValueError` for a spectrum with a rule that no file states.
    """
    from ...twin.srs.standards import parse_tolerance
    from ...twin.srs.target_csv import target_of_csv
    from ..operations.fields import TextFile
    from ..operations.result_codec import encode

    levels = zip(target.frequency_hz.tolist(), target.level_m_s2.tolist(), strict=True)
    sides = zip(target.upper_db.tolist(), target.lower_db.tolist(), strict=True)
    bare = [f"{frequency!r},{level!r}" for frequency, level in levels]
    whole = [f"{line},{up!r},{low!r}" for line, (up, low) in zip(bare, sides, strict=True)]
    head = "frequency_hz,level_m_s2"
    same = f"+{target.upper_db[0]:g}/-{target.lower_db[0]:g}dB"
    for lines, tolerance in (
        ([f"{head},upper_db,lower_db", *whole], ""),
        ([head, *bare], ""),
        ([head, *bare], same),
    ):
        text = "\n".join(lines) + "\n"
        stated = parse_tolerance(tolerance) if tolerance else None
        read = target_of_csv(text.encode(), "target", stated)
        if encode(read) == encode(target):
            fields: dict[str, Any] = {"target": TextFile(text=text)}
            return {**fields, "tolerance": tolerance} if tolerance else fields
    raise InvalidValueError(
        f"target has the rule {target.rule!r}, which no file of a spectrum states; give the path "
        "of a file and tolerance"
    )
