"""Settings of bench and runs that no bench of this kind has: a number in another unit than its column's."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ..record import CampaignRecord
from .finding import Finding


@dataclass(frozen=True)
class Limit:
    """Beyond `low` or `high` (SI) a setting is another unit's; the words say which to look for."""

    setting: str
    low: float
    high: float
    below: str = "another unit"
    above: str = "another unit"


_GUN = (
    Limit("tank_volume_m3", 1e-6, 2.0, above="litres"),
    Limit("bore_diameter_m", 1e-3, 1.0, above="millimetres"),
    Limit("projectile_diameter_m", 1e-3, 1.0, above="millimetres"),
    Limit("travel_m", 0.01, 30.0, above="millimetres"),
)
_HAMMER = Limit("mass_kg", 1e-3, 50.0, below="tonnes", above="grams")
_PLATE = Limit("thickness_m", 1e-4, 0.5, above="millimetres")
_DAMPING = Limit("damping_ratio", 0.0, 0.2, above="per cent")
_FREQUENCY = Limit("frequency_hz", 20.0, 1e6, below="kilohertz")
_RADIUS = Limit("tip_radius_mm", 2e-4, 20.0, below="metres", above="micrometres")
_MASS = Limit("bullet_mass_kg", 1e-4, 50.0, below="tonnes", above="grams")
_PRESSURE = Limit("tank_pressure_pa", 100.0, 1e8, above="pascals, in a column of bar")
_TRAVEL = Limit("travel_m of a run", 0.01, 30.0, below="metres, in a column of millimetres", above="millimetres")
_VELOCITY = Limit("velocity_m_s", 1e-4, 2000.0, below="km/s", above="mm/s or cm/s")
_RATE = Limit("sampling rate of the force", 1e3, 1e9, below="kilohertz", above="another unit")


def setting_findings(record: CampaignRecord) -> list[Finding]:
    """A refusal for each setting that is out of bounds, with the first value that is."""
    found: dict[str, Finding] = {}
    for limit, value in _settings(record):
        if limit.low <= value <= limit.high or limit.setting in found:
            continue
        unit = limit.below if value < limit.low else limit.above
        message = (
            f"{limit.setting} is {value:.4g}, and a bench has {limit.low:g} to {limit.high:g} in SI: is it in {unit}? "
            "correct it where it stands in the campaign's folder"
        )
        found[limit.setting] = Finding("refuse", limit.setting, message)
    return list(found.values())


def _settings(record: CampaignRecord) -> Iterator[tuple[Limit, float]]:
    if record.gun is not None:
        yield from ((limit, float(getattr(record.gun, limit.setting))) for limit in _GUN)
    if record.hammer_mass_kg is not None:
        yield _HAMMER, record.hammer_mass_kg
    yield _PLATE, record.plate_thickness_m
    if record.plate is not None and record.plate.frequency_hz.size:
        yield _DAMPING, float(sorted(record.plate.damping_ratio)[record.plate.damping_ratio.size // 2])
        yield _FREQUENCY, float(record.plate.frequency_hz.max())
    for each in record.configurations:
        radius = each.factors.get("tip_radius")
        if isinstance(radius, float):
            yield _RADIUS, radius
    for run in record.runs:
        if run.bullet_mass_kg is not None:
            yield _MASS, run.bullet_mass_kg
        if run.tank_pressure_pa is not None:
            yield _PRESSURE, run.tank_pressure_pa
        if run.travel_m is not None:
            yield _TRAVEL, run.travel_m
        if run.velocity_m_s:
            yield _VELOCITY, run.velocity_m_s
        if run.force is not None:
            yield _RATE, run.force.sampling_rate_hz
