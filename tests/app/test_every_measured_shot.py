"""Every measured velocity updates the gun: one, two and seven shots, also of a bench that is stated
wrong."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.operations.predict.validity import bench_limit_sentences, warning_sentences
from pyroshock.app.twins.benches import bench_of_campaign
from pyroshock.app.twins.building import THESIS_VELOCITY_SPREAD
from pyroshock.app.twins.learning import taught_gun
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.session import Store, Writer, open_store
from pyroshock.twin.contact_interface import Extrapolation
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.sensors.chain import SensorChain
from support.records.twin_parts import HalfSine, setting

MASS_KG = 0.1428
#: Of the examples in examples/first-shots, and one whose tank is stated a tenth as large.
BENCH = GunBench(0.0095, 0.049, 0.048, 0.9, 0.3, 1.4, 0.5)
SMALL = replace(BENCH, tank_volume_m3=0.00095)
SHOTS = ((0.5, 22.9), (0.5, 22.8), (0.5, 23.0), (0.9, 30.4), (0.9, 30.3), (0.9, 30.5), (0.9, 30.4))


def taught(shots: tuple[tuple[float, float], ...], bench: GunBench = BENCH) -> GunStage:
    pressure, velocity = np.array(shots).T
    gun = GunStage(bench, THESIS_VELOCITY_SPREAD, unknown_effects=True)
    return gun.updated(1e5 * pressure, np.full(len(shots), MASS_KG), velocity)


def velocity_m_s(gun: GunStage, *pressures_bar: float) -> np.ndarray:
    settings = [setting(tank_pressure_pa=1e5 * p, impactor_mass_kg=MASS_KG) for p in pressures_bar]
    return gun.velocities(settings, SensorChain())


def spread_at(gun: GunStage, pressure_bar: float) -> tuple[float, float]:
    """Mean and standard deviation of ln v of random guns and shots."""
    z = np.random.default_rng(0).standard_normal((2048, 2))
    at = [setting(tank_pressure_pa=1e5 * pressure_bar, impactor_mass_kg=MASS_KG)]
    draws = gun.velocity_draws(at, SensorChain(), z)[:, 0]
    log = np.log(draws[draws > 0])
    return float(log.mean()), float(log.std())


@pytest.mark.parametrize("bench", [BENCH, SMALL], ids=["stated", "tank stated too small"])
def test_prediction_between_measured_velocities_lies_between_them(bench: GunBench) -> None:
    gun = taught(SHOTS, bench)
    assert 22.9 < velocity_m_s(gun, 0.7)[0] < 30.4
    for pressure, measured in ((0.5, 22.9), (0.9, 30.4)):
        middle, width = spread_at(gun, pressure)
        assert abs(math.log(measured) - middle) < 1.645 * width
        assert (
            width
            < spread_at(GunStage(bench, THESIS_VELOCITY_SPREAD, unknown_effects=True), pressure)[1]
        )


@pytest.mark.parametrize("count", [1, 2, 7])
def test_repeated_shots_update_as_a_conjugate_normal(count: int) -> None:
    """ln v is nearly normal before the shots; n shots of scatter s move its mean by the weights of
    their precisions."""
    before, width = spread_at(GunStage(BENCH, THESIS_VELOCITY_SPREAD, unknown_effects=True), 0.5)
    measured = before + 0.5 * width
    gun = taught(((0.5, math.exp(measured)),) * count)
    after, narrower = spread_at(gun, 0.5)
    scatter = 0.03  # of a shot, about; the likely range of a gun is some times as wide
    weight = 1 / (1 + scatter**2 / count / width**2)
    assert after - before == pytest.approx(weight * (measured - before), abs=0.15 * width)
    assert narrower < width
    assert narrower > 0.2 * scatter


def stored(folder: Path, toml_bench: str, shots: tuple[tuple[float, float], ...]) -> Store:
    folder.mkdir()
    text = f'[campaign]\nname = "seven"\nkind = "gun"\ndate = "2024-01-01"\n{toml_bench}'
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    rows = [
        f"{run},1,{pressure},{MASS_KG},PLA,{velocity}\n"
        for run, (pressure, velocity) in enumerate(shots, 1)
    ]
    head = "run,repetition,tank_pressure_bar,bullet_mass_kg,tip_material,measured_velocity_m_s\n"
    (folder / "runs.csv").write_text(head + "".join(rows), encoding="utf-8")
    store = open_store(f"sqlite:///{folder.parent / 'lab.db'}", Writer("test", "0"), create=True)
    ingest_folder(store, folder)
    return store


def test_shots_of_a_bench_that_is_stated_wrong_are_believed(tmp_path: Path) -> None:
    """All seven have more energy than the stated tank can give: the note says so, and the velocity
    follows them."""
    with stored(tmp_path / "seven", "", SHOTS).reading() as session:
        stage = GunStage(
            replace(SMALL, tank_volume_m3=2e-4), THESIS_VELOCITY_SPREAD, unknown_effects=True
        )
        gun, note = taught_gun(session, "seven", stage, ())
        assert gun.shots is not None and len(gun.shots) == 7
        assert (
            "7 of 7 shots have more energy than the gas of the stated bench can give: check" in note
        )
        assert 22.9 < velocity_m_s(gun, 0.7)[0] < 30.4


def test_single_mistake_among_shots_is_left_out(tmp_path: Path) -> None:
    with stored(tmp_path / "seven", "", (*SHOTS[:6], (0.9, 900.0))).reading() as session:
        gun, note = taught_gun(
            session, "seven", GunStage(BENCH, THESIS_VELOCITY_SPREAD, unknown_effects=True), ()
        )
        assert gun.shots is not None and len(gun.shots) == 6
        assert "1 of 7 shots have more energy" in note and note.endswith("left out")


def test_gun_campaign_without_a_stated_bench_is_the_newest(tmp_path: Path) -> None:
    """Its shots were ignored where no campaign was named."""
    with stored(tmp_path / "seven", "", SHOTS).reading() as session:
        assert bench_of_campaign(session, None).campaign == "seven"


def test_pressure_beyond_the_regulator_is_named() -> None:
    from pyroshock.twin.chain import Twin

    twin = Twin(HalfSine(), GunStage(BENCH, THESIS_VELOCITY_SPREAD, unknown_effects=True))
    at = setting(tank_pressure_pa=50e5, impactor_mass_kg=0.5)
    answer = twin.predict(at, rng=np.random.default_rng(0))
    (words,) = bench_limit_sentences(answer)
    assert "50 bar is beyond the bench, whose regulator gives 8 bar" in words.text
    assert words in warning_sentences(answer)
    assert not bench_limit_sentences(replace(answer, setting=replace(at, tank_pressure_pa=8e5)))
    shot_there = replace(answer, rests_on=replace(answer.rests_on, shots=5), extrapolation=())
    assert not bench_limit_sentences(shot_there)
    beyond = (Extrapolation("tank_pressure_pa", 50e5, 1e5, 9e5),)
    assert bench_limit_sentences(replace(shot_there, extrapolation=beyond))
