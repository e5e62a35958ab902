"""Fig. 5.1: tank pressure and laser signal during a shot at the pressure of test 2."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.ingest.extraction.pressure_drop import pressure_drop
from pyroshock.ingest.extraction.velocity import muzzle_velocity
from pyroshock.virtualbench.campaigns.gun import BULLET_LENGTH_M, DURATION_S, LASER, RATE_HZ, TANK
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import Trigger, fire, shot_signals
from pyroshock.virtualbench.sensors import record

from .picture import MEASURED, MODEL, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

#: Test 2 of Table 3.1.
TEST_2_PA = 0.2651e5
_FINER, _FOLLOWED_S = 4, 1.3


def recorded(rng: np.random.Generator) -> dict[str, NDArray[np.float32]]:
    """Volts of pressure transducer and laser (n,), as the virtual bench's recorder writes them at
    100 kHz."""
    effects, bullet = Effects.default(), Projectile(length_m=BULLET_LENGTH_M)
    truth = fire(GunBuild(), effects, TEST_2_PA, bullet, rng, until_s=_FOLLOWED_S)
    rate = _FINER * RATE_HZ
    signals = shot_signals(truth, bullet, rate, DURATION_S, Trigger())
    time = np.arange(signals["laser"].size) / rate
    sensors = {"tank_pressure": TANK, "laser": LASER}
    return {
        name: record(time, signals[name], each, RATE_HZ, effects, rng)
        for name, each in sensors.items()
    }


def draw() -> Figure:
    """Pressure and laser volts over time since the trigger; velocity and pressure are what an
    ingest reads of them."""
    volts = recorded(np.random.default_rng(2))
    pressure_bar = (volts["tank_pressure"].astype(float) - TANK.offset_v) / (
        TANK.sensitivity or 1.0
    )
    before = pressure_drop(pressure_bar * 1e5, RATE_HZ)
    passage = muzzle_velocity(volts["laser"], RATE_HZ, BULLET_LENGTH_M)
    time_ms = 1e3 * (np.arange(pressure_bar.size) / RATE_HZ - Trigger().pre_trigger_s)
    figure = new_figure(8.0, 4.2)
    axes = figure.subplots()
    laser: Any = axes.twinx()
    laser.plot(time_ms[::10], volts["laser"][::10], color=MODEL, lw=0.8)
    axes.plot(time_ms[::10], pressure_bar[::10], color=MEASURED, lw=0.8)
    axes.axhline(0, color=QUIET, lw=0.6)
    axes.set_xlim(-100, 500)
    axes.set_xlabel("time since the trigger (ms)")
    axes.set_ylabel("tank pressure, gauge (bar)", color=MEASURED)
    laser.set_ylabel("laser (V)", color=MODEL)
    axes.set_title(
        f"A virtual shot, not the thesis's: {before.pressure_pa / 1e5:.3f} bar, "
        f"{passage.velocity_m_s:.2f} ± {passage.velocity_u_m_s:.2f} m/s"
    )
    return figure
