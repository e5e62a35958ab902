"""Recordings of withheld guns: tank pressure and laser say what the law and the row say."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.extraction.velocity import muzzle_velocity
from pyroshock.validation.case_plan import case_of_task, tasks
from pyroshock.validation.cases import record_case
from pyroshock.validation.cases.case import GUN_AND_CONTACT, BackgroundGap, Case
from pyroshock.validation.cases.designs import design
from pyroshock.validation.cases.gun_case import ln_velocity, true_pressure_pa
from pyroshock.validation.cases.gun_trace import NOISE_BAR, Recorder, followed_shots
from pyroshock.virtualbench.campaigns.gun import BULLET_LENGTH_M, BULLET_LENGTH_U_M, TANK
from pyroshock.virtualbench.recorder import folder_hash
from pyroshock.virtualbench.sensors.chain import calibrated

QUIET = BackgroundGap(1e-9, 1e-9, 2.0, False, 5)
STRENGTHS = {
    "gun.valve_flow": 0.4,
    "gun.blow_by": 0.3,
    "sensor.pressure_gain": 0.05,
    "sensor.pressure_offset": 0.03,
    "sensor.velocity_gain": 0.05,
}
LAWS = ("", "development", "calibration", "sealed")


def gun_case(laws: str, **changes: object) -> Case:
    case = Case("gun", "any", 1, 3, 0.7, QUIET, STRENGTHS, laws=laws, traces=True)
    return replace(case, **changes)


def recorded(case: Case, folder: Path) -> tuple[list[dict[str, str]], list[dict[str, np.ndarray]]]:
    record_case(case, folder, 1)
    with (folder / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    return rows, [dict(np.load(folder / row["recording"])) for row in rows]


@pytest.mark.parametrize("laws", LAWS)
def test_laser_velocity_is_that_of_the_row_and_of_the_law(laws: str, tmp_path: Path) -> None:
    case = gun_case(laws)
    rows, records = recorded(case, tmp_path / "c")
    law = dict(
        zip(configurations(case), np.exp(ln_velocity("gun", 1, STRENGTHS, laws)), strict=True)
    )
    relative_error = []
    for row, record in zip(rows, records, strict=True):
        assert float(row["bullet_length_mm"]) == 1e3 * BULLET_LENGTH_M
        by_laser = muzzle_velocity(
            record["laser"], float(record["fs"]), BULLET_LENGTH_M, length_u_m=BULLET_LENGTH_U_M
        )
        own, own_u = float(row["measured_velocity_m_s"]), float(row["measured_velocity_u_m_s"])
        assert by_laser.velocity_m_s == pytest.approx(
            own, abs=4 * math.hypot(own_u, by_laser.velocity_u_m_s)
        )
        key = row["tank_pressure_bar"], row["bullet_mass_kg"]
        relative_error.append(math.log(by_laser.velocity_m_s / law[key]))
    spread = case.floor * 0.01 * case.repetitions**0.5
    assert abs(float(np.mean(relative_error))) < 4 * spread / len(relative_error) ** 0.5
    assert float(np.std(relative_error)) < 2 * spread


def configurations(case: Case) -> list[tuple[str, str]]:
    """Pressure and mass as runs.csv has them: what the regulator is set to."""
    return [
        (str(float(f"{1e-5 * true_pressure_pa(s, case.strengths, case.laws):.5g}")), str(s.mass_kg))
        for s in design(case.kind, case.design)
    ]


@pytest.mark.parametrize("laws", LAWS)
def test_transducer_reads_the_plan_at_rest_and_the_law_until_the_end(
    laws: str, tmp_path: Path
) -> None:
    """Gain and offset act on what is recorded: the plan's pressure at rest, the offset in an empty
    tank."""
    case = gun_case(laws)
    rows, records = recorded(case, tmp_path / "c")
    recorder, shots, plan = Recorder.of(case), followed_shots(case), design("gun", 1)
    keys = configurations(case)
    ratio = []
    for row, record in zip(rows, records, strict=True):
        read_bar = calibrated(record["tank_pressure"], TANK) / 1e5
        rate = float(record["fs"])
        c = keys.index((row["tank_pressure_bar"], row["bullet_mass_kg"]))
        rest_bar = read_bar[: int(recorder.rest_s * rate)]
        assert rest_bar.std() == pytest.approx(NOISE_BAR, rel=0.1)
        ratio.append(float(rest_bar.mean()) / plan[c].tank_pressure_bar)
        assert read_bar.size / rate > recorder.rest_s + shots[c].exit_s + 0.05
        smooth = np.convolve(read_bar, np.ones(50) / 50, mode="valid")
        assert smooth.max() < rest_bar.mean() + 6 * NOISE_BAR / 50**0.5
    assert float(np.mean(ratio)) == pytest.approx(1.0, abs=4 * 0.004 / len(ratio) ** 0.5 + 5e-4)


@pytest.mark.parametrize("seed", range(20, 24))
def test_recorders_differ_by_case_and_a_valve_closes_after_the_slowest_shot(seed: int) -> None:
    case = gun_case("development", background=replace(QUIET, seed=seed))
    recorder, shots = Recorder.of(case), followed_shots(case)
    assert recorder != Recorder.of(gun_case("development"))
    assert recorder.closes_after > 1
    last = max(shot.tank_pressure_pa[-1] / shot.tank_pressure_pa[0] for shot in shots)
    assert (last > 0.01) == math.isfinite(recorder.closes_after)
    speeds = np.array([shot.muzzle_velocity_m_s for shot in shots])
    gain = {name: value for name, value in STRENGTHS.items() if name != "sensor.velocity_gain"}
    np.testing.assert_allclose(
        np.log(speeds), ln_velocity("gun", 1, gain, "development"), atol=1e-9
    )


def test_velocities_are_the_same_without_the_recordings_and_bytes_for_the_same_seed(
    tmp_path: Path,
) -> None:
    rows, _ = recorded(gun_case("development"), tmp_path / "a")
    plain = record_case(gun_case("development", traces=False), tmp_path / "b", 1)
    with (tmp_path / "b" / "runs.csv").open(newline="") as file:
        others = list(csv.DictReader(file))
    assert [row["measured_velocity_m_s"] for row in rows] == [
        row["measured_velocity_m_s"] for row in others
    ]
    assert "recording" not in others[0]
    again = record_case(gun_case("development"), tmp_path / "again", 1, name="a")
    assert folder_hash(tmp_path / "a") == again.folder_sha256
    assert again.changes == plain.changes
    with_traces, without = (
        tasks(2, 771, [f"gun {word} traces"], "development")[1:] for word in ("with", "without")
    )
    for first, second in zip(with_traces, without, strict=True):
        (case, seed), (other, other_seed) = case_of_task(first), case_of_task(second)
        assert (replace(case, traces=False), seed) == (other, other_seed)
        assert case.traces
        assert 5 <= len(case.strengths) <= 7


def test_force_of_a_chain_begins_when_the_bullet_arrives(tmp_path: Path) -> None:
    case = Case(GUN_AND_CONTACT, "any", 0, 2, 0.7, QUIET, {}, laws="development", traces=True)
    _, records = recorded(case, tmp_path / "c")
    for record in records:
        rate = float(record["fs"])
        blocked = np.flatnonzero(record["laser"] < record["laser"].min() / 2)
        hit = int(np.argmax(record["force"] > 0.05 * record["force"].max()))
        speed = BULLET_LENGTH_M * rate / blocked.size
        assert (hit - blocked[-1]) / rate == pytest.approx((1.485 - 0.93) / speed, rel=0.03)
