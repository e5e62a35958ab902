"""Names of nominal numbers that a user may declare uncertain, with or without the stage that they belong to."""

from __future__ import annotations

from dataclasses import fields
from difflib import get_close_matches


def uncertain_numbers() -> dict[str, tuple[str, ...]]:
    """By stage: settings of the gun with the readings of a shot, and quantities of the nominal impact."""
    from ..twin.gun.bench import GunBench
    from .observables.contact.stage import UNCERTAIN
    from .observables.gun.stage import READINGS

    return {"gun": (*(item.name for item in fields(GunBench)), *READINGS), "contact": UNCERTAIN}


def full_name(name: str) -> str:
    """`gun.bullet_mass_kg` for that, and for `bullet_mass_kg`, which only the gun has.

    Raises `ValueError` for a name that no stage has, with the nearest one, or all.
    """
    numbers = uncertain_numbers()
    every = [f"{stage}.{number}" for stage, names in numbers.items() for number in names]
    if name in every:
        return name
    owners = [stage for stage, names in numbers.items() if name in names]
    if len(owners) == 1:
        return f"{owners[0]}.{name}"
    if owners:
        raise ValueError(f"{name} belongs to several stages; say {' or '.join(f'{stage}.{name}' for stage in owners)}")
    bare = name.rpartition(".")[2]
    near = get_close_matches(bare, [each.partition(".")[2] for each in every], 1, 0.5)
    if near:
        raise ValueError(f"no number {name!r}; the nearest is {full_name(near[0])}")
    raise ValueError(f"no number {name!r}; there are {', '.join(every)}")
