"""The virtual bench as the tuning benchmark plays it: hidden settings, shots that are fired, spectra that are true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.twin.setting import Setting
from pyroshock.virtualbench.campaigns.gun import RATE_HZ, VirtualGunBench, set_up
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.sensors.chain import calibrated

Floats = NDArray[np.float64]

#: Lines of all targets: six per octave, Q = 10.
LINES_HZ = 100.0 * 2 ** (np.arange(41) / 6)
SENSOR = "acceleration_1"
#: What a noise-free record leaves out: noise, drift and scatter of the bench, and what the accelerometer does wrong.
#: What makes a setting mean what it means (the transducer's errors among it) stays.
NOISE = (
    "bench.noise", "bench.drift", "bench.hand_scatter", "bench.trigger_jitter",
    "sensor.acceleration_gain", "sensor.zero_shift", "sensor.mount_resonance",
)  # fmt: skip
#: A range that clips nothing, in g; the sensor's own is 10,000 g.
_WIDE_G = 1e6
#: Samples before anything hits.
_QUIET = 10_000
#: Beyond the sensor's range, or no hit at all.
Spoiled = Literal["clipped", "silent"]


@dataclass(frozen=True, eq=False)
class VirtualGun:
    """One bench, as a campaign simulated with the same seed has it: the same plates."""

    seed: int

    def shot(self, setting: Setting, number: int) -> Floats | Spoiled:
        """The spectrum (f,) that a shot shows, m/s2, noise and scatter with it; how the record is spoiled otherwise."""
        bench, row = self._bench(Effects.default()), row_of(setting)
        record = self._record(bench, row, np.random.default_rng([self.seed, 1, number]))
        record = record - np.median(record[:_QUIET])
        full = next(s for s in bench.sensors if s.name == SENSOR).full_scale * 9.80665
        if np.abs(record).max() > 0.99 * full:
            return "clipped"
        return "silent" if np.abs(record).max() < 10 * record[:_QUIET].std() else spectrum(record)

    def truth(self, setting: Setting) -> tuple[Floats, float]:
        """The noise-free spectrum (f,), m/s2, and the largest acceleration, m/s2."""
        bench = self._bench(Effects.default().without(*NOISE))
        wide = tuple(replace(s, full_scale=_WIDE_G) if s.name == SENSOR else s for s in bench.sensors)
        record = self._record(replace(bench, sensors=wide), row_of(setting), np.random.default_rng(self.seed))
        return spectrum(record), float(np.abs(record).max())

    def _bench(self, effects: Effects) -> VirtualGunBench:
        """Plates come from the first child of the seed, as `virtualbench.simulate` draws them."""
        rows = [row_of_plate(name) for name in ("aluminum", "steel")]
        return set_up(rows, effects, np.random.default_rng(np.random.SeedSequence(self.seed).spawn(1)[0]))

    def _record(self, bench: VirtualGunBench, row: Mapping[str, str], rng: np.random.Generator) -> Floats:
        (task,) = bench.tasks([row], 1)
        sensor = next(s for s in bench.sensors if s.name == SENSOR)
        taken = bench.take(task, rng).channels[SENSOR]
        return np.asarray(calibrated(taken, sensor), dtype=np.float64)


def spectrum(acceleration: Floats) -> Floats:
    """Maximax (f,) at `LINES_HZ`, m/s2."""
    centred = acceleration - np.median(acceleration[:_QUIET])
    return np.asarray(shock_response_spectrum(centred, RATE_HZ, LINES_HZ, q=10.0).maximax)


def row_of(setting: Setting) -> dict[str, str]:
    """A setting as a row of a plan."""
    assert setting.tank_pressure_pa is not None
    return {
        "run": "1",
        "plate_material": setting.plate.name,
        "anvil_material": setting.anvil.name if setting.anvil else "none",
        "insulator": setting.insulator,
        "tip_material": setting.tip.name,
        "tip_radius_mm": repr(setting.tip_radius_m * 1e3),
        "bullet_mass_kg": repr(setting.impactor_mass_kg),
        "tank_pressure_bar": repr(setting.tank_pressure_pa / 1e5),
        "impact_position": setting.impact_position,
    }


def row_of_plate(material: str) -> dict[str, str]:
    """Any shot on a plate: the bench solves the plates that its rows name."""
    row: dict[str, Any] = {"run": "1", "plate_material": material, "anvil_material": "none", "insulator": "none"}
    return row | {"tip_material": "PLA", "tip_radius_mm": "30", "bullet_mass_kg": "0.5", "tank_pressure_bar": "1"}
