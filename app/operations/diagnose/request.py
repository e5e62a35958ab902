"""What a user asks of a diagnosis: the campaign, the simulator, and which effects are
considered."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, model_validator

from ..faults import UnknownValueError
from ..fields import Names, Presentation, Seed, pairs, request_field, text_file
from ..operation import Request

MODELS = "models:/"
#: The registered model in use, whatever its kind.
IN_USE = "contact-force"
#: Of a file that describes the plate.
_MOST_BYTES = 2_000_000
#: Stages with a tolerance, and its unit as it is typed. A report has dB, and shares for "%".
_UNITS = {"gun": "%", "contact": "%", "plate": "dB"}
_TOLERANCES = "gun=1%, contact=3% or plate=0.5dB"
#: Names of the fields in earlier jobs and in scripts.
_OTHER_NAMES = {"target": "campaign", "with": "with_effects", "without": "without_effects"}


def _effect_ids(words: Sequence[str]) -> tuple[str, ...]:
    """Each id once; "a+b", as reports name a set, is a and b."""
    return tuple(
        dict.fromkeys(part for word in words for part in re.split(r"[+\s]+", word) if part)
    )


#: Ids of effects, as a list, as one text with commas, or repeated.
EffectIds = Annotated[Names, AfterValidator(_effect_ids)]


def _tolerance(field: str, stage: str, size: Any) -> float:
    """In the unit of a report, of a number in it or of a text with "%" or "dB"."""
    unit = _UNITS.get(stage, "%")
    try:
        if stage not in _UNITS:
            raise ValueError
        if isinstance(size, str):
            if not size.lower().endswith(unit.lower()):
                raise ValueError
            value = float(size[: -len(unit)]) / (1 if unit == "dB" else 100)
        else:
            value = float(size)
        if not 0 < value < (100 if unit == "dB" else 1):
            raise ValueError
    except (TypeError, ValueError) as error:
        raise ValueError(f"{field} is '{stage}={size}'; expected {_TOLERANCES}") from error
    return value


def _spelled_tolerance(stage: str, size: float) -> str:
    return f"{size:.9g}dB" if _UNITS[stage] == "dB" else f"{100 * size:.9g}%"


def _deviation(field: str, name: str, size: Any) -> float:
    text = f"{field} is '{name}{'' if size == '' else f'={size}'}'"
    example = "expected NUMBER=SD, such as gun.friction_coefficient=0.05 or bullet_mass_kg=0.001"
    try:
        value = float(size)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{text}; {example}") from error
    if not 0 < value < math.inf:
        raise ValueError(f"{text}; {example}, and SD above 0")
    try:
        full_name(name)
    except ValueError as error:
        raise ValueError(f"{text}: {error}") from error
    return value


def _with_stages(uncertain: Mapping[str, float]) -> dict[str, float]:
    """The same deviations by full names."""
    return {full_name(name): deviation for name, deviation in uncertain.items()}


def _known_simulator(text: str | None) -> str | None:
    if text in (None, "", "nominal") or text.startswith(MODELS) or "@" in text:
        return text or None
    raise ValueError(
        f"simulator is {text!r}; expected nominal, or MODEL@VERSION of a registered model"
    )


class DiagnosisRequest(Request):
    """What a user asks of a diagnosis. `tolerances` by stage are shares for gun and contact, dB for
    the plate; `uncertain` are standard deviations of nominal numbers in SI, by full names."""

    campaign: Annotated[
        str,
        BeforeValidator(lambda value: os.fspath(value) if hasattr(value, "__fspath__") else value),
    ] = request_field(
        min_length=1,
        max_length=1000,
        help="Diagnose this campaign of the store, or the campaign of this folder.",
        presentation=Presentation(
            positional=True, metavar="CAMPAIGN_OR_FOLDER", completion="campaign_names"
        ),
    )
    simulator: Annotated[str | None, AfterValidator(_known_simulator)] = request_field(
        None,
        max_length=300,
        help="Choose the simulator of the contact; models:/MODEL@VERSION is accepted, too. "
        "[default: nominal]",
        presentation=Presentation(
            metavar="nominal|MODEL@VERSION",
            completion="model_versions",
            label="Model of the contact",
        ),
    )
    with_effects: EffectIds = request_field(
        (),
        max_length=100,
        help="Consider these effects only. Repeat the option, or give a list: a,b.",
        presentation=Presentation(metavar="EFFECT", completion="effect_ids", option="with"),
    )
    without_effects: EffectIds = request_field(
        (),
        max_length=100,
        help="Leave these effects out. Repeat the option, or give a list: a,b.",
        presentation=Presentation(metavar="EFFECT", completion="effect_ids", option="without"),
    )
    adopt: EffectIds = request_field(
        (),
        max_length=100,
        help="Let predictions of this bench use these effects from now on, or the mean of effects "
        "that cannot be told apart: a/b; `none` ends this. Repeat the option, or give a list: a,b.",
        presentation=Presentation(metavar="EFFECT|none", completion="effect_ids"),
    )
    tolerances: pairs(_tolerance, float, _spelled_tolerance) = request_field(  # type: ignore[valid-type]
        {},
        help="Set the tolerance of a stage: gun=1%, contact=3% or plate=0.5dB. Repeat the option, "
        "or give a list: a,b.",
        presentation=Presentation(metavar="STAGE=SIZE", option="tolerance"),
    )
    uncertain: Annotated[
        pairs(_deviation, float), AfterValidator(_with_stages)  # type: ignore[valid-type]
    ] = request_field(
        {},
        help="Set the standard deviation of a number, in SI: bullet_mass_kg=0.001. Those of the "
        "contact are shares. Repeat the option, or give a list: a,b.",
        presentation=Presentation(metavar="NUMBER=SD", lines=3, label="Uncertain numbers"),
    )
    modes: text_file(_MOST_BYTES) | None = request_field(  # type: ignore[valid-type]
        None,
        help="Read the measured modes of the plate from a CSV file.",
        presentation=Presentation(metavar="FILE.csv"),
    )
    bench: text_file(_MOST_BYTES) | None = request_field(  # type: ignore[valid-type]
        None,
        help="Describe the plate by a TOML file with the table [plate].",
        presentation=Presentation(metavar="FILE.toml"),
    )
    seed: Seed = request_field(0, help="Set the seed: the same seed gives the same answer.")

    @model_validator(mode="before")
    @classmethod
    def _by_other_names(cls, values: Any) -> Any:
        if not isinstance(values, Mapping):
            return values
        return {_OTHER_NAMES.get(name, name): value for name, value in values.items()}

    @property
    def adopted(self) -> str | None:
        """What is to be adopted, as reports write it; None where nothing is."""
        return "+".join(self.adopt) or None

    @property
    def words(self) -> str:
        """The campaign, and which effects are considered."""
        parts = [self.campaign]
        parts += [f"with {', '.join(self.with_effects)}"] if self.with_effects else []
        parts += [f"without {', '.join(self.without_effects)}"] if self.without_effects else []
        return " ".join(parts)


def considered_effects(
    campaign: str, detectable: Sequence[str], only: Sequence[str] = (), without: Sequence[str] = ()
) -> tuple[str, ...]:
    """The effects of `detectable` that are left when a diagnosis is restricted to `only` (empty: to
    none), less those of `without`, in the order of `detectable`: the ids that the campaign's
    channels can show.

    Raises `LookupError` for an id that is not in the catalogue, `ValueError` for one that the
    campaign cannot show, and where no effect is left; each names what there is.
    """
    check_effects(only, without)
    for option, names in (("--with", only), ("--without", without)):
        if hidden := [name for name in names if name not in detectable]:
            raise ValueError(
                f"{option} {hidden[0]}: the channels of {campaign} cannot show this effect; they "
                f"can show {_list(detectable)}"
            )
    effects = tuple(
        name for name in detectable if (not only or name in only) and name not in without
    )
    if not effects:
        raise ValueError(
            f"--with and --without leave no effect to consider for {campaign}; its channels can "
            f"show {_list(detectable)}"
        )
    return effects


def check_effects(only: Sequence[str] = (), without: Sequence[str] = ()) -> None:
    """Raises `UnknownValueError` for an id that is not in the catalogue, with those that are."""
    from ....twin.effects import added_effects, catalogue

    for option, names in (("--with", only), ("--without", without)):
        if unknown := [name for name in names if name not in catalogue()]:
            control = f"{option.removeprefix('--')}_effects"
            if unknown[0] in (failures := added_effects().failures):
                raise UnknownValueError(control, f"{option} {unknown[0]!r}: {failures[unknown[0]]}")
            raise UnknownValueError(
                control,
                f"{option} {unknown[0]!r}: the catalogue has no such effect; "
                f"it has {_list(catalogue())}",
            )


def restriction_sentences(only: Sequence[str] = (), without: Sequence[str] = ()) -> tuple[str, ...]:
    """What a report says under its assumptions of a restriction; nothing where there is none."""
    sentences = []
    if only:
        sentences.append(f"{_ONLY} {_list(dict.fromkeys(only))} (--with), and no other effect.")
    if without:
        sentences.append(f"{_WITHOUT} {_list(dict.fromkeys(without))} (--without).")
    return tuple(sentences)


def restrictions_among(assumptions: Sequence[str]) -> tuple[str, ...]:
    """Those sentences of a report's assumptions that say which effects were not considered."""
    return tuple(sentence for sentence in assumptions if sentence.startswith((_ONLY, _WITHOUT)))


def _list(names: Iterable[str]) -> str:
    return ", ".join(names) or "no effect"


def uncertain_numbers() -> dict[str, tuple[str, ...]]:
    """By stage: settings of the gun with the readings of a shot, and quantities of the nominal
    impact."""
    from dataclasses import fields

    from ....diagnosis.observables.contact.stage import UNCERTAIN
    from ....diagnosis.observables.gun.stage import READINGS
    from ....twin.gun.bench import GunBench

    return {"gun": (*(item.name for item in fields(GunBench)), *READINGS), "contact": UNCERTAIN}


def full_name(name: str) -> str:
    """`gun.bullet_mass_kg` for that, and for `bullet_mass_kg`: no two stages have a number of the
    same name.

    Raises `ValueError` for a name that no stage has, with the nearest one, or all.
    """
    numbers = {
        number: f"{stage}.{number}"
        for stage, names in uncertain_numbers().items()
        for number in names
    }
    bare = name.rpartition(".")[2]
    if bare in numbers and name in (bare, numbers[bare]):
        return numbers[bare]
    near = get_close_matches(bare, numbers, 1, 0.5)
    if near:
        raise ValueError(f"no number {name!r}; the nearest is {numbers[near[0]]}")
    raise ValueError(f"no number {name!r}; there are {', '.join(numbers.values())}")


_ONLY, _WITHOUT = "The diagnosis considers only", "The diagnosis does not consider"
