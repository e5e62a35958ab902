"""What a pulse and a snapshot are known by: hashes of content, never of a database's keys or of clocks."""

from __future__ import annotations

import hashlib
import json
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .predictors import PredictorSet
from .rows import Row
from .table import PulseTable

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

    The first half is the impact's (campaign, run, repetition, raw file) and so outlives a re-extraction; the second
    is the pulse's (extraction settings, figures, force points).
    """
    impact = [row["campaign"], row["run"], row["repetition"], row["recording_sha256"]]
    pulse = [row["extraction"], [float(row[name]).hex() for name in _FIGURES]]
    force = np.asarray(row["force_points_n"], dtype="<f8")
    return _digest(json.dumps(impact).encode())[:IMPACT_DIGITS] + _digest(json.dumps(pulse).encode(), force)[:32]


def content_hash(predictors: PredictorSet, table: PulseTable) -> str:
    """SHA-256 of what models see of a snapshot: predictors with their sources, and every column, in the table's order.

    The row's key in this store and the set's name are left out; the keys stand for raw files and extraction.
    """
    entries = predictors.as_json()["predictors"]
    parts: list[bytes | NDArray[Any]] = [json.dumps([_SCHEME, len(table), entries]).encode()]
    for field in fields(table):
        if field.name not in ("predictors", "pulse_id"):
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
        digest.update(len(content).to_bytes(8, "little"))  # so that no two lists of parts run together
        digest.update(content)
    return digest.hexdigest()
