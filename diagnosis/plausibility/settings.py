"""Settings of bench and runs that no bench of this kind has: a number in another unit than its column's."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from ..record import CampaignRecord
from .unit_factors import Finding


class _Limit(NamedTuple):
    """Beyond `low` or `high` (SI) a setting is another unit's; the words say which to look for."""

    setting: str
    low: float
    high: float
    below: str = "another unit"
    above: str = "another unit"


_GUN = (
    _Limit("tank_volume_m3", 1e-6, 2.0, above="litres"),
    _Limit("bore_diameter_m", 1e-3, 1.0, above="millimetres"),
    _Limit("projectile_diameter_m", 1e-3, 1.0, above="millimetres"),
    _Limit("travel_m", 0.01, 30.0, above="millimetres"),
)
_HAMMER = _Limit("mass_kg", 1e-3, 50.0, below="tonnes", above="grams")
_PLATE = _Limit("thickness_m", 1e-4, 0.5, above="millimetres")
_DAMPING = _Limit("damping_ratio", 0.0, 0.2, above="per cent")
_FREQUENCY = _Limit("frequency_hz", 20.0, 1e6, below="kilohertz")
_RADIUS = _Limit("tip_radius_mm", 2e-4, 20.0, below="metres", above="micrometres")
_RUN = (
    _Limit("bullet_mass_kg", 1e-4, 50.0, below="tonnes", above="grams"),
    _Limit("tank_pressure_pa", 100.0, 1e8, above="pascals, in a column of bar"),
    _Limit("travel_m of a run", 0.01, 30.0, below="metres, in a column of millimetres", above="millimetres"),
    _Limit("velocity_m_s", 1e-4, 2000.0, below="km/s", above="mm/s or cm/s"),
    _Limit("sampling rate of the force", 1e3, 1e9, below="kilohertz", above="another unit"),
)


def setting_findings(record: CampaignRecord) -> list[Finding]:
    """A refusal for each setting that is out of bounds, with the first value that is."""
    findings: dict[str, Finding] = {}
    for limit, value in _settings(record):
        if limit.low <= value <= limit.high or limit.setting in findings:
            continue
        unit = limit.below if value < limit.low else limit.above
        message = (
            f"{limit.setting} is {value:.4g}, and a bench has {limit.low:g} to {limit.high:g} in SI: is it in {unit}? "
            "correct it where it stands in the campaign's folder"
        )
        findings[limit.setting] = Finding("refuse", limit.setting, message)
    return list(findings.values())


def _settings(record: CampaignRecord) -> Iterator[tuple[_Limit, float]]:
    if record.gun is not None:
        yield from ((limit, float(getattr(record.gun, limit.setting))) for limit in _GUN)
    if record.hammer_mass_kg is not None:
        yield _HAMMER, record.hammer_mass_kg
    yield _PLATE, record.plate_thickness_m
    if record.plate is not None and record.plate.frequency_hz.size:
        yield _DAMPING, float(sorted(record.plate.damping_ratio)[record.plate.damping_ratio.size // 2])
        yield _FREQUENCY, float(record.plate.frequency_hz.max())
    radii = (configuration.factors.get("tip_radius") for configuration in record.configurations)
    yield from ((_RADIUS, radius) for radius in radii if isinstance(radius, float))
    for run in record.runs:
        rate = None if run.force is None else run.force.sampling_rate_hz
        values = (run.bullet_mass_kg, run.tank_pressure_pa, run.travel_m, run.velocity_m_s or None, rate)
        yield from ((limit, value) for limit, value in zip(_RUN, values, strict=True) if value is not None)
