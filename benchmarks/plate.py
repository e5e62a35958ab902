"""`python -m benchmarks.plate`: modes of the virtual bench's plate, and its answer to pulses beside
scipy.

The plate is free, of 10 mm of aluminium. A table gives the distance of its modes from the bench's
own Mindlin model.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.twin.plate.build import PlateBuild, named_points
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.modes import solve_plate
from pyroshock.twin.plate.response import PlateResponse, respond
from pyroshock.twin.setting import THESIS
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.build import OUTLINE_M, resonant_plate
from pyroshock.virtualbench.plate.modes import PlateModes, modes

from .harness import (
    Figure,
    beside,
    compared,
    copying,
    multiplying,
    promised,
    report,
    table,
    table_row,
    take_turns,
)

THEME = "The plate of the virtual bench: 10 mm of aluminium, modes up to 20 kHz, two sensors"
STEP_S, SAMPLES, PULSES, WIDTH, HIGHEST_HZ = 1e-5, 10_000, 64, 300, 20e3
SOLVE_LIMIT_S, CONVOLVE_LIMIT_S, DIFFERENCE = 30.0, 15e-3, 1e-6
#: Of a recursion of second order with two terms of the force: five products, four sums; and of each
#: sensor's sum.
FLOPS_PER_STEP, FLOPS_PER_SENSOR = 9, 2
#: As on a lab's drawing; the same places that `virtualbench.plate.build` has.
IMPACTS_M = {"#1": (0.47, 0.28), "#2": (0.31, 0.37), "#3": (0.68, 0.22)}
SENSORS_M = {"acceleration_1": (0.22, 0.20), "acceleration_2": (0.73, 0.37)}
BUILD = PlateBuild(
    OUTLINE_M, 0.010, THESIS["aluminum"], named_points(IMPACTS_M), named_points(SENSORS_M)
)
DISTANCES = (
    "modes up to, Hz",
    "number",
    "corrected, % at most",
    "mean",
    "Kirchhoff alone, % at most",
)


def bench_modes() -> PlateModes:
    """The virtual bench's own: Mindlin elements of degree eight."""
    build = resonant_plate("aluminum", "free", np.random.default_rng(0))
    return modes(build, Effects.none(), max_frequency_hz=HIGHEST_HZ)


def measure_plate(_folder: Path, repeats: int = 9) -> Iterator[Figure]:
    begin = time.perf_counter()
    plate = solve_plate(BUILD, HIGHEST_HZ)
    solved = time.perf_counter()
    bench_modes()
    seconds, bench_seconds = [solved - begin], [time.perf_counter() - solved]
    yield compared(
        THEME, f"{plate.frequency_hz.size} modes, once", seconds, bench_seconds, "s",
        bound="a sparse eigenproblem",
        question="the modes of a plate", peer_name="the virtual bench's Mindlin elements",
    )  # fmt: skip
    yield promised(THEME, "modes, once", seconds, SOLVE_LIMIT_S, "s")
    force = np.zeros((PULSES, SAMPLES))  # half-sines at the beginning of each row
    force[:, :WIDTH] = np.sin(np.pi * np.arange(WIDTH) / WIDTH) * np.linspace(1, 2, PULSES)[:, None]
    yield from _one_pulse(plate, force[0], repeats)
    yield from _many_pulses(plate, force[:, :WIDTH], repeats)


def _one_pulse(plate: ModalPlate, force: Floats, repeats: int) -> Iterator[Figure]:
    """By recursion, beside `lfilter` mode by mode with the same ramp-invariant filters."""
    by_lfilter, peer = filters(plate), "scipy lfilter, mode by mode"
    flops = (
        plate.frequency_hz.size * SAMPLES * (FLOPS_PER_STEP + FLOPS_PER_SENSOR * len(plate.sensors))
    )
    functions: dict[str, Callable[[], object]] = {
        "ours": lambda: respond(plate, force, STEP_S),
        peer: lambda: by_lfilter(force),
        "bound": multiplying(float(flops)),
    }
    yield beside(
        THEME, f"one pulse of {SAMPLES:,} samples, mode by mode", take_turns(functions, repeats,
        reported=["bound"]),
        peer, bound="the recursions' operations at the rate of a product of matrices",
        question="a plate's answer to a pulse",
    )  # fmt: skip
    yield _same("one pulse, from lfilter", respond(plate, force, STEP_S), by_lfilter(force))


def _many_pulses(plate: ModalPlate, force: Floats, repeats: int) -> Iterator[Figure]:
    """Convolved with the plate's answer to a unit pulse."""
    from scipy.signal import fftconvolve, oaconvolve

    response = PlateResponse.of(plate, "#1", None, STEP_S, SAMPLES)
    methods: dict[str, Callable[[], Floats]] = {
        "ours": lambda: response.accelerations(force),
        "scipy fftconvolve": lambda: fftconvolve(force[:, None], response.hat[None], axes=-1)[
            ..., :SAMPLES
        ],
        "scipy oaconvolve": lambda: oaconvolve(force[:, None], response.hat[None], axes=-1)[
            ..., :SAMPLES
        ],
    }
    ours, *_ = answers = [method() for method in methods.values()]
    functions: dict[str, Callable[[], object]] = {**methods, "bound": copying(ours.nbytes)}
    seconds = take_turns(functions, repeats)
    for name, answer in zip(list(methods)[1:], answers[1:], strict=True):
        yield beside(
            THEME, f"{PULSES} pulses of {WIDTH} samples, {name}", seconds, name,
            bound="copying the accelerations in memory",
            question=f"a plate's answers to {PULSES} pulses",
        )  # fmt: skip
        yield _same(f"{PULSES} pulses, from {name}", ours, answer)
    yield promised(THEME, f"{PULSES} pulses convolved", seconds["ours"], CONVOLVE_LIMIT_S)


def filters(plate: ModalPlate) -> Callable[[Floats], Floats]:
    """What a user of scipy would write: a filter for each mode, `cont2discrete` by first-order
    hold, and their sum."""
    from scipy.signal import cont2discrete, lfilter

    rigid = plate.frequency_hz == 0  # nothing is taken from their force
    coefficients = []
    for f, z in zip(plate.frequency_hz[~rigid], plate.damping_ratio[~rigid], strict=True):
        w = 2 * np.pi * f
        b, a, _ = cont2discrete(
            ([-2 * z * w, -(w**2)], [1.0, 2 * z * w, w**2]), STEP_S, method="foh"
        )
        coefficients.append((np.ravel(b), a))
    gains = plate.shapes * plate.shape_impact[plate.impact_points.index("#1")]

    def filtered(force: Floats) -> Floats:
        taken = np.stack([lfilter(b, a, force) for b, a in coefficients])
        return np.asarray(gains.sum(axis=1)[:, None] * force + gains[:, ~rigid] @ taken)

    return filtered


def _same(name: str, ours: Floats, theirs: Floats) -> Figure:
    difference = float(np.abs(ours - theirs).max() / np.abs(ours).max())
    return promised(THEME, f"largest difference: {name}", [difference], DIFFERENCE, "")


def distances() -> Iterator[str]:
    """From the bench's frequencies, corrected and not, by band."""
    plate, bench = solve_plate(BUILD, HIGHEST_HZ), bench_modes()
    bare = solve_plate(BUILD, HIGHEST_HZ, thickness_correction=False)
    for top in (1e3, 5e3, 10e3, 20e3):
        band = slice(
            3,
            min(
                int(np.sum(bench.frequencies_hz < top)),
                plate.frequency_hz.size,
                bare.frequency_hz.size,
            ),
        )
        ours, alone = (
            100 * (p.frequency_hz[band] / bench.frequencies_hz[band] - 1) for p in (plate, bare)
        )
        corrected = f"{np.abs(ours).max():.2f}", f"{ours.mean():+.2f}"
        yield table_row(f"{top:g}", str(ours.size), *corrected, f"{np.abs(alone).max():.1f}")


if __name__ == "__main__":
    exit_code = report(measure_plate)
    print(table(DISTANCES, distances()))
    sys.exit(exit_code)
