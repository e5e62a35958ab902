"""Hammer recordings for the measurements: two channels, ten hits each, as a 16-bit recorder gives them."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

SAMPLING_RATE_HZ = 51_200.0
DURATION_S = 10.0
HITS = 10
HAMMER_MASS_KG = 0.32
FULL_SCALE_N, FULL_SCALE_M_S2 = 5_000.0, 50_000.0
#: The recorder's noise in steps of its converter.
NOISE_STEPS = 2.0
#: The hammer head rings at one mode after each hit, so that the deconvolution has something to take out.
HEAD_MODE_HZ, HEAD_DAMPING, HEAD_SHARE = 6_000.0, 0.02, 0.3

_TIPS = ("aluminum", "steel", "delrin")
_RADII_MM = (5.0, 10.0, 20.0, 30.0, 40.0)
_SPEEDS = ("low", "high")
_BOUNDARIES = ("free", "fixed")
_ANVILS = ("none", "aluminum", "steel")

CAMPAIGN = """[campaign]
name = "measured"
kind = "hammer"
date = "2026-11-01"

[bench.hammer]
mass_kg = 0.32

[channels.force]
quantity = "force"
unit = "N"
position = "hammer"
range = 5000.0

[channels.acceleration]
quantity = "acceleration"
unit = "m/s2"
position = "hammer"
range = 50000.0
"""

Floats = NDArray[np.float64]


def stepped(
    values: Floats, full_scale: float, rng: np.random.Generator, bits: int = 16, noise_steps: float = NOISE_STEPS
) -> NDArray[np.float32]:
    """`values` (n,) as a converter of `bits` over ± `full_scale` gives them, with noise of so many steps of 16 bits."""
    step = 2 * full_scale / 2**bits
    noise = rng.normal(0.0, noise_steps * 2 * full_scale / 2**16, values.size)
    codes = np.clip(np.round((values + noise) / step), -(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    values = codes.astype(np.int32) * step
    return values.astype(np.float32)  # a converter gives integers: no negative zero


def hit_force(samples: int, sampling_rate_hz: float, hits: int, rng: np.random.Generator) -> Floats:
    """Contact force (samples,) of `hits` half sines of 0.3 to 2 ms, evenly apart with some jitter; newtons."""
    force = np.zeros(samples)
    apart = samples // hits
    for hit in range(hits):
        at = hit * apart + apart // 4 + int(rng.integers(0, apart // 8 + 1))
        width = max(4, round(rng.uniform(0.3e-3, 2e-3) * sampling_rate_hz))
        phase = rng.uniform(0.0, 1.0)
        pulse = np.sin(np.pi * np.clip((np.arange(width + 1) - phase) / width, 0.0, 1.0)) ** 1.5
        force[at : at + width + 1] += rng.uniform(1_000.0, 3_000.0) * pulse
    return force


def hammer_acceleration(force: Floats, sampling_rate_hz: float) -> Floats:
    """Acceleration (n,) of a hammer head under `force` (n,): rigid body plus one mode, m/s2."""
    from scipy.signal import lfilter

    pole = np.exp(2j * np.pi * HEAD_MODE_HZ / sampling_rate_hz * (1j * HEAD_DAMPING + np.sqrt(1 - HEAD_DAMPING**2)))
    recursion = np.array([1.0, -2 * pole.real, abs(pole) ** 2])
    mode = lfilter([recursion.sum() * 0.5, 0.0, -recursion.sum() * 0.5], recursion, force)
    return np.asarray((force + HEAD_SHARE * mode) / HAMMER_MASS_KG)


def hammer_record(rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Force and acceleration (n,) of one recording."""
    force = hit_force(round(DURATION_S * SAMPLING_RATE_HZ), SAMPLING_RATE_HZ, HITS, rng)
    acceleration = hammer_acceleration(force, SAMPLING_RATE_HZ)
    return stepped(force, FULL_SCALE_N, rng), stepped(acceleration, FULL_SCALE_M_S2, rng)


def write_campaign(folder: Path, recordings: int, suffix: str, rng: np.random.Generator) -> Path:
    """A campaign of `recordings` files in `folder`, each with a row of runs.csv and a configuration of its own."""
    from scipy.io import savemat

    (folder / "recordings").mkdir(parents=True)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    with (folder / "runs.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["run", "repetition", *_FACTORS, "recording"])
        for run in range(1, recordings + 1):
            name = f"recordings/{run:04d}{suffix}"
            force, acceleration = hammer_record(rng)
            if suffix == ".mat":
                content = {"force": force, "acceleration": acceleration, "fs": SAMPLING_RATE_HZ}
                savemat(folder / name, content, do_compression=False)
            else:
                np.savez(folder / name, force=force, acceleration=acceleration, fs=SAMPLING_RATE_HZ)
            table.writerow([run, 1, *_levels(run - 1), name])
    return folder


_FACTORS = ("tip_material", "tip_radius_mm", "anvil_material", "hammer_speed", "boundary_conditions", "plate_material")


def _levels(index: int) -> list[str | float]:
    """The levels of configuration `index` of 180: 3 tips, 5 radii, 3 anvils, 2 speeds, 2 boundaries."""
    values: list[str | float] = []
    for choices in (_TIPS, _RADII_MM, _ANVILS, _SPEEDS, _BOUNDARIES):
        index, at = divmod(index, len(choices))
        values.append(choices[at])
    return [*values, "aluminum"]
