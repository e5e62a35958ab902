"""What a user asks of a diagnosis: the campaign, the simulator, and which effects are
considered."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from difflib import get_close_matches
from pathlib import Path

from ....diagnosis.observables.contact.stage import UNCERTAIN
from ....diagnosis.observables.gun.stage import READINGS
from ....twin.effects import added_effects, catalogue
from ....twin.gun.bench import GunBench

Progress = Callable[[int, int, str], None]
MODELS = "models:/"
#: The registered model in use, whatever its kind.
IN_USE = "contact-force"


@dataclass(frozen=True)
class DiagnoseArguments:
    """What a user asks of a diagnosis, of what any worker can read. `tolerances` by stage, in the
    unit of its levels: shares for gun and contact, dB for the plate; `uncertain` are standard
    deviations of nominal numbers, "gun.friction_coefficient", in SI; `with_effects`: ids of the
    effects that alone are considered (none: all), `without_effects`: of those that are not."""

    target: str
    simulator: str | None = None
    tolerances: Mapping[str, float] = field(default_factory=dict)
    uncertain: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    with_effects: Sequence[str] = ()
    without_effects: Sequence[str] = ()


@dataclass(frozen=True)
class DiagnosisRequest(DiagnoseArguments):
    """What a user asks of a diagnosis. `modes` and `bench`: files of this machine that describe the
    plate."""

    modes: Path | None = None
    bench: Path | None = None


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
    """Raises `LookupError` for an id that is not in the catalogue, with those that are."""
    for option, names in (("--with", only), ("--without", without)):
        if unknown := [name for name in names if name not in catalogue()]:
            if unknown[0] in (failures := added_effects().failures):
                raise LookupError(f"{option} {unknown[0]!r}: {failures[unknown[0]]}")
            raise LookupError(
                f"{option} {unknown[0]!r}: the catalogue has no such effect; "
                f"it has {_list(catalogue())}"
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
