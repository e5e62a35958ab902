"""The theme of spectra: what `python -m benchmarks.srs` prints, and endaq, as figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.array_types import Floats

from .apart import Apart, ApartError, in_turn, interpreter_with, seconds_of
from .figures import Figure, missing
from .limits import multiplying
from .measuring import Spread, ratio
from .peers import ABSENT
from .srs import (
    APART,
    LINES,
    PROMISED,
    RATE_HZ,
    REPEATS,
    SAME,
    SAMPLES,
    Q,
    differences,
    noise,
    two_processors,
    ways,
)

THEME = "Shock response spectra: 50,000 samples, 80 lines, Q = 10; ours whole, the peers' maximax"
QUESTION = "a shock response spectrum"
#: Its filter takes the base for constant in a step, so that it gives another number.
_ENDAQ = "endaq, base in steps"
#: Of any recursion of second order with two terms of the base: five products, four sums.
FLOPS_A_STEP = 9


def measure_spectra(folder: Path) -> Iterator[Figure]:
    """Every peer over ours; and what the ways that should agree differ by, over what they may."""
    two_processors()
    record, lines = noise((SAMPLES,)), np.geomspace(10, 1e4, LINES)
    every = ways(record, lines)
    apart = differences(every)
    with ExitStack() as stack:
        timed: dict[str, Callable[[], float]] = {name: partial(seconds_of, way) for name, way in every.items()}
        program = _endaq(stack, folder, record, lines)
        if isinstance(program, Apart):
            timed[_ENDAQ] = program.seconds
            theirs = np.array(program.ask(value=True)["value"])
            apart[_ENDAQ] = float(np.abs(theirs / every["pyroshock"]() - 1).max())
        bound = {"bound": multiplying(float(FLOPS_A_STEP * SAMPLES * LINES))}
        in_turn(timed | bound, 1)  # caches and imports
        # The product's threads go on waiting for work and would take a processor from whatever comes next.
        taken = in_turn(timed, REPEATS) | in_turn(bound, REPEATS)
    yield from _beside(taken)
    if isinstance(program, str):
        yield missing(THEME, _ENDAQ, program, question=QUESTION, rival=_ENDAQ)
    else:
        yield Figure(
            THEME, f"largest difference from {_ENDAQ}", f"{apart[_ENDAQ]:.1g}", "it is no error of either", None
        )
    for name in (*SAME, "scipy lfilter"):
        over = Spread.of([apart[name] / APART])
        found, promised = f"{apart[name]:.1g}", f"{APART:g}, promised"
        yield Figure(THEME, f"largest difference from {name}", found, promised, over, limit=1.0, of="bound")


def _beside(taken: Mapping[str, list[float]]) -> Iterator[Figure]:
    ours, bounds = taken["pyroshock"], taken["bound"]
    bound = Spread.of(bounds).text(" ms", 1e3)
    nature = f"{FLOPS_A_STEP} operations a step at the rate of a matrix product: {bound}"
    for name in [way for way in taken if way not in ("pyroshock", "bound")]:
        own, other = (Spread.of(taken[which]).text(" ms", 1e3) for which in ("pyroshock", name))
        rival = not name.startswith("pyroshock")
        yield Figure(
            THEME, name, own, other, ratio(taken[name], ours), "at least", PROMISED if name in SAME else None, nature,
            near=ratio(ours, bounds), question=QUESTION if rival else "", of="time" if rival else "growth", rival=name,
        )  # fmt: skip


def _endaq(stack: ExitStack, folder: Path, record: Floats, lines: Floats) -> Apart | str:
    """endaq in a process that lasts as long as `stack`; why not, where it cannot be."""
    python = interpreter_with("endaq")
    if python is None:
        return ABSENT
    file = folder / "endaq.npz"
    np.savez(file, record=record, lines_hz=lines, rate_hz=RATE_HZ, damping_ratio=1 / (2 * Q))
    program = stack.enter_context(Apart("-m", "benchmarks.endaq_peer", file, python=python))
    try:
        program.seconds()
    except ApartError as error:
        return str(error)
    return program
