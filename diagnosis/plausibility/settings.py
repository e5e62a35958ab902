"""Settings of bench and runs that no bench of this kind has: a number in another unit than its column's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ..record import CampaignRecord
from .unit_factors import LikelyMistake


class _Limit(NamedTuple):
    """Beyond `low` or `high` (SI) a setting is another unit's; the words say which to look for."""

    low: float
    high: float
    below: str = "another unit"
    above: str = "another unit"


_GUN = {
    "tank_volume_m3": _Limit(1e-6, 2.0, above="litres"),
    "bore_diameter_m": _Limit(1e-3, 1.0, above="millimetres"),
    "projectile_diameter_m": _Limit(1e-3, 1.0, above="millimetres"),
    "travel_m": _Limit(0.01, 30.0, above="millimetres"),
}
_LIMITS = {
    **_GUN,
    "mass_kg": _Limit(1e-3, 50.0, below="tonnes", above="grams"),
    "thickness_m": _Limit(1e-4, 0.5, above="millimetres"),
    "damping_ratio": _Limit(0.0, 0.2, above="per cent"),
    "frequency_hz": _Limit(20.0, 1e6, below="kilohertz"),
    "tip_radius_mm": _Limit(2e-4, 20.0, below="metres", above="micrometres"),
    "bullet_mass_kg": _Limit(1e-4, 50.0, below="tonnes", above="grams"),
    "tank_pressure_pa": _Limit(100.0, 1e8, above="pascals, in a column of bar"),
    "travel_m of a run": _Limit(0.01, 30.0, below="metres, in a column of millimetres", above="millimetres"),
    "velocity_m_s": _Limit(1e-4, 2000.0, below="km/s", above="mm/s or cm/s"),
    "sampling rate of the force": _Limit(1e3, 1e9, below="kilohertz"),
}


def setting_findings(record: CampaignRecord) -> list[LikelyMistake]:
    """A refusal for each setting that is out of bounds, with the first value that is."""
    findings: dict[str, LikelyMistake] = {}
    for setting, value in _settings(record):
        limit = _LIMITS[setting]
        if value is None or limit.low <= value <= limit.high:
            continue
        unit = limit.below if value < limit.low else limit.above
        message = (
            f"{setting} is {value:.4g}, and a bench has {limit.low:g} to {limit.high:g} in SI: is it in {unit}? "
            "correct it where it stands in the campaign's folder"
        )
        findings.setdefault(setting, LikelyMistake("refuse", setting, message))
    return list(findings.values())


def _settings(record: CampaignRecord) -> Iterator[tuple[str, float | None]]:
    if record.gun is not None:
        yield from ((setting, float(getattr(record.gun, setting))) for setting in _GUN)
    yield "mass_kg", record.hammer_mass_kg
    yield "thickness_m", record.plate_thickness_m
    if record.plate is not None and record.plate.frequency_hz.size:
        yield "damping_ratio", float(sorted(record.plate.damping_ratio)[record.plate.damping_ratio.size // 2])
        yield "frequency_hz", float(record.plate.frequency_hz.max())
    radii = (configuration.factors.get("tip_radius") for configuration in record.configurations)
    yield from (("tip_radius_mm", radius) for radius in radii if isinstance(radius, float))
    for run in record.runs:
        yield "bullet_mass_kg", run.bullet_mass_kg
        yield "tank_pressure_pa", run.tank_pressure_pa
        yield "travel_m of a run", run.travel_m
        yield "velocity_m_s", run.velocity_m_s or None
        yield "sampling rate of the force", None if run.force is None else run.force.sampling_rate_hz
