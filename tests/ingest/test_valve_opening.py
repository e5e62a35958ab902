"""The moment at which the valve opens: from laws that are known exactly, and from the virtual gun with noise."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.ingest.gunshot import valve_opening
from pyroshock.ingest.velocity import NoDropError
from pyroshock.virtualbench.campaigns.gun import TANK
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import Trigger, fire, shot_signals
from pyroshock.virtualbench.sensors import record
from pyroshock.virtualbench.simulate import simulate
from support.records.bench_shots import GUN_ROW
from support.stores.stores import ingested, pyroshock

RATE_HZ = 1e5


def drop(power: float, *, at_s: float = 0.2, noise_pa: float = 50.0, seed: int = 0) -> np.ndarray:
    """4 bar, and from a moment on a power of time that takes 1 bar within 0.2 s; 0.5 s at 100 kHz."""
    time = np.arange(50_000) / RATE_HZ
    fall = 1e5 * (np.maximum(time - at_s, 0.0) / 0.2) ** power
    return 4e5 - fall + noise_pa * np.random.default_rng(seed).standard_normal(time.size)


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0, 2.5, 3.0])
@pytest.mark.parametrize("noise_pa", [5.0, 50.0, 500.0])
def test_onset_of_a_power_of_time_lies_within_the_stated_uncertainty(power: float, noise_pa: float) -> None:
    found = [valve_opening(drop(power, noise_pa=noise_pa, seed=seed), RATE_HZ) for seed in range(4)]
    apart = np.array([(each.time_s - 0.2) / each.time_u_s for each in found])
    assert np.abs(apart).max() < 2.5
    assert all(each.time_s < each.seen_s + 1e-3 for each in found)


def test_a_drop_at_once_is_timed_to_a_block_and_noise_widens_the_uncertainty() -> None:
    time = np.arange(50_000) / RATE_HZ
    tank = np.where(time < 0.2, 4e5, 3e5) + 50 * np.random.default_rng(0).standard_normal(time.size)
    found = valve_opening(tank, RATE_HZ)
    assert found.time_s == pytest.approx(0.2, abs=2e-3)
    assert found.time_u_s < 2e-3
    quiet, loud = (valve_opening(drop(2.0, noise_pa=noise), RATE_HZ).time_u_s for noise in (5.0, 500.0))
    assert loud > 2 * quiet


@pytest.mark.parametrize(
    ("tank", "words"),
    [
        (4e5 + 50 * np.random.default_rng(0).standard_normal(50_000), "no drop: pressure falls by"),
        (drop(2.0, at_s=-0.05), "the pressure falls from .* after the record's beginning on"),
        (np.full(500, 4e5), "500 samples of pressure: expected at least 1200"),
    ],
)
def test_a_record_without_an_onset_is_refused(tank: np.ndarray, words: str) -> None:
    with pytest.raises(NoDropError, match=words):
        valve_opening(tank, RATE_HZ)
    with pytest.raises(ValueError, match="sample 3 is not finite"):
        valve_opening(np.where(np.arange(tank.size) == 3, np.nan, tank), RATE_HZ)


@pytest.fixture(scope="module")
def shots() -> list[tuple[float, float, float]]:
    """Error over uncertainty, uncertainty and opening time of virtual shots through the whole pressure channel.

    Valves of 0.1 to 1.5 s, 0.3 to 7 bar, a fifth of the usual noise to five times as much, recorded without a trigger.
    """
    rng, shots = np.random.default_rng(0), []
    for opening_s in (0.1, 0.25, 0.6, 1.5):
        gun = replace(GunBuild(), valve_opening_time_s=opening_s)
        for pressure_pa, mass_kg in ((0.3e5, 0.1428), (1e5, 0.5), (4e5, 0.5), (7e5, 1.0)):
            effects = Effects.default().with_strength("bench.hand_scatter", 0.0)
            bullet = Projectile(mass_kg)
            truth = fire(gun, effects, pressure_pa, bullet, rng, until_s=0.5 + opening_s)
            trigger = Trigger(None, float(rng.uniform(0.2, 0.4)))
            duration_s = 0.6 + opening_s
            tank = shot_signals(truth, bullet, 4 * RATE_HZ, duration_s, trigger)["tank_pressure"]
            time = np.arange(tank.size) / (4 * RATE_HZ)
            for noise in (0.2, 1.0, 5.0):
                volt = record(time, tank, TANK, RATE_HZ, effects.with_strength("bench.noise", noise), rng)
                found = valve_opening((volt.astype(float) - 0.3624) / 0.5621 * 1e5, RATE_HZ)
                error = found.time_s - trigger.pre_trigger_s - truth.port_opens_s
                shots.append((error / found.time_u_s, found.time_u_s, opening_s))
    return shots


def test_virtual_valves_open_within_an_uncertainty_of_milliseconds(shots: list[tuple[float, float, float]]) -> None:
    apart = np.array([shot[0] for shot in shots])
    assert np.abs(apart).max() < 2.5
    assert np.mean(np.abs(apart) < 1.0) >= 0.68
    widths = {opening: [u for _, u, of in shots if of == opening] for opening in (0.1, 1.5)}
    assert max(widths[0.1]) < 4e-3
    assert max(widths[1.5]) < 12e-3
    assert np.median(widths[1.5]) > np.median(widths[0.1])


@pytest.mark.usefixtures("coarse_plates")
def test_a_campaign_without_a_trigger_knows_when_its_valve_opened(sqlite_url, tmp_path) -> None:
    folder = tmp_path / "free"
    made = simulate([GUN_ROW], "gun", folder, seed=2, effects=Effects.default(), repetitions=1, trigger=Trigger(None))
    ingested(sqlite_url, folder)
    (truth,) = json.loads(made.seal.read_text(encoding="utf-8"))["runs"][0]["hits"]
    page = json.loads(pyroshock("show", "1", "--db", sqlite_url, "--json").stdout)
    (tank,) = [channel for channel in page["channels"] if channel["quantity"] == "pressure"]
    apart = tank["valve_opening_s"] - truth["valve_opens_s"]
    assert abs(apart) < 2.5 * tank["valve_opening_u_s"]
    assert tank["valve_opening_u_s"] < 5e-3
