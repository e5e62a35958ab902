"""`python -m benchmarks.srs`: shock response spectra from our peers and from us, on two processors.

50,000 samples of noise at 100 kHz, 80 lines from 10 Hz to 10 kHz, Q = 10. Ours are whole spectra: both signs, primary,
residual and pseudo velocity, of the record as it is, and of the record resampled as its content requires. The peers
give the maximax while the record lasts, which is less work; pyyeti also with more processes and as it comes, which
raises the sampling rate for all lines.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.signals.srs.threads import processors

from .harness import (
    ABSENT,
    Figure,
    Program,
    ProgramError,
    beside,
    interpreter_with,
    multiplying,
    promised,
    report,
    take_turns,
)
from .shared_records import absolute_acceleration

THEME = "Shock response spectra: 50,000 samples, 80 lines, Q = 10; ours whole, the peers' maximax"
QUESTION = "a shock response spectrum"
SAMPLES, RATE_HZ, LINES, Q, PROCESSORS = 50_000, 1e5, 80, 10.0, 2
#: Ours over pyyeti's without roll-off, whose lines are the same; and by what equal lines may differ.
LIMIT, DIFFERENCE = 1 / 8, 1e-9
OURS, LFILTER = "ours", "scipy lfilter"
#: As the product computes it: white noise has content up to half the sampling rate, and is resampled eightfold.
RESAMPLED = "ours, resampled by the content"
PROMISED = ("pyyeti", "pyyeti, processes")
#: Its filter takes the base for constant in a step, so that it gives another number.
ENDAQ = "endaq, base in steps"
#: Of any recursion of second order with two terms of the base: five products, four sums.
FLOPS_PER_STEP = 9


def spectra(record: Floats, lines: Floats) -> dict[str, Callable[[], Floats]]:
    from pyyeti.srs import srs

    plain = partial(srs, record, RATE_HZ, lines, Q)
    return {
        OURS: lambda: shock_response_spectrum(record, RATE_HZ, lines, q=Q, resample_within=None).primary,
        RESAMPLED: lambda: shock_response_spectrum(record, RATE_HZ, lines, q=Q).primary,
        "pyyeti": partial(plain, rolloff="none", parallel="no"),
        "pyyeti, processes": partial(plain, rolloff="none", parallel="yes"),
        "pyyeti, as it comes": plain,
        LFILTER: partial(filtered, record, lines),
    }


def filtered(record: Floats, lines: Floats) -> Floats:
    """One `lfilter` for each line."""
    from scipy.signal import lfilter

    filters = absolute_acceleration(2 * np.pi * lines, 1 / RATE_HZ, 1 / (2 * Q))
    return np.array([np.abs(lfilter(b, a, record)).max() for b, a in zip(filters.b.T, filters.a.T, strict=True)])


def measure_srs(folder: Path, repeats: int = 45) -> Iterator[Figure]:
    """Every peer beside ours; and how far its lines are from ours."""
    if processors() > PROCESSORS and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:PROCESSORS])
    record, lines = np.random.default_rng(0).normal(size=SAMPLES), np.geomspace(10, 1e4, LINES)
    methods = spectra(record, lines)
    ours = methods[OURS]()
    difference = {name: float(np.abs(method() / ours - 1).max()) for name, method in methods.items()}
    functions: dict[str, Callable[[], object]] = {**methods}
    with ExitStack() as stack:
        program = _endaq(stack, folder, record, lines)
        if isinstance(program, Program):
            functions[ENDAQ] = program.seconds
            difference[ENDAQ] = float(np.abs(np.array(program.ask(value=True)["value"]) / ours - 1).max())
        seconds = take_turns(functions, repeats, reported=[ENDAQ])
        # The product's threads go on waiting for work and would take a processor from whatever comes next.
        limit = multiplying(float(FLOPS_PER_STEP * SAMPLES * LINES))
        seconds |= take_turns({"bound": limit}, repeats, reported=["bound"])
    for name in [*methods, ENDAQ][1:]:
        apart = f", largest difference {difference[name]:.1g}" if name in difference else ""
        yield beside(
            THEME, f"{name}{apart}", seconds, name, program if isinstance(program, str) else "", question=QUESTION,
            limit=LIMIT if name in PROMISED else None,
            bound=f"{FLOPS_PER_STEP} operations a step at the rate of a matrix product",
        )  # fmt: skip
    for name in (*PROMISED, LFILTER):
        yield promised(THEME, f"largest difference from {name}", [difference[name]], DIFFERENCE, "")


def _endaq(stack: ExitStack, folder: Path, record: Floats, lines: Floats) -> Program | str:
    """endaq in a process that lasts as long as `stack`; why not, where it cannot be."""
    python, file = interpreter_with("endaq"), folder / "endaq.npz"
    if python is None:
        return ABSENT
    np.savez(file, record=record, lines_hz=lines, rate_hz=RATE_HZ, damping_ratio=1 / (2 * Q))
    program = stack.enter_context(Program("-m", "benchmarks.peer_programs", "endaq", file, python=python))
    try:
        program.seconds()
    except ProgramError as error:
        return str(error)
    return program


if __name__ == "__main__":
    sys.exit(report(measure_srs))
