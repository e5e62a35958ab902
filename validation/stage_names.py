"""In which stage an effect shows."""

from __future__ import annotations

#: The stages whose own gap shows an effect of the sensors between them.
_SEEN_IN = {
    "sensor.pressure_offset": ("gun",),
    "sensor.pressure_gain": ("gun",),
    "sensor.velocity_gain": ("gun", "contact"),
    "sensor.force_gain": ("contact", "plate"),
    "sensor.force_bandwidth": ("contact", "plate"),
}


def stages_of(effect: str) -> tuple[str, ...]:
    """Where an effect of the catalogue may be named: its own stage, or either side of an interface that is misread."""
    place = effect.split(".")[0]
    return _SEEN_IN.get(effect, ("plate",) if place == "sensor" else (place,))
