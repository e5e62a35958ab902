"""`[force]` of campaign.toml: from which accelerometers a force is derived, and by which hammer hits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..signals.channel import Sensor
from ..signals.units import UnitError
from .errors import IngestError
from .printable import shown

FILE = "campaign.toml"
_KEYS = ("from", "transfer_function", "channel", "unit", "sensitivity", "impact_position")
#: What to do where no transfer function can be had.
ADVICE = (
    "record at least three hits of an instrumented hammer at the point that the projectile strikes, with the "
    "accelerometers as they stay for the shots, and name the recording in force.transfer_function"
)


@dataclass(frozen=True)
class ForceSource:
    """Accelerometers (names of channels), the recording of hammer hits relative to the folder, its force channel, and
    the impact position of those hits where it is stated."""

    accelerometers: tuple[str, ...]
    recording: str
    hammer: Sensor
    impact_position: str | None


def force_source(table: Mapping[str, Any], sensors: Mapping[str, Sensor]) -> ForceSource | None:
    """The table `[force]`; None where it is empty. Raises `IngestError` with key, value and what was expected."""
    if not table:
        return None
    for key in table:
        if key not in _KEYS:
            raise IngestError(f"{FILE}: unknown key {shown(f'force.{key}')}; known: {', '.join(_KEYS)}")
    recorded = sorted(sensor.name for sensor in sensors.values() if sensor.quantity == "force")
    if recorded:
        raise IngestError(
            f"{FILE}: [force] derives a force, and channels.{recorded[0]} records one; remove [force], or the channel"
        )
    names = table.get("from")
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise IngestError(f'{FILE}: force.from is {shown(names)}; expected a list of channels such as ["acc_1"]')
    for name in names:
        if name not in sensors or sensors[name].quantity != "acceleration":
            accelerometers = ", ".join(s.name for s in sensors.values() if s.quantity == "acceleration") or "none"
            raise IngestError(
                f"{FILE}: force.from names {shown(name)}; expected acceleration channels, here: {accelerometers}"
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
        raise IngestError(f"{FILE}: force.{key} is {shown(value)}; expected a text")
    return value


def _sensitivity(table: Mapping[str, Any]) -> float | None:
    value = table.get("sensitivity")
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < abs(value) < float("inf"):
        raise IngestError(f"{FILE}: force.sensitivity is {shown(value)}; expected volt per unit, other than zero")
    return float(value)
