"""Velocities of the virtual gun, whose laws are others than the twin's: bands that hold what was
not learned from."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.prediction import stratified_normals
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.virtualbench.campaigns.base import RecordingTask, day_fraction
from pyroshock.virtualbench.campaigns.gun import BULLET_LENGTH_M, VELOCITY_FAULT
from pyroshock.virtualbench.campaigns.gun import VirtualGunBench as VirtualBench
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import Projectile
from pyroshock.virtualbench.gun.fire import fire
from support.records.twin_parts import setting

Floats = NDArray[np.float64]

STATED = GunBench(0.0095, 0.049, 0.048, 0.885, 0.3, 1.4, 1.0)
MASSES = [0.2, 0.5, 1.0]
#: Of each mass so much that the nominal gun with an efficiency of one half gives 6, 10 and 14 m/s,
#: in bar.
LEVELS = {0.2: [0.1, 0.28, 0.55], 0.5: [0.26, 0.71, 1.38], 1.0: [0.52, 1.41, 2.75]}
CONFIGURATIONS, REPETITIONS = 30, 3


def virtual_campaign(seed: int, levels: bool) -> Floats:
    """Rows (n, 4): configuration, pressure as set (Pa), mass (kg), velocity by the laser (m/s), of
    shots that left."""
    effects, rng = Effects.default(), np.random.default_rng(seed)
    bench = VirtualBench(effects, {})
    masses = rng.permutation(np.resize(MASSES, CONFIGURATIONS))
    level = rng.integers(3, size=CONFIGURATIONS)
    even = np.exp(rng.uniform(np.log(0.5), np.log(6.7), CONFIGURATIONS)).round(2)
    length = BULLET_LENGTH_M / (1 + VELOCITY_FAULT * effects["sensor.velocity_gain"])
    rows = []
    for number, mass in enumerate(masses.tolist()):
        bar = LEVELS[mass][level[number]] if levels else float(even[number])
        row = {"run": str(number + 1), "tank_pressure_bar": str(bar), "bullet_mass_kg": str(mass)}
        task = RecordingTask("", row, {}, 1, day_fraction(number, 20))
        for _ in range(REPETITIONS):
            shot = fire(
                bench.gun, effects, bench._pressure(task, rng), Projectile(mass, length), rng
            )
            if shot.muzzle_velocity_m_s > 0 and shot.laser_blocked:
                start, stop = shot.laser_blocked[0]
                timed = stop - start + 4e-6 * rng.standard_normal()  # samples at 100 kHz
                rows.append((number, bar * 1e5, mass, BULLET_LENGTH_M / timed))
    return np.array(rows)


def judged(shots: Floats, learned: NDArray[np.bool_], rng: np.random.Generator) -> Floats:
    """(shots, 2) of configurations that were not learned from: inside the 90 % band, and abs(ln
    error) of the median; from 64 draws as a prediction takes them."""
    gun = GunStage(STATED, 0.046, unknown_effects=True)
    if learned.any():
        gun = gun.updated(*shots[learned, 1:].T)
    rows = []
    for _, pressure, mass, measured in shots[~np.isin(shots[:, 0], shots[learned, 0])]:
        asked = [setting(tank_pressure_pa=pressure, impactor_mass_kg=mass)]
        drawn = gun.velocity_draws(asked, SensorChain(), stratified_normals(64, gun.normals, rng))[
            :, 0
        ]
        drawn = drawn[drawn > 0]
        low, middle, high = np.quantile(drawn, [0.05, 0.5, 0.95], method="hazen")
        rows.append((low <= measured <= high, abs(np.log(middle / measured))))
    return np.array(rows, dtype=np.float64)


@pytest.mark.slow
@pytest.mark.parametrize("levels", [False, True], ids=("0.5 to 6.7 bar", "levels"))
def test_bands_hold_the_virtual_gun(levels):
    """Three campaigns; nothing learned, ten shots, twenty configurations."""
    nothing, ten, twenty = [], [], []
    for seed in (1, 2, 3):
        shots = virtual_campaign(seed, levels)
        nothing.append(judged(shots, np.zeros(len(shots), dtype=bool), np.random.default_rng(seed)))
        for again in range(5):
            rng = np.random.default_rng([seed, again])
            few = np.isin(np.arange(len(shots)), rng.permutation(len(shots))[:10])
            ten.append(judged(shots, few, rng))
            most = np.isin(shots[:, 0], rng.permutation(CONFIGURATIONS)[:20])
            twenty.append(judged(shots, most, rng))
    inside, errors = zip(*(np.concatenate(rows).T for rows in (nothing, ten, twenty)), strict=True)
    coverage, middle = (
        [float(each.mean()) for each in inside],
        [float(np.median(each)) for each in errors],
    )
    print(
        f"in the 90 % band: {np.round(coverage, 3)}; median of abs(ln error): {np.round(middle, 4)}"
    )
    assert coverage[0] >= 0.85
    assert 0.85 <= coverage[1] <= 0.98 and 0.85 <= coverage[2] <= 0.98
    assert middle[1] < middle[0] / 2 and middle[2] < 0.02
