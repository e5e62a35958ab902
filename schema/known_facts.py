"""What a laboratory knows of its own bench, `[known]` of campaign.toml: a value of one parameter
with its standard uncertainty, its source and its date.

The parameters are those of the effects that a diagnosis looks for. Their names, units and ranges
are a table of this room (`data/effect_parameters.csv`), because what reads a campaign's folder does
not know the catalogue of effects; a test compares the two. Effects of other packages bring theirs.
"""

from __future__ import annotations

import csv
import datetime as dt
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from ..plugins import EFFECTS, list_plugins


@dataclass(frozen=True)
class EffectParameter:
    """A parameter of an effect by its whole name, such as "gun.valve_flow.opening_time_s", its SI
    unit ("" for a pure number) and what it may be, ends included."""

    name: str
    unit: str
    low: float
    high: float


@cache
def effect_parameters() -> Mapping[str, EffectParameter]:
    """Every parameter that a fact may be of, by name."""
    text = (files(__package__) / "data" / "effect_parameters.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(text.splitlines())
    shipped = {
        row["name"]: EffectParameter(
            row["name"], row["unit"], float(row["low"]), float(row["high"])
        )
        for row in rows
    }
    return shipped | {item.name: item for item in _added() if item.name not in shipped}


def _added() -> Iterator[EffectParameter]:
    """Of effects of other packages, which are asked as the catalogue asks them. What cannot be
    loaded has none: the catalogue says why."""
    for plugin in list_plugins(EFFECTS):
        with suppress(Exception):  # whatever its code raises: the catalogue reports it
            for item in plugin.load().parameters():
                name = f"{plugin.name}.{item.name}"
                yield EffectParameter(name, item.unit, item.low, item.high)


@dataclass(frozen=True)
class KnownFact:
    """A parameter by its whole name, its `value` with the standard uncertainty `u`, SI; where it is
    from, and when that was measured (None: not stated)."""

    name: str
    value: float
    u: float
    source: str
    date: dt.date | None = None

    @property
    def effect(self) -> str:
        """The effect's id."""
        return self.name.rpartition(".")[0]

    @property
    def parameter(self) -> str:
        """The parameter's name within its effect."""
        return self.name.rpartition(".")[2]

    @property
    def words(self) -> str:
        """`0.12 ± 0.01 s (data sheet of the valve, 2024-03-12)`."""
        parameter = effect_parameters().get(self.name)
        number = f"{self.value:.6g} ± {self.u:.2g} {parameter.unit if parameter else ''}".rstrip()
        dated = f", {self.date.isoformat()}" if self.date else ""
        return f"{number} ({self.source}{dated})"


def facts_to_json(facts: Iterable[KnownFact]) -> dict[str, Any]:
    """As the row of a campaign keeps them: by name.

    Parameters:
        facts: The facts, in any order.
    """
    return {
        fact.name: {
            "value": fact.value,
            "u": fact.u,
            "source": fact.source,
            "date": fact.date.isoformat() if fact.date else None,
        }
        for fact in sorted(facts, key=lambda fact: fact.name)
    }


def facts_from_json(table: Mapping[str, Any] | None) -> tuple[KnownFact, ...]:
    """The inverse of `facts_to_json`.

    Parameters:
        table: The facts by name; None holds no fact.
    """
    return tuple(
        KnownFact(
            name,
            float(entry["value"]),
            float(entry["u"]),
            str(entry["source"]),
            dt.date.fromisoformat(entry["date"]) if entry.get("date") else None,
        )
        for name, entry in sorted((table or {}).items())
    )


def are_facts(value: Any) -> bool:
    """Whether a stored JSON value has the form of `facts_to_json`.

    Parameters:
        value: The value, of any form.
    """
    try:
        return isinstance(value, dict) and facts_to_json(facts_from_json(value)) == value
    except (
        KeyError,
        TypeError,
        ValueError,
        AttributeError,
    ):  # what another form of JSON makes of the reading
        return False
