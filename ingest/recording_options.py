"""`[recordings]` of campaign.toml: what the recordings do not say themselves."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from .errors import IngestError
from .printable import LONGEST_NAME, shown
from .readers import ReadingOptions
from .readers.csv_layout import BLANKS
from .readers.matrix import MAX_COLUMNS

_KEYS = ("columns", "sampling_rate_hz", "delimiter", "decimal")
#: As campaign.toml writes it -> the sign.
_DELIMITERS = {",": ",", ";": ";", "|": "|", "\t": "\t", "tab": "\t", " ": BLANKS, "blanks": BLANKS}
_DECIMALS = (".", ",")


def reading_options(data: Mapping[str, Any]) -> ReadingOptions:
    """`[recordings]` of a campaign.toml. Raises `IngestError` with the key, its value and what was expected."""
    table = data.get("recordings", {})
    if not isinstance(table, Mapping):
        raise IngestError(f"campaign.toml: 'recordings' is {shown(table)}; expected a table [recordings]")
    for key in table:
        if key not in _KEYS:
            raise IngestError(f"campaign.toml: unknown key {shown(f'recordings.{key}')}; known: {', '.join(_KEYS)}")
    delimiter = _sign(table, "delimiter", _DELIMITERS, '",", ";", "|", "tab" or "blanks"')
    decimal = _sign(table, "decimal", dict(zip(_DECIMALS, _DECIMALS, strict=True)), '"." or ","')
    if delimiter == "," and decimal == ",":
        raise IngestError("campaign.toml: recordings.delimiter and recordings.decimal are both ','; expected two signs")
    return ReadingOptions(_columns(table), _rate(table), delimiter, decimal)


def _columns(table: Mapping[str, Any]) -> tuple[str, ...]:
    value = table.get("columns", [])
    expected = 'expected the names of all columns in order, such as ["time", "force"]'
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value) or len(value) > MAX_COLUMNS:
        raise IngestError(f"campaign.toml: recordings.columns is {shown(value)}; {expected}")
    names = [name.strip() for name in value]
    long_or_odd = any(not name.isprintable() or len(name) > LONGEST_NAME for name in names)
    if long_or_odd or ("columns" in table and not any(names)):
        raise IngestError(f"campaign.toml: recordings.columns is {shown(value)}; {expected}, each on one line")
    double = next((name for name in names if name and names.count(name) > 1), None)
    if double is not None:
        raise IngestError(
            f"campaign.toml: recordings.columns names {shown(double)} twice; expected different names "
            '("" for a column that is not read)'
        )
    return tuple(names)


def _rate(table: Mapping[str, Any]) -> float | None:
    value = table.get("sampling_rate_hz")
    if value is None:
        return None
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1e15 and math.isfinite(value):
        return float(value)
    raise IngestError(
        f"campaign.toml: recordings.sampling_rate_hz is {shown(value)}; expected a number above zero, in hertz"
    )


def _sign(table: Mapping[str, Any], key: str, signs: Mapping[str, str], expected: str) -> str | None:
    if key not in table:
        return None
    value = table[key]
    if not isinstance(value, str) or value not in signs:
        raise IngestError(f"campaign.toml: recordings.{key} is {shown(value)}; expected {expected}")
    return signs[value]
