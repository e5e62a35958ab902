"""From rows of the store to a table of pulses; what cannot enter it is told with a reason.

What a pulse and a snapshot are known by: hashes of content, never of a database's keys or of
clocks.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .predictors import PredictorSet
from .rows import Levels, Row, case_of
from .sources import VELOCITY, ImpactSource, Materials, read_number, read_word
from .table import POINTS, Predictor, PulseTable

#: Digits of a key that name the impact; the others name its pulse.
IMPACT_DIGITS = 32
#: Counts changes of what is hashed.
_SCHEME = 1
_FIGURES = (
    "start_s",
    "contact_time_s",
    "compression_time_s",
    "spline_peak_force_n",
    "impulse_n_s",
    "compression_impulse_n_s",
)


def pulse_key(row: Row) -> str:
    """64 hexadecimal digits, the same in any store.

    The first half is the impact's (campaign, run, repetition, raw file) and so outlives a
    re-extraction; the second is the pulse's (extraction settings, figures, force points).
    """
    impact = [row["campaign"], row["run"], row["repetition"], row["recording_sha256"]]
    pulse = [row["extraction"], [float(row[name]).hex() for name in _FIGURES]]
    force = np.asarray(row["force_points_n"], dtype="<f8")
    return (
        _digest(json.dumps(impact).encode())[:IMPACT_DIGITS]
        + _digest(json.dumps(pulse).encode(), force)[:32]
    )


def content_hash(predictors: PredictorSet, table: PulseTable) -> str:
    """SHA-256 of what models see of a snapshot: predictors with their sources, and every column, in
    the table's order.

    The row's key in this store and the set's name are left out; the keys stand for raw files and
    extraction, and so for the sampling period.
    """
    entries = predictors.as_json()["predictors"]
    parts: list[bytes | NDArray[Any]] = [json.dumps([_SCHEME, len(table), entries]).encode()]
    for field in fields(table):
        if field.name not in ("predictors", "pulse_id", "sample_s"):
            parts += [field.name.encode(), _plain(getattr(table, field.name))]
    return _digest(*parts)


def _plain(values: NDArray[Any]) -> bytes | NDArray[Any]:
    """Bytes of an array, the same on every machine: one zero, one NaN, little-endian."""
    if values.dtype.kind == "U":
        return json.dumps(values.tolist()).encode()
    if values.dtype.kind == "i":
        return values.astype("<i8")
    numbers = values.astype("<f8") + 0.0
    return np.where(np.isnan(numbers), np.nan, numbers).astype("<f8")


def _digest(*parts: bytes | NDArray[Any]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        content = part if isinstance(part, bytes) else part.tobytes()
        digest.update(
            len(content).to_bytes(8, "little")
        )  # so that no two lists of parts run together
        digest.update(content)
    return digest.hexdigest()


class MissingError(ValueError):
    """The store does not know what a predictor asks for; the message is the reason, one per kind of
    cause."""


@dataclass(frozen=True)
class Member:
    """An impact that can enter a table: its row, what it was made with, and its predictors (d,)."""

    row: Row
    case: ImpactSource
    inputs: tuple[float, ...]


def member_of(row: Row, levels: Levels, predictors: PredictorSet, materials: Materials) -> Member:
    """An impact with its predictors. Raises `MissingError` with the reason why it cannot enter."""
    if row["pulse_id"] is None:
        raise MissingError("no pulse")
    if len(row["force_points_n"]) != POINTS:
        raise MissingError(f"a force of {len(row['force_points_n'])} points; expected {POINTS}")
    case = case_of(row, levels)
    if not (case.velocity_m_s is None or case.velocity_m_s > 0):
        raise MissingError("an impact velocity of zero")
    pairs = zip(predictors.predictors, predictors.sources, strict=True)
    return Member(
        row, case, tuple(_value(predictor, source, case, materials) for predictor, source in pairs)
    )


def _value(predictor: Predictor, source: str, case: ImpactSource, materials: Materials) -> float:
    if not predictor.levels:
        number = read_number(source, case, materials)
        if number is None:
            raise MissingError(f"no {predictor.name}")
        return float(number)
    word = read_word(source, case)
    if word is None:
        raise MissingError(f"no {predictor.name}")
    if word not in predictor.levels:
        raise MissingError(f"{predictor.name} is {word}; levels are {', '.join(predictor.levels)}")
    return float(predictor.levels.index(word))


def table_of(members: Sequence[Member], predictors: PredictorSet) -> PulseTable:
    """The members as arrays, n rows in their order; at least one."""
    rows = [member.row for member in members]
    cases = [member.case for member in members]
    return PulseTable(
        predictors=predictors.predictors,
        x=np.array([member.inputs for member in members]),
        impactor_mass_kg=_known_or_nan([case.impactor_mass_kg for case in cases]),
        plate_thickness_m=_known_or_nan([case.plate_thickness_m for case in cases]),
        force_n=np.array([row["force_points_n"] for row in rows], dtype=np.float64),
        contact_time_s=_numbers(rows, "contact_time_s"),
        compression_time_s=_numbers(rows, "compression_time_s"),
        peak_force_n=_numbers(rows, "spline_peak_force_n"),
        impulse_n_s=_numbers(rows, "impulse_n_s"),
        compression_impulse_n_s=_numbers(rows, "compression_impulse_n_s"),
        configuration=np.array([configuration_text(case.words) for case in cases]),
        treatment=np.array([_treatment(member.inputs, predictors) for member in members]),
        tip_material=np.array([case.tip or "" for case in cases]),
        target_material=np.array([case.target or "" for case in cases]),
        campaign=np.array([row["campaign"] for row in rows]),
        run=np.array([row["run"] for row in rows], dtype=np.int64),
        repetition=np.array([row["repetition"] for row in rows], dtype=np.int64),
        key=np.array([pulse_key(row) for row in rows]),
        pulse_id=np.array([row["pulse_id"] for row in rows], dtype=np.int64),
        sample_s=np.array([_sample_s(row) for row in rows], dtype=np.float64),
    )


def _sample_s(row: Row) -> float:
    """The sampling period of the force: that of the finely smoothed pulse times what its extraction
    refined it by."""
    settings = row.get("extraction_settings") or {}
    return (
        float(row["fine_period_s"]) * float(settings["refinement"])
        if "refinement" in settings
        else float("nan")
    )


def configuration_text(words: Mapping[str, str]) -> str:
    """A combination of factors: "anvil_material=steel/tip_material=delrin", by name."""
    return "/".join(f"{factor}={words[factor]}" for factor in sorted(words))


def _treatment(inputs: Sequence[float], predictors: PredictorSet) -> str:
    """The values that the predictors other than the velocity have; to twelve digits, for numbers
    come by two roads."""
    triples = zip(predictors.predictors, predictors.sources, inputs, strict=True)
    return "/".join(
        predictor.levels[int(value)] if predictor.levels else f"{value:.12g}"
        for predictor, source, value in triples
        if source != VELOCITY
    )


def _numbers(rows: Sequence[Row], name: str) -> Floats:
    return np.array([row[name] for row in rows], dtype=np.float64)


def _known_or_nan(values: Sequence[float | None]) -> Floats:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
