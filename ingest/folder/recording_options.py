"""`[recordings]` of campaign.toml: what the recordings do not say themselves; and `[force]`: from
which accelerometers a force is derived, and by which hammer hits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...files.toml_text import key_problems
from ...signals.channel import Sensor
from ...signals.units import UnitError
from ..errors import LONGEST_NAME, IngestError, printable
from ..readers import ReadingOptions
from ..readers.recording import MAX_COLUMNS
from ..readers.text_table import BLANKS

_RECORDING_OPTIONS_KEYS = (
    "columns",
    "sampling_rate_hz",
    "delimiter",
    "decimal",
    "harmless_fields",
    "uneven_time",
)
#: As campaign.toml writes it -> the sign.
_DELIMITERS = {",": ",", ";": ";", "|": "|", "\t": "\t", "tab": "\t", " ": BLANKS, "blanks": BLANKS}
_DECIMALS = (".", ",")
REFUSE, RESAMPLE = UNEVEN_TIME = ("refuse", "resample")


def reading_options(data: Mapping[str, Any]) -> ReadingOptions:
    """The table `[recordings]` of a campaign.toml.

    Parameters:
        data: The whole file as TOML gives it. Where it lacks the table, nothing is said of the
            recordings.

    Raises:
        IngestError: For what is not understood, with the key, its value and what was expected.
    """
    table = data.get("recordings", {})
    if not isinstance(table, Mapping):
        raise IngestError(
            f"campaign.toml: 'recordings' is {printable(table)}; expected a table [recordings]"
        )
    if problems := key_problems(table, _RECORDING_OPTIONS_KEYS, "recordings."):
        raise IngestError(*(f"campaign.toml: {problem}" for problem in problems))
    delimiter = _sign(table, "delimiter", _DELIMITERS, '",", ";", "|", "tab" or "blanks"')
    decimal = _sign(table, "decimal", dict(zip(_DECIMALS, _DECIMALS, strict=True)), '"." or ","')
    if delimiter == "," and decimal == ",":
        raise IngestError(
            "campaign.toml: recordings.delimiter and recordings.decimal are "
            "both ','; expected two signs"
        )
    expected = '"refuse" or "resample"'
    uneven_time = _sign(
        table, "uneven_time", dict(zip(UNEVEN_TIME, UNEVEN_TIME, strict=True)), expected
    )
    return ReadingOptions(
        _columns(table),
        _rate(table),
        delimiter,
        decimal,
        _harmless_fields(table),
        uneven_time == RESAMPLE,
    )


def _columns(table: Mapping[str, Any]) -> tuple[str, ...]:
    value = table.get("columns", [])
    expected = 'expected the names of all columns in order, such as ["time", "force"]'
    if (
        not isinstance(value, list)
        or not all(isinstance(name, str) for name in value)
        or len(value) > MAX_COLUMNS
    ):
        raise IngestError(f"campaign.toml: recordings.columns is {printable(value)}; {expected}")
    names = [name.strip() for name in value]
    long_or_odd = any(not name.isprintable() or len(name) > LONGEST_NAME for name in names)
    if long_or_odd or ("columns" in table and not any(names)):
        raise IngestError(
            f"campaign.toml: recordings.columns is {printable(value)}; {expected}, each on one line"
        )
    double = next((name for name in names if name and names.count(name) > 1), None)
    if double is not None:
        raise IngestError(
            f"campaign.toml: recordings.columns names {printable(double)} twice; expected "
            'different names ("" for a column that is not read)'
        )
    return tuple(names)


def _rate(table: Mapping[str, Any]) -> float | None:
    value = table.get("sampling_rate_hz")
    if value is None:
        return None
    if (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and 0 < value < 1e15
        and math.isfinite(value)
    ):
        return float(value)
    raise IngestError(
        f"campaign.toml: recordings.sampling_rate_hz is {printable(value)}; "
        f"expected a number above zero, in hertz"
    )


def _harmless_fields(table: Mapping[str, Any]) -> tuple[str, ...]:
    value = table.get("harmless_fields", [])
    if not isinstance(value, list) or not all(
        isinstance(name, str) and name.strip() for name in value
    ):
        raise IngestError(
            f"campaign.toml: recordings.harmless_fields is {printable(value)}; expected the names "
            'of fields of the files that change no number, such as ["Trigger delay"]'
        )
    return tuple(value)


def _sign(
    table: Mapping[str, Any], key: str, signs: Mapping[str, str], expected: str
) -> str | None:
    if key not in table:
        return None
    value = table[key]
    if not isinstance(value, str) or value not in signs:
        raise IngestError(
            f"campaign.toml: recordings.{key} is {printable(value)}; expected {expected}"
        )
    return signs[value]


FILE = "campaign.toml"
_KEYS = ("from", "transfer_function", "channel", "unit", "sensitivity", "impact_position")
#: What to do where no transfer function can be had.
ADVICE = (
    "record at least three hits of an instrumented hammer at the point that "
    "the projectile strikes, with the "
    "accelerometers as they stay for the shots, and name the recording in force.transfer_function"
)


@dataclass(frozen=True)
class ForceSource:
    """Accelerometers (names of channels), the recording of hammer hits relative to the folder, its
    force channel, and the impact position of those hits where it is stated."""

    accelerometers: tuple[str, ...]
    recording: str
    hammer: Sensor
    impact_position: str | None


def force_source(table: Mapping[str, Any], sensors: Mapping[str, Sensor]) -> ForceSource | None:
    """The table `[force]` of a campaign.toml; None where it is empty.

    Parameters:
        table: The table as TOML gives it.
        sensors: The declared sensors by channel. The table names accelerometers among them, and
            none of them records a force.

    Raises:
        IngestError: For what is not understood, with key, value and what was expected.
    """
    if not table:
        return None
    if problems := key_problems(table, _KEYS, "force."):
        raise IngestError(*(f"{FILE}: {problem}" for problem in problems))
    recorded = sorted(sensor.name for sensor in sensors.values() if sensor.quantity == "force")
    if recorded:
        raise IngestError(
            f"{FILE}: [force] derives a force, and channels.{recorded[0]} "
            f"records one; remove [force], or the channel"
        )
    names = table.get("from")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise IngestError(
            f"{FILE}: force.from is {printable(names)}; expected a list of "
            f'channels such as ["acc_1"]'
        )
    for name in names:
        if name not in sensors or sensors[name].quantity != "acceleration":
            accelerometers = (
                ", ".join(s.name for s in sensors.values() if s.quantity == "acceleration")
                or "none"
            )
            raise IngestError(
                f"{FILE}: force.from names {printable(name)}; expected "
                f"acceleration channels, here: {accelerometers}"
            )
    recording = _text(table, "transfer_function")
    if recording is None:
        raise IngestError(f"{FILE}: force.transfer_function is missing; {ADVICE}")
    hammer = Sensor(
        name=_text(table, "channel") or "force",
        quantity="force",
        unit=_text(table, "unit") or "N",
        sensitivity=_sensitivity(table),
    )
    try:
        _ = hammer.conversion
    except UnitError as error:
        raise IngestError(f"{FILE}: force.unit: {error}") from error
    return ForceSource(tuple(names), recording, hammer, _text(table, "impact_position"))


def _text(table: Mapping[str, Any], key: str) -> str | None:
    value = table.get(key)
    if value is not None and (not isinstance(value, str) or not value.strip()):
        raise IngestError(f"{FILE}: force.{key} is {printable(value)}; expected a text")
    return value


def _sensitivity(table: Mapping[str, Any]) -> float | None:
    value = table.get("sensitivity")
    if value is None:
        return None
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not 0 < abs(value) < float("inf")
    ):
        raise IngestError(
            f"{FILE}: force.sensitivity is {printable(value)}; expected volt "
            f"per unit, other than zero"
        )
    return float(value)
