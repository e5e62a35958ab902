"""Wrong units and impossible settings are told from physics: refused or named, and silent on what
is right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.plausibility import (
    ImplausibleRecordError,
    LikelyMistake,
    check,
    implausible,
)
from pyroshock.diagnosis.plausibility.channels import setting_findings
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.contact.effects.effective_mass import EffectiveMass
from pyroshock.twin.contact.effects.layer_compliance import LayerCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.effects import Effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.effects.blow_by import BlowBy
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.nominal import muzzle_velocity
from pyroshock.twin.gun.shots import gun_velocity
from support.records.contact_campaigns import hammer_record
from support.records.plate_folders import plate_record, small_plate

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
MASSES_KG, PRESSURES_PA = (0.25, 0.5, 1.0), (0.6e5, 1.2e5, 2.4e5, 4.8e5)


def gun_record(
    factor: float = 0.98, *, pressure: Callable[[float], float] = lambda p: p
) -> CampaignRecord:
    """Shots at `factor` times the nominal velocity, 1 % scatter; `pressure` is what is written of
    the true one."""
    rng = np.random.default_rng(5)
    settings = [(p, m) for p in PRESSURES_PA for m in MASSES_KG]
    configurations = [
        RunConfiguration(f"{p} Pa {m} kg", {"tank_pressure": p, "bullet_mass": m})
        for p, m in settings
    ]
    runs = []
    for order in range(2 * len(settings)):
        p, m = settings[order // 2]
        velocity = float(muzzle_velocity(BENCH, p, m)) * factor * (1 + 0.01 * rng.standard_normal())
        runs.append(
            Run(
                order // 2,
                order + 1,
                order % 2 + 1,
                order,
                pressure(p),
                m,
                velocity,
                0.01 * velocity,
            )
        )
    return CampaignRecord("shots", "gun", tuple(configurations), tuple(runs), gun=BENCH)


def with_runs(record: CampaignRecord, change: Callable[[Run], Run]) -> CampaignRecord:
    return replace(record, runs=tuple(change(run) for run in record.runs))


def with_velocity(record: CampaignRecord, factor: float) -> CampaignRecord:
    return with_runs(
        record, lambda run: replace(run, velocity_m_s=(run.velocity_m_s or 0.0) * factor)
    )


def with_force(record: CampaignRecord, factor: float) -> CampaignRecord:
    def change(run: Run) -> Run:
        return replace(run, force=replace(run.force, values=run.force.values * factor))

    return with_runs(record, change)


def of_gun(record: CampaignRecord) -> tuple[LikelyMistake, ...]:
    return implausible(record, [GunObservables(record)])


def of_contact(record: CampaignRecord) -> tuple[LikelyMistake, ...]:
    return implausible(record, [ContactObservables(record)])


@pytest.mark.parametrize("factor", [1.0, 0.95, 0.75, 0.55])
def test_a_gun_that_is_slower_than_nominal_is_left_alone(factor: float) -> None:
    assert of_gun(gun_record(factor)) == ()


@pytest.mark.parametrize("effect", [BlowBy(), ValveFlow()])
def test_missing_physics_of_the_gun_is_no_mistake(effect: Effect) -> None:
    record = gun_record(1.0)
    pressure = np.array([run.tank_pressure_pa for run in record.runs])
    mass = np.array([run.bullet_mass_kg for run in record.runs])
    fired = gun_velocity(BENCH, pressure, mass, [effect]).velocity_m_s
    runs = tuple(
        replace(run, velocity_m_s=float(v)) for run, v in zip(record.runs, fired, strict=True)
    )
    assert of_gun(replace(record, runs=runs)) == ()


#: What is found where values of a channel are written times a factor.
WRITTEN_TIMES: dict[str, Callable[[float], tuple[LikelyMistake, ...]]] = {
    "velocity of the gun": lambda factor: of_gun(with_velocity(gun_record(), factor)),
    "tank_pressure": lambda factor: of_gun(gun_record(pressure=lambda p: p * factor)),
    "force": lambda factor: of_contact(with_force(hammer_record(noise=0.002), factor)),
    "velocity of the hammer": lambda factor: of_contact(
        with_velocity(hammer_record(noise=0.002), factor)
    ),
}


@pytest.mark.parametrize(
    ("channel", "factor", "unit"),
    [
        *(("velocity of the gun", factor, "km/h") for factor in (3.6, 1 / 3.6)),
        *(("velocity of the gun", factor, "ft/s") for factor in (1 / 0.3048, 0.3048)),
        ("velocity of the gun", 1e-3, "mm/s"),
        ("tank_pressure", 14.503774, "values in psi where bar is declared"),
        ("tank_pressure", 100.0, "values in kPa where bar is declared"),
        ("tank_pressure", 0.1, "values in MPa where bar is declared"),
        *(
            ("force", 1e3, "kN"),
            ("force", 1e-3, "kN"),
            ("force", 4.4482, "lbf"),
            ("force", 1 / 4.4482, "lbf"),
        ),
        *(("force", 9.80665, "kgf"), ("force", 10, "gain")),
        *(
            ("velocity of the hammer", factor, unit)
            for factor, unit in ((3.6, "km/h"), (0.3048, "ft/s"), (100.0, "cm/s"))
        ),
    ],
)
def test_values_in_another_unit_are_refused(channel: str, factor: float, unit: str) -> None:
    (finding,) = WRITTEN_TIMES[channel](factor)
    assert finding.severity == "refuse"
    assert unit in finding.message
    if channel != "velocity of the gun":  # which may as well be that of its pressures
        assert finding.channel == channel.removesuffix(" of the hammer")


def test_what_may_be_physics_is_only_named() -> None:
    (finding,) = of_gun(gun_record(0.99, pressure=lambda p: p + 101_325.0))
    assert (finding.severity, finding.channel) == ("name", "tank_pressure")
    assert "absolute" in finding.message
    # A factor of two is physics as well.
    (finding,) = of_gun(with_velocity(gun_record(), 2.237))
    assert finding.severity == "name"
    record = gun_record(0.99, pressure=lambda p: p + 101_325.0)
    assert [finding.severity for finding in check(record, [GunObservables(record)])] == ["name"]


@pytest.mark.parametrize(
    "effects", [(), (EffectiveMass(1.3),), (ViscousLoss(0.5),), (LayerCompliance(1e-7),)]
)
def test_missing_physics_of_the_contact_is_no_mistake(effects: tuple[Effect, ...]) -> None:
    assert of_contact(hammer_record(effects, noise=0.002)) == ()


def test_a_rate_in_kilohertz_is_told_by_the_pulse() -> None:
    def change(run: Run) -> Run:
        rate, start = run.force.sampling_rate_hz, run.force.start_s
        return replace(
            run, force=replace(run.force, sampling_rate_hz=rate * 1e3, start_s=start / 1e3)
        )

    (finding,) = of_contact(with_runs(hammer_record(), change))
    assert (finding.severity, finding.channel) == ("refuse", "sampling rate")
    (finding,) = of_contact(with_force(hammer_record((EffectiveMass(1.3),)), 1 / 9.80665))
    assert finding.channel == "force"
    assert "kgf" in finding.message


def test_check_raises_one_line_that_says_what_to_do() -> None:
    record = with_force(hammer_record(), 1e3)
    with pytest.raises(ImplausibleRecordError) as raised:
        check(record, [ContactObservables(record)])
    assert "\n" not in str(raised.value)
    assert "'strikes': force is 1e+03 times what the contact can give" in str(raised.value)
    assert "campaign.toml" in str(raised.value)


RUN = Run(0, 1, 1, 0, 0.6e5, 0.5, 12.0)
RECORD = CampaignRecord(
    "shots", "gun", (RunConfiguration("c", {"tip_radius": 0.03}),), (RUN,), gun=BENCH
)


def test_a_bench_as_it_is_has_none() -> None:
    assert setting_findings(RECORD) == []
    assert setting_findings(plate_record()) == []


@pytest.mark.parametrize(
    ("record", "setting", "unit"),
    [
        (replace(RECORD, runs=(replace(RUN, bullet_mass_kg=500.0),)), "bullet_mass_kg", "grams"),
        (
            replace(RECORD, runs=(replace(RUN, tank_pressure_pa=0.6e10),)),
            "tank_pressure_pa",
            "pascals",
        ),
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
        (
            replace(RECORD, configurations=(RunConfiguration("c", {"tip_radius": 3e-5}),)),
            "tip_radius_mm",
            "metres",
        ),
        (
            replace(
                RECORD, plate=replace(small_plate(), damping_ratio=small_plate().damping_ratio * 50)
            ),
            "damping_ratio",
            "per cent",
        ),
        (
            replace(
                RECORD, plate=replace(small_plate(), frequency_hz=small_plate().frequency_hz / 1e3)
            ),
            "frequency_hz",
            "kilohertz",
        ),
    ],
)
def test_a_number_in_another_unit_is_refused_by_name(
    record: CampaignRecord, setting: str, unit: str
) -> None:
    (finding,) = setting_findings(record)
    assert (finding.severity, finding.channel) == ("refuse", setting)
    assert f"is it in {unit}" in finding.message
