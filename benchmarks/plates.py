"""The theme of the plate: modes, and the answer to pulses beside scipy's filters and convolutions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.response import PlateResponse, respond

from .figures import Figure
from .limits import copying, multiplying
from .measuring import Spread, interleaved, ratio
from .plate import CONVOLVE_LIMIT_S, PULSES, SAMPLES, SOLVE_LIMIT_S, STEP_S, WIDTH, bench_modes, pulses, solution

THEME = "The plate of the virtual bench: 10 mm of aluminium, modes up to 20 kHz, two sensors"
#: Of a recursion of second order with two terms of the force: five products, four sums; and of each sensor's sum.
FLOPS_A_STEP, FLOPS_A_SENSOR = 9, 2
APART = 1e-6


def measure_plates(_folder: Path, repeats: int = 9) -> Iterator[Figure]:
    plate, solved_s = solution()
    began = time.perf_counter()
    bench_modes()
    bench_s = time.perf_counter() - began
    yield Figure(
        THEME, f"{plate.frequency_hz.size} modes, once", f"{solved_s:.1f} s", f"{bench_s:.1f} s",
        Spread.of([solved_s / bench_s]), nature="a sparse eigenproblem", question="the modes of a plate",
        rival="the virtual bench's Mindlin elements",
    )  # fmt: skip
    yield _promised("modes, once", [solved_s], SOLVE_LIMIT_S)
    yield from _one_pulse(plate, repeats)
    yield from _many_pulses(plate, repeats)


def _one_pulse(plate: ModalPlate, repeats: int) -> Iterator[Figure]:
    """By recursion, beside `lfilter` mode by mode with the same ramp-invariant filters."""
    force, filtered = pulses()[0], by_filters(plate)
    apart = _apart(respond(plate, force, STEP_S), filtered(force))
    modes, bounds = plate.frequency_hz.size, list[float]()
    product = multiplying(float(modes * SAMPLES * (FLOPS_A_STEP + FLOPS_A_SENSOR * len(plate.sensors))))
    taken = interleaved(
        {
            "ours": lambda: respond(plate, force, STEP_S),
            "lfilter": lambda: filtered(force),
            "bound": lambda: bounds.append(product()),
        },
        repeats,
    )
    bound = Spread.of(bounds[1:]).text(" ms", 1e3)
    yield Figure(
        THEME, f"one pulse of {SAMPLES:,} samples, mode by mode", _ms(taken["ours"]), _ms(taken["lfilter"]),
        ratio(taken["ours"], taken["lfilter"]), near=ratio(taken["ours"], bounds[1:]),
        nature=f"the recursions' operations at the rate of a product of matrices: {bound}",
        question="a plate's answer to a pulse", rival="scipy lfilter, mode by mode",
    )  # fmt: skip
    yield _same("one pulse, from lfilter", apart)


def _many_pulses(plate: ModalPlate, repeats: int) -> Iterator[Figure]:
    """Convolved with the plate's answer to a unit pulse."""
    from scipy.signal import fftconvolve, oaconvolve

    force = pulses()[:, :WIDTH]
    response = PlateResponse.of(plate, "#1", None, STEP_S, SAMPLES)
    peers: dict[str, Callable[..., Floats]] = {"scipy fftconvolve": fftconvolve, "scipy oaconvolve": oaconvolve}
    ways: dict[str, Callable[[], Floats]] = {
        name: lambda way=way: way(force[:, None], response.hat[None], axes=-1)[..., :SAMPLES]  # type: ignore[misc]
        for name, way in peers.items()
    }
    mine = response.accelerations(force)
    apart = {name: _apart(mine, way()) for name, way in ways.items()}
    copy = copying(mine.nbytes)
    taken = interleaved({"ours": lambda: response.accelerations(force), **ways, "copy": copy}, repeats)
    for name in ways:
        yield Figure(
            THEME, f"{PULSES} pulses of {WIDTH} samples, {name}", _ms(taken["ours"]), _ms(taken[name]),
            ratio(taken["ours"], taken[name]), nature=f"copying the accelerations in memory: {_ms(taken['copy'])}",
            near=ratio(taken["ours"], taken["copy"]), question=f"a plate's answers to {PULSES} pulses", rival=name,
        )  # fmt: skip
        yield _same(f"{PULSES} pulses, from {name}", apart[name])
    yield _promised(f"{PULSES} pulses convolved", taken["ours"], CONVOLVE_LIMIT_S)


def by_filters(plate: ModalPlate) -> Callable[[Floats], Floats]:
    """What a user of scipy would write: a filter for each mode, `cont2discrete` by first-order hold, and their sum."""
    from scipy.signal import cont2discrete, lfilter

    rigid = plate.frequency_hz == 0  # nothing is taken from their force
    filters = []
    for f, z in zip(plate.frequency_hz[~rigid], plate.damping_ratio[~rigid], strict=True):
        w = 2 * np.pi * f
        b, a, _ = cont2discrete(([-2 * z * w, -(w**2)], [1.0, 2 * z * w, w**2]), STEP_S, method="foh")
        filters.append((np.ravel(b), a))
    gains = plate.shapes * plate.shape_impact[plate.impact_points.index("#1")]

    def filtered(force: Floats) -> Floats:
        taken = np.stack([lfilter(b, a, force) for b, a in filters])
        return np.asarray(gains.sum(axis=1)[:, None] * force + gains[:, ~rigid] @ taken)

    return filtered


def _apart(ours: Floats, theirs: Floats) -> float:
    return float(np.abs(ours - theirs).max() / np.abs(ours).max())


def _same(name: str, apart: float) -> Figure:
    texts = (f"{apart:.1g}", f"{APART:g}, promised")
    return Figure(THEME, f"largest difference: {name}", *texts, Spread.of([apart / APART]), limit=1.0, of="bound")


def _promised(name: str, seconds: list[float], limit_s: float) -> Figure:
    text, promise = Spread.of(seconds).text(" ms", 1e3), f"{1e3 * limit_s:g} ms, promised"
    return Figure(THEME, name, text, promise, Spread.of([s / limit_s for s in seconds]), limit=1.0, of="bound")


def _ms(seconds: list[float]) -> str:
    return Spread.of(seconds).text(" ms", 1e3)
