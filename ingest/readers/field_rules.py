"""What a format can say beside its samples, as rules: which fields a reader uses, which change no
number and why, and which it refuses."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from fnmatch import fnmatchcase
from typing import Any


class Treatment(StrEnum):
    """What becomes of a field."""

    USED = "used"
    HARMLESS = "harmless"
    REFUSED = "refused"


@dataclass(frozen=True)
class FieldRule:
    """One field of a format, or a family of them (`NI_Scale[*]_*`, patterns of `fnmatch`, compared
    without case).

    `reason` says what a used field sets, why a harmless one changes no number, or what to do about
    a refused one. `neutral` are the values of a refused field that say nothing, such as a scale of
    1.
    """

    name: str
    treatment: Treatment
    reason: str
    neutral: tuple[Any, ...] = ()

    def matches(self, name: str) -> bool:
        return fnmatchcase(name.lower(), self.name.lower())


def used(name: str, reason: str) -> FieldRule:
    """A field from which a rate, a start, a scale, a unit or a name is taken."""
    return FieldRule(name, Treatment.USED, reason)


def harmless(name: str, reason: str) -> FieldRule:
    """A field that changes no number."""
    return FieldRule(name, Treatment.HARMLESS, reason)


def refused(name: str, cure: str, *neutral: Any) -> FieldRule:
    """A field that would change the numbers in a way that the reader does not follow, unless its
    value is `neutral`."""
    return FieldRule(name, Treatment.REFUSED, cure, neutral)
