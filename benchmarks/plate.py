"""`python -m benchmarks.plate`: the plate's figures, as Markdown; exit code 1 where a promised one is missed.

The plate of the virtual bench (10 mm of aluminium, free): time of its modes up to 20 kHz, their distance from the
bench's own Mindlin model, and the time of 64 pulses to 10,000 samples at two sensors.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.twin.plate.build import PlateBuild, named_points
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.modes import cached_plate, solve_plate
from pyroshock.twin.plate.response import PlateResponse, respond
from pyroshock.twin.setting import THESIS
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.build import OUTLINE_M, resonant_plate
from pyroshock.virtualbench.plate.modes import PlateModes, modes

from benchmarks.measuring import Spread, interleaved

STEP_S, SAMPLES, PULSES, WIDTH = 1e-5, 10_000, 64, 300
SOLVE_LIMIT_S, CONVOLVE_LIMIT_S = 30.0, 15e-3
BUILD = PlateBuild(
    OUTLINE_M,
    0.010,
    THESIS["aluminum"],
    named_points({"#1": (0.47, 0.28), "#2": (0.31, 0.37), "#3": (0.68, 0.22)}),
    named_points({"acceleration_1": (0.22, 0.20), "acceleration_2": (0.73, 0.37)}),
)


def solution() -> tuple[ModalPlate, float]:
    began = time.perf_counter()
    plate = solve_plate(BUILD, 20e3)
    return plate, time.perf_counter() - began


def cached_s() -> float:
    with TemporaryDirectory() as folder:
        cached_plate(BUILD, 1e3, Path(folder))
        began = time.perf_counter()
        cached_plate(BUILD, 1e3, Path(folder))
        return time.perf_counter() - began


def bench_modes() -> PlateModes:
    """The virtual bench's own: Mindlin elements of degree eight."""
    return modes(resonant_plate("aluminum", "free", np.random.default_rng(0)), Effects.none(), max_frequency_hz=20e3)


def pulses() -> Floats:
    """Half-sines (PULSES, SAMPLES) at the beginning of each row."""
    force = np.zeros((PULSES, SAMPLES))
    force[:, :WIDTH] = np.sin(np.pi * np.arange(WIDTH) / WIDTH) * np.linspace(1, 2, PULSES)[:, None]
    return force


def distances(plate: ModalPlate) -> str:
    """From the bench's frequencies, corrected and not, by band."""
    peer = bench_modes()
    bare = solve_plate(BUILD, 20e3, thickness_correction=False)
    rows = [
        "| modes up to, Hz | number | corrected, % at most | mean | Kirchhoff alone, % at most |",
        "| --- |" + " --- |" * 4,
    ]
    for top in (1e3, 5e3, 10e3, 20e3):
        band = slice(3, min(int(np.sum(peer.frequencies_hz < top)), plate.frequency_hz.size, bare.frequency_hz.size))
        ours, alone = (100 * (each.frequency_hz[band] / peer.frequencies_hz[band] - 1) for each in (plate, bare))
        rows.append(
            f"| {top:g} | {ours.size} | {np.abs(ours).max():.2f} | {ours.mean():+.2f} | {np.abs(alone).max():.1f} |"
        )
    return "\n".join(rows)


def times(plate: ModalPlate) -> dict[str, Spread]:
    force = pulses()
    response = PlateResponse.of(plate, "#1", None, STEP_S, SAMPLES)
    taken = interleaved(
        {
            "one pulse by recursion": lambda: respond(plate, force[0], STEP_S),
            "response to a unit pulse": lambda: PlateResponse.of(plate, "#1", None, STEP_S, SAMPLES),
            "64 pulses convolved": lambda: response.accelerations(force[:, :WIDTH]),
        },
        15,
    )
    return {name: Spread.of(seconds) for name, seconds in taken.items()}


def main() -> int:
    plate, solved_s = solution()
    sys.stdout.write(
        f"{plate.frequency_hz.size} modes up to 20 kHz: {solved_s:.1f} s; from disk: {1e3 * cached_s():.1f} ms\n\n"
    )
    taken = times(plate)
    for name, spread in taken.items():
        sys.stdout.write(f"{name}: {spread.text(' ms', 1e3)}\n")
    sys.stdout.write("\n" + distances(plate) + "\n")
    fast = taken["64 pulses convolved"].median <= CONVOLVE_LIMIT_S
    return 0 if fast and solved_s <= SOLVE_LIMIT_S else 1


if __name__ == "__main__":
    sys.exit(main())
