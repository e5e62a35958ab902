"""Hammer recordings of full length: 10 s, two channels, ten hits each, as a 16-bit recorder gives
them."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SAMPLING_RATE_HZ, DURATION_S, HITS, HAMMER_MASS_KG = 51_200.0, 10.0, 10, 0.32
FULL_SCALE_N, FULL_SCALE_M_S2 = 5_000.0, 50_000.0
#: The recorder's noise in steps of a converter of 16 bits.
NOISE_STEPS = 2.0
#: The hammer head rings at one mode after each hit, so that the deconvolution has something to take
#: out.
HEAD_MODE_HZ, HEAD_DAMPING, HEAD_SHARE = 6_000.0, 0.02, 0.3
#: Levels of the 180 configurations.
FACTORS: dict[str, tuple[str | float, ...]] = {
    "tip_material": ("aluminum", "steel", "delrin"),
    "tip_radius_mm": (5.0, 10.0, 20.0, 30.0, 40.0),
    "anvil_material": ("none", "aluminum", "steel"),
    "hammer_speed": ("low", "high"),
    "boundary_conditions": ("free", "fixed"),
    "plate_material": ("aluminum",),
}
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


def digitised(
    values: Floats,
    full_scale: float,
    rng: np.random.Generator,
    bits: int = 16,
    noise_steps: float = NOISE_STEPS,
) -> NDArray[np.float32]:
    """`values` (n,) as a converter of `bits` over ± `full_scale` gives them, with noise of so many
    steps of 16 bits."""
    step = 2 * full_scale / 2**bits
    noise = rng.normal(0.0, noise_steps * 2 * full_scale / 2**16, values.size)
    codes = np.clip(np.round((values + noise) / step), -(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return (codes.astype(np.int32) * step).astype(
        np.float32
    )  # a converter gives integers: no negative zero


def hit_force(samples: int, sampling_rate_hz: float, rng: np.random.Generator) -> Floats:
    """Contact force (samples,) of ten half sines of 0.3 to 2 ms, evenly apart with some jitter;
    newtons."""
    force, interval = np.zeros(samples), samples // HITS
    for hit in range(HITS):
        at = hit * interval + interval // 4 + int(rng.integers(0, interval // 8 + 1))
        width = max(4, round(rng.uniform(0.3e-3, 2e-3) * sampling_rate_hz))
        phase = np.clip((np.arange(width + 1) - rng.uniform(0.0, 1.0)) / width, 0.0, 1.0)
        force[at : at + width + 1] += rng.uniform(1_000.0, 3_000.0) * np.sin(np.pi * phase) ** 1.5
    return force


def hammer_record(rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Force and acceleration (n,) of one recording: the hammer head is a rigid body plus one
    mode."""
    from scipy.signal import lfilter

    force = hit_force(round(DURATION_S * SAMPLING_RATE_HZ), SAMPLING_RATE_HZ, rng)
    pole = np.exp(
        2j
        * np.pi
        * HEAD_MODE_HZ
        / SAMPLING_RATE_HZ
        * (1j * HEAD_DAMPING + np.sqrt(1 - HEAD_DAMPING**2))
    )
    recursion = np.array([1.0, -2 * pole.real, abs(pole) ** 2])
    mode = lfilter([recursion.sum() * 0.5, 0.0, -recursion.sum() * 0.5], recursion, force)
    acceleration = np.asarray((force + HEAD_SHARE * mode) / HAMMER_MASS_KG)
    return digitised(force, FULL_SCALE_N, rng), digitised(acceleration, FULL_SCALE_M_S2, rng)


def write_campaign(folder: Path, recordings: int, suffix: str, rng: np.random.Generator) -> Path:
    """A campaign of `recordings` files in `folder`, each with a row of runs.csv and a configuration
    of its own."""
    from scipy.io import savemat

    (folder / "recordings").mkdir(parents=True)
    (folder / "campaign.toml").write_text(CAMPAIGN)
    with (folder / "runs.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["run", "repetition", *FACTORS, "recording"])
        for run in range(1, recordings + 1):
            name = f"recordings/{run:04d}{suffix}"
            force, acceleration = hammer_record(rng)
            content = {"force": force, "acceleration": acceleration, "fs": SAMPLING_RATE_HZ}
            if suffix == ".mat":
                savemat(folder / name, content, do_compression=False)
            else:
                np.savez(folder / name, **content)
            levels, index = [], run - 1
            for choices in FACTORS.values():
                index, level = divmod(index, len(choices))
                levels.append(choices[level])
            table.writerow([run, 1, *levels, name])
    return folder


def kept_campaign(folder: Path, recordings: int, suffix: str) -> Path:
    """A campaign in `folder`, made where it is not there yet."""
    made = folder / f"campaign-{recordings}{suffix}"
    if not (made / "complete").exists():
        shutil.rmtree(made, ignore_errors=True)
        write_campaign(made, recordings, suffix, np.random.default_rng(7))
        (made / "complete").touch()
    return made
