"""Numbers of a bench that a user may declare uncertain, by their names."""

from __future__ import annotations

from dataclasses import fields
from difflib import get_close_matches

from ...diagnosis.observables.contact.stage import UNCERTAIN
from ...diagnosis.observables.gun.stage import READINGS
from ...twin.gun.bench import GunBench


def uncertain_numbers() -> dict[str, tuple[str, ...]]:
    """By stage: settings of the gun with the readings of a shot, and quantities of the nominal impact."""
    return {"gun": (*(item.name for item in fields(GunBench)), *READINGS), "contact": UNCERTAIN}


def full_name(name: str) -> str:
    """`gun.bullet_mass_kg` for that, and for `bullet_mass_kg`: no two stages have a number of the same name.

    Raises `ValueError` for a name that no stage has, with the nearest one, or all.
    """
    numbers = {number: f"{stage}.{number}" for stage, names in uncertain_numbers().items() for number in names}
    bare = name.rpartition(".")[2]
    if bare in numbers and name in (bare, numbers[bare]):
        return numbers[bare]
    near = get_close_matches(bare, numbers, 1, 0.5)
    if near:
        raise ValueError(f"no number {name!r}; the nearest is {numbers[near[0]]}")
    raise ValueError(f"no number {name!r}; there are {', '.join(numbers.values())}")
