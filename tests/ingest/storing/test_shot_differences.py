"""Rows of runs.csv against the recordings of their shots: factors, offsets, single shots, and right
campaigns."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.extraction.gunshot import measure_shot
from pyroshock.ingest.extraction.shot_plausibility import ValuePair, pressure_pair, velocity_pair
from pyroshock.ingest.folder.unit_mistakes import unit_mistakes
from pyroshock.ingest.storing.shot_differences import CommonDifference, common_difference
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.virtualbench.campaigns.gun import BULLET_LENGTH_M, LASER, SETTING_SPREAD, TANK
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import Trigger, fire, shot_signals
from pyroshock.virtualbench.sensors import record
from pyroshock.virtualbench.sensors.filters import gain, offset_si
from support.records.campaigns import gun_rows, write_recording, write_runs
from support.stores.stores import ingest, pyroshock

RATE_HZ = 2.5e4


def velocities(factor: float, *, seed: int = 0, shots: int = 12) -> list[ValuePair]:
    rng = np.random.default_rng(seed)
    read_m_s = rng.uniform(8, 60, shots)
    row = factor * read_m_s * (1 + 0.005 * rng.standard_normal(shots))
    return [
        velocity_pair(a, 0.003 * a, b, 0.004 * b, 0.085) for a, b in zip(row, read_m_s, strict=True)
    ]


def pressures(
    factor: float, offset_pa: float = 0.0, *, seed: int = 0, shots: int = 12
) -> list[ValuePair]:
    rng = np.random.default_rng(seed)
    read_pa = rng.uniform(0.5e5, 6e5, shots)
    row = factor * read_pa * (1 + 0.003 * rng.standard_normal(shots)) + offset_pa
    return [pressure_pair(a, b, 0.002 * b) for a, b in zip(row, read_pa, strict=True)]


@pytest.mark.parametrize("factor", [0.5, 0.8, 0.9, 1.1, 1.2, 2.0])
def test_a_common_factor_lies_in_its_interval(factor: float) -> None:
    for make, with_offset in ((velocities, False), (pressures, True)):
        common = common_difference(make(factor), with_offset=with_offset)
        assert common is not None
        assert common.offset is None
        assert common.low < factor < common.high
        assert common.high / common.low < 1.04


@pytest.mark.parametrize("factor", [1.0, 0.97, 1.03])
def test_what_gauges_differ_by_is_no_finding(factor: float) -> None:
    for seed in range(20):
        assert common_difference(velocities(factor, seed=seed)) is None
        assert common_difference(pressures(factor, seed=seed), with_offset=True) is None


@pytest.mark.parametrize("offset_pa", [101_325.0, -40_000.0, 30_000.0])
def test_a_constant_is_told_from_a_factor(offset_pa: float) -> None:
    common = common_difference(pressures(1.0, offset_pa), with_offset=True)
    assert common is not None
    assert common.offset == pytest.approx(offset_pa, abs=3 * common.offset_u)


def test_shots_that_differ_each_in_its_own_way_have_nothing_in_common() -> None:
    rng = np.random.default_rng(1)
    wrong = [
        velocity_pair(b * f, None, b, 0.004 * b, None)
        for b, f in zip(rng.uniform(8, 60, 12), rng.uniform(0.3, 3, 12), strict=True)
    ]
    assert common_difference(wrong) is None
    assert common_difference(velocities(1.2, shots=2)) is None
    few = velocities(1.0)[:9] + velocities(1.2)[:3]
    assert common_difference(few) is None


def test_a_pair_differs_beyond_its_uncertainties_and_the_share() -> None:
    assert not velocity_pair(21.0, 0.1, 20.0, 0.1, None).differs()
    assert velocity_pair(21.6, 0.1, 20.0, 0.1, None).differs()
    assert not velocity_pair(23.0, 0.5, 20.0, 0.5, None).differs()
    assert not pressure_pair(3.5e4, 3.2e4, 100.0).differs()
    assert pressure_pair(4.2e4, 3.2e4, 100.0).differs()
    assert math.isclose(
        {words: factor for factor, words in unit_mistakes("velocity")}[
            "values in km/h where m/s is declared"
        ],
        3.6,
    )


# --- through an ingest ---

VELOCITY_M_S, LENGTH_M = 17.0, 0.085


def signals(bar: float, velocity_m_s: float) -> dict[str, np.ndarray]:
    """Laser (V) and tank pressure (bar) of a shot at 25 kHz: 0.5 s, the valve opens after 0.2 s."""
    time = np.arange(round(0.5 * RATE_HZ)) / RATE_HZ
    noise = np.random.default_rng(round(100 * bar)).standard_normal((2, time.size))
    pressure = bar * np.exp(-np.maximum(time - 0.2, 0) / 0.05) + 1e-3 * noise[0]
    edges = (0.3, 0.3 + LENGTH_M / velocity_m_s)
    entered, left = (np.clip((time - edge) * RATE_HZ + 0.5, 0, 1) for edge in edges)
    blocked = entered - left
    return {
        "tank_pressure": pressure.astype(np.float32),
        "laser": (5.0 - 4.8 * blocked + 0.002 * noise[1]).astype(np.float32),
    }


@pytest.fixture
def shots(gun_folder: Path):
    """`shots(velocity_factor, pressure_factor, offset_bar)`: a folder of six shots whose rows are
    off by these."""
    toml = (gun_folder / "campaign.toml").read_text(encoding="utf-8")
    channels = """
[channels.tank_pressure]
quantity = "pressure"
unit = "bar"

[channels.laser]
quantity = "voltage"
unit = "V"
position = "muzzle"
"""
    assert "[channels.laser]" not in toml

    def make(
        velocity: float = 1.0,
        pressure: float = 1.0,
        offset_bar: float = 0.0,
        plate: float | None = None,
    ) -> Path:
        kept = toml.split("[channels.")[0]
        (gun_folder / "campaign.toml").write_text(kept + channels, encoding="utf-8")
        rows: list[dict[str, object]] = [dict(row) for row in gun_rows(6)]
        for number, row in enumerate(rows):
            bar, speed = 0.5 + 0.4 * number, VELOCITY_M_S + 4 * number
            write_recording(gun_folder / f"{number}.npz", signals(bar, speed), RATE_HZ)
            row |= {
                "recording": f"{number}.npz",
                "bullet_length_mm": 1e3 * LENGTH_M,
                "bullet_length_u_mm": 0.5,
            }
            row |= {
                "measured_velocity_m_s": speed * velocity,
                "tank_pressure_bar": bar * pressure + offset_bar,
            }
            if plate is not None:
                row["impact_velocity_m_s"] = speed * plate
        write_runs(gun_folder, rows)
        return gun_folder

    return make


def told(url: str, folder: Path) -> tuple[str, list[str]]:
    """What the ingest prints, and the sentences of `campaigns show`."""
    result = ingest(url, folder)
    assert result.exit_code == 0, result.output
    page = json.loads(pyroshock("campaigns", "show", "gun", "--db", url, "--json").stdout)
    return result.output, page["shot_differences"]


def test_rows_that_are_right_give_no_finding(sqlite_url, shots) -> None:
    output, sentences = told(sqlite_url, shots())
    assert "differs" not in output
    assert sentences == []


def test_velocities_a_fifth_too_high_are_one_finding_with_the_bullet_length(
    sqlite_url, shots
) -> None:
    output, (sentence,) = told(sqlite_url, shots(velocity=1.2))
    assert output.count("velocity-differs-throughout") == 1
    assert "warning: velocity-differs (6) of laser" in output
    assert "1.2 times the laser's" in sentence
    length = re.search(r"the bullet is ([\d.]+) mm long, where bullet_length_mm is 85", sentence)
    assert length is not None
    assert float(length[1]) == pytest.approx(102, abs=0.5)
    assert "Datasets and the diagnosis use the velocity of runs.csv" in sentence
    assert sentence in pyroshock("campaigns", "show", "gun", "--db", sqlite_url).stdout


def test_kilometres_per_hour_and_a_tenth_of_pressure_are_named(sqlite_url, shots) -> None:
    _, (velocity, pressure) = told(sqlite_url, shots(velocity=3.6, pressure=1.1))
    assert "values in km/h where m/s is declared" in velocity
    assert "1.1 times the recorded ones" in pressure
    assert "sensitivity of the transducer" in pressure


def test_velocities_at_the_plate_may_differ_and_their_unit_may_not(sqlite_url, shots) -> None:
    _, sentences = told(sqlite_url, shots(plate=1.25))
    assert sentences == []


def test_velocities_at_the_plate_in_another_unit_are_named(sqlite_url, shots) -> None:
    _, (sentence,) = told(sqlite_url, shots(plate=3.3))
    assert "(impact_velocity_m_s) are 3.3 times" in sentence
    assert "values in km/h where m/s is declared" in sentence


def test_absolute_pressures_are_named_as_such(sqlite_url, shots) -> None:
    _, (sentence,) = told(sqlite_url, shots(offset_bar=1.01325))
    assert "one atmosphere: those of runs.csv are absolute" in sentence
    assert "the diagnosis uses the recorded pressure" in sentence


# --- campaigns of the virtual gun that are right ---


def virtual_pairs(rng: np.random.Generator, shots: int) -> tuple[list[ValuePair], list[ValuePair]]:
    """Velocities that the lab measured to 1 % at the vents, and set pressures, against recordings
    of virtual shots."""
    effects = Effects.default()
    for name in (
        "sensor.pressure_gain",
        "sensor.pressure_offset",
        "sensor.velocity_gain",
        "bench.hand_scatter",
    ):
        effects = effects.with_strength(name, float(rng.uniform(0, 2)))
    for name in ("gun.valve_flow", "gun.blow_by", "gun.sliding_friction", "bench.noise"):
        effects = effects.with_strength(name, float(rng.uniform(0.5, 1.5)))
    of_velocity, of_pressure = [], []
    for _ in range(shots):
        set_pa = float(rng.uniform(0.3e5, 7e5))
        read_pa = set_pa * (
            1 + SETTING_SPREAD * effects["bench.hand_scatter"] * rng.standard_normal()
        )
        true_pa = (read_pa - offset_si(TANK, effects, 0.0)) / gain(TANK, effects, 0.0)
        bullet = Projectile(float(rng.choice([0.1428, 0.5])), BULLET_LENGTH_M)
        truth = fire(GunBuild(), effects, true_pa, bullet, rng, until_s=1.6)
        fine = shot_signals(truth, bullet, RATE_HZ, 0.7, Trigger())
        time = np.arange(fine["laser"].size) / RATE_HZ
        volts = {
            s.name: record(time, fine[s.name], s, RATE_HZ, effects, rng) for s in (TANK, LASER)
        }
        channels = [
            Channel(
                Sensor(
                    "tank_pressure",
                    "pressure",
                    "bar",
                    sensitivity=TANK.sensitivity,
                    offset_v=TANK.offset_v,
                ),
                volts["tank_pressure"],
                RATE_HZ,
            ),
            Channel(
                Sensor(
                    "laser",
                    "displacement",
                    "mm",
                    sensitivity=LASER.sensitivity,
                    offset_v=LASER.offset_v,
                    position="muzzle",
                ),
                volts["laser"],
                RATE_HZ,
            ),
        ]
        shot, _ = measure_shot(channels, BULLET_LENGTH_M, 0.5e-3)
        assert shot is not None
        if shot.velocity_m_s is not None:
            lab = truth.muzzle_velocity_m_s * (1 + 0.01 * rng.standard_normal())
            of_velocity.append(
                velocity_pair(
                    lab, 0.01 * lab, shot.velocity_m_s, shot.velocity_u_m_s, BULLET_LENGTH_M
                )
            )
        if shot.tank_pressure_pa is not None:
            of_pressure.append(
                pressure_pair(set_pa, shot.tank_pressure_pa, shot.tank_pressure_u_pa)
            )
    return of_velocity, of_pressure


def found(
    pairs: tuple[list[ValuePair], list[ValuePair]],
) -> tuple[CommonDifference | None, CommonDifference | None, int]:
    of_velocity, of_pressure = pairs
    single = sum(pair.differs() for pair in (*of_velocity, *of_pressure))
    return common_difference(of_velocity), common_difference(of_pressure, with_offset=True), single


def test_right_virtual_campaigns_give_no_finding() -> None:
    for seed in range(4):
        pairs = virtual_pairs(np.random.default_rng(seed), 5)
        assert len(pairs[1]) == 5
        assert found(pairs) == (None, None, 0)


@pytest.mark.slow
def test_sixty_right_virtual_campaigns_give_no_finding() -> None:
    for seed in range(100, 160):
        assert found(virtual_pairs(np.random.default_rng(seed), 5)) == (None, None, 0)
