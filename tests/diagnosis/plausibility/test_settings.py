"""Settings that no bench has are another unit's."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.diagnosis.plausibility.channels import setting_findings
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.gun.bench import GunBench
from support.records.plate_folders import plate_record, small_plate

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
RUN = Run(0, 1, 1, 0, 0.6e5, 0.5, 12.0)
RECORD = CampaignRecord("shots", "gun", (RunConfiguration("c", {"tip_radius": 0.03}),), (RUN,), gun=BENCH)


def test_a_bench_as_it_is_has_none() -> None:
    assert setting_findings(RECORD) == []
    assert setting_findings(plate_record()) == []


@pytest.mark.parametrize(
    ("record", "setting", "unit"),
    [
        (replace(RECORD, runs=(replace(RUN, bullet_mass_kg=500.0),)), "bullet_mass_kg", "grams"),
        (replace(RECORD, runs=(replace(RUN, tank_pressure_pa=0.6e10),)), "tank_pressure_pa", "pascals"),
        (
            replace(RECORD, runs=(replace(RUN, velocity_m_s=12e3),)),
            "velocity_m_s",
            "mm/s or cm/s",
        ),
        (replace(RECORD, gun=replace(BENCH, tank_volume_m3=9.5)), "tank_volume_m3", "litres"),
        (replace(RECORD, gun=replace(BENCH, travel_m=885.0)), "travel_m", "millimetres"),
        (replace(RECORD, runs=(replace(RUN, travel_m=885.0),)), "travel_m of a run", "millimetres"),
        (replace(RECORD, hammer_mass_kg=320.0), "mass_kg", "grams"),
        (replace(RECORD, plate_thickness_m=10.0), "thickness_m", "millimetres"),
        (replace(RECORD, configurations=(RunConfiguration("c", {"tip_radius": 3e-5}),)), "tip_radius_mm", "metres"),
        (
            replace(RECORD, plate=replace(small_plate(), damping_ratio=small_plate().damping_ratio * 50)),
            "damping_ratio",
            "per cent",
        ),
        (
            replace(RECORD, plate=replace(small_plate(), frequency_hz=small_plate().frequency_hz / 1e3)),
            "frequency_hz",
            "kilohertz",
        ),
    ],
)
def test_a_number_in_another_unit_is_refused_by_name(record: CampaignRecord, setting: str, unit: str) -> None:
    (finding,) = setting_findings(record)
    assert (finding.severity, finding.channel) == ("refuse", setting)
    assert f"is it in {unit}" in finding.message
