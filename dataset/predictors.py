"""Sets of predictors as data: the shipped ones, and a lab's own TOML, every key checked.

name = "hammer"                     # of the set
kind = "hammer"                     # campaigns that it is for, or "gun"

[[predictors]]
name = "tip_radius"
unit = "m"                          # SI, left out for a number without one
from = "factor.tip_radius"          # see `sources`

[[predictors]]
name = "insulator"
from = "factor.insulator"
levels = ["none", "polymeric"]      # of a category: its value is the position of its level

How the predictors hang together (thesis, Fig. 4.8), and which values they took.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..array_types import Floats
from ..files.toml_text import check_keys, read_toml_text, toml_table
from ..schema.campaigns import KINDS
from ..schema.known_factors import BY_NAME
from .sources import FACTOR, NUMBERS, WORDS, known_sources
from .table import Inputs, Predictor

SHIPPED = ("hammer", "gun")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,62}", re.ASCII)
_TOP = ("name", "kind", "predictors")
_KEYS = ("name", "unit", "from", "levels")


@dataclass(frozen=True)
class PredictorSet:
    """Predictors in their order, and for each its source."""

    name: str
    kind: str
    predictors: tuple[Predictor, ...]
    sources: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back, with the keys of the TOML."""
        pairs = zip(self.predictors, self.sources, strict=True)
        entries = [
            {"name": p.name, "unit": p.unit, "from": source, "levels": list(p.levels)}
            for p, source in pairs
        ]
        return {"name": self.name, "kind": self.kind, "predictors": entries}


@cache
def shipped(name: str) -> PredictorSet:
    """A set that is shipped.

    Parameters:
        name: "hammer" or "gun".

    Raises:
        LookupError: For an unknown name, with those there are.
    """
    if name not in SHIPPED:
        raise LookupError(
            f"no predictors {name!r}; there are: {', '.join(SHIPPED)}, or a TOML file of your own"
        )
    return parse((files(__package__) / "data" / f"{name}.toml").read_text(encoding="utf-8"))


def predictors_named(text: str) -> PredictorSet:
    """A shipped set, or the set of a file.

    Parameters:
        text: The name of a shipped set, or the path of a TOML file.

    Raises:
        LookupError: For a name that no shipped set has.
        ValueError: For a file that is no set of predictors, with its name and the key.
        OSError: For a file that cannot be read.
    """
    if text in SHIPPED or not Path(text).suffix:
        return shipped(text)
    try:
        return parse(read_toml_text(Path(text)))
    except ValueError as error:
        raise ValueError(f"{text}: {error}") from error


def parse(text: str) -> PredictorSet:
    """A set from TOML.

    Parameters:
        text: The content of a TOML file with the keys of this module.

    Raises:
        ValueError: For a key that is wrong; the message names the key, its value and what was
            expected.
    """
    return from_json(toml_table(text))


def from_json(table: Mapping[str, Any]) -> PredictorSet:
    """A set from plain data.

    Parameters:
        table: The set with the keys of the TOML, as `PredictorSet.as_json` gives it.

    Raises:
        ValueError: For a key that is wrong; the message names the key, its value and what was
            expected.
    """
    check_keys(table, _TOP, "the file", required=_TOP)
    kind = table["kind"]
    if kind not in KINDS:
        raise ValueError(f"kind is {kind!r}; expected one of {', '.join(KINDS)}")
    entries = table["predictors"]
    if (
        not isinstance(entries, list)
        or not entries
        or not all(isinstance(entry, dict) for entry in entries)
    ):
        raise ValueError(f"predictors is {entries!r}; expected tables [[predictors]]")
    pairs = [_entry(entry, f"[[predictors]] {number}") for number, entry in enumerate(entries, 1)]
    names = [predictor.name for predictor, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(
                f"predictor {name!r} is given {names.count(name)} times; expected once"
            )
    return PredictorSet(
        _name(table, "the file"), kind, tuple(p for p, _ in pairs), tuple(s for _, s in pairs)
    )


def _entry(entry: Mapping[str, Any], where: str) -> tuple[Predictor, str]:
    check_keys(entry, _KEYS, where, required=("name", "from"))
    name, source, unit = _name(entry, where), entry["from"], entry.get("unit", "")
    levels = _levels(entry.get("levels", []), f"{where}: {name}")
    if not isinstance(unit, str):
        raise ValueError(f"{where}: {name}: unit is {unit!r}; expected a text")
    if not isinstance(source, str) or not _is_known(source):
        raise ValueError(f"{where}: {name}: from is {source!r}; known: {known_sources()}")
    _check_kind(source, unit, levels, f"{where}: {name}")
    return Predictor(name, unit, levels), source


def _is_known(source: str) -> bool:
    return (
        source in NUMBERS
        or source in WORDS
        or (source.startswith(FACTOR) and len(source) > len(FACTOR))
    )


def _check_kind(source: str, unit: str, levels: tuple[str, ...], where: str) -> None:
    """Words need levels, numbers their unit; what a lab's own factor holds, only its store
    knows."""
    factor = BY_NAME.get(source.removeprefix(FACTOR)) if source.startswith(FACTOR) else None
    is_number = source in NUMBERS or (factor is not None and factor.is_number)
    is_word = source in WORDS or (factor is not None and not factor.is_number)
    if levels and (is_number or unit):
        raise ValueError(f"{where}: {source!r} is a number, or has a unit; levels are for words")
    if is_word and not levels:
        raise ValueError(f"{where}: {source!r} is a word; expected its levels")
    if is_number:
        expected = (
            NUMBERS[source][0] if source in NUMBERS else (factor.si_unit if factor else None) or ""
        )
        if unit != expected:
            raise ValueError(f"{where}: unit is {unit!r}; {source!r} is in {expected!r}")


def _levels(value: object, where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(level, str) and level for level in value):
        raise ValueError(f"{where}: levels is {value!r}; expected a list of words")
    if len(set(value)) < len(value) or len(value) == 1:
        raise ValueError(f"{where}: levels is {value!r}; expected at least two that differ")
    return tuple(value)


def _name(entry: Mapping[str, Any], where: str) -> str:
    name = entry["name"]
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ValueError(
            f"{where}: name is {name!r}; expected lower-case letters, digits and _, at most 63"
        )
    return name


@dataclass(frozen=True, eq=False)
class Correlation:
    """Pearson's correlation of the predictors, `matrix` (d x d); NaN for one that never varied."""

    names: tuple[str, ...]
    matrix: Floats

    def as_json(self) -> dict[str, Any]:
        """Names and rows; what is not known is null."""
        rows = [[None if np.isnan(value) else float(value) for value in row] for row in self.matrix]
        return {"predictors": list(self.names), "correlation": rows}


def correlation(inputs: Inputs) -> Correlation:
    """Correlation over all rows. A category counts by the position of its level, as in the thesis.

    Parameters:
        inputs: The impacts.
    """
    x = inputs.x
    spread = np.ptp(x, axis=0) if len(x) else np.zeros(x.shape[1])
    varied = spread > 1e-12 * np.abs(x).max(axis=0, initial=0.0)
    matrix = np.full((x.shape[1], x.shape[1]), np.nan)
    # Scaled first: moduli of 1e11 Pa beside Poisson ratios lose digits otherwise.
    z = (x[:, varied] - x[:, varied].mean(axis=0)) / spread[varied]
    z /= np.sqrt((z**2).sum(axis=0))
    products = np.clip(z.T @ z, -1.0, 1.0)
    matrix[np.ix_(varied, varied)] = np.where(np.abs(products) < 1e-12, 0.0, products)
    return Correlation(tuple(predictor.name for predictor in inputs.predictors), matrix)


def ranges(inputs: Inputs) -> list[dict[str, Any]]:
    """One row per predictor: its unit, smallest and largest value, distinct values; of a category
    its level counts.

    Parameters:
        inputs: The impacts, at least one.
    """
    rows = []
    for predictor, column in zip(inputs.predictors, inputs.x.T, strict=True):
        row: dict[str, Any] = {
            "predictor": predictor.name,
            "unit": predictor.unit,
            "min": None,
            "max": None,
        }
        row |= {"distinct": len(np.unique(column)), "levels": None}
        if predictor.levels:
            counts = {level: int((column == i).sum()) for i, level in enumerate(predictor.levels)}
            row["levels"] = counts
        else:
            row |= {"min": float(column.min()), "max": float(column.max())}
        rows.append(row)
    return rows
