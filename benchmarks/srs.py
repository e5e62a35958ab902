"""`python -m benchmarks.srs`: shock response spectra from our peers and from us, on two processors.

50,000 samples of noise at 100 kHz, 80 lines from 10 Hz to 10 kHz, Q = 10. Ours are whole spectra:
both signs, primary, residual and pseudo velocity, of the record as it is. The peers give the
maximax while the record lasts, which is less work; pyyeti also with more processes and as it comes,
which raises the sampling rate for all lines.

Then ours as the product computes it, which resamples a record where its content requires that,
beside the record as it is: of that noise, of half sines of 2 ms, of sines that decay, and of the
shipped hit of a modal hammer; and the figures that an ingest measures of that hit.
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
from pyroshock.ingest.extraction.channels import read_channels
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.signals.channel import Channel
from pyroshock.signals.shock_figures import shock_figures
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.signals.srs.threads import processors

from .harness import (
    ABSENT,
    ROOT,
    Figure,
    Program,
    ProgramError,
    beside,
    compared,
    interpreter_with,
    multiplying,
    processor_seconds,
    promised,
    report,
    take_turns,
)
from .shared_records import absolute_acceleration

THEME = "Shock response spectra: 50,000 samples, 80 lines, Q = 10; ours whole, the peers' maximax"
QUESTION = "a shock response spectrum"
DEFAULT_THEME = (
    "Shock response spectra by default, resampled where the content requires it, "
    "beside the record as it is"
)
SAMPLES, RATE_HZ, LINES, Q, PROCESSORS = 50_000, 1e5, 80, 10.0, 2
#: Ours over pyyeti's without roll-off, whose lines are the same; and by what equal lines may
#: differ.
LIMIT, DIFFERENCE = 1 / 8, 1e-9
#: By default over the record as it is, where nothing is resampled.
NOT_RESAMPLED, DEFAULT_LIMIT = "a half sine of 2 ms", 1.1
OURS, LFILTER = "ours", "scipy lfilter"
PROMISED = ("pyyeti", "pyyeti, processes")
#: Its filter takes the base for constant in a step, so that it gives another number.
ENDAQ = "endaq, base in steps"
#: Of any recursion of second order with two terms of the base: five products, four sums.
FLOPS_PER_STEP = 9


def spectra(record: Floats, lines: Floats) -> dict[str, Callable[[], Floats]]:
    from pyyeti.srs import srs

    plain = partial(srs, record, RATE_HZ, lines, Q)
    return {
        OURS: lambda: (
            shock_response_spectrum(record, RATE_HZ, lines, q=Q, resample_within=None).primary
        ),
        "pyyeti": partial(plain, rolloff="none", parallel="no"),
        "pyyeti, processes": partial(plain, rolloff="none", parallel="yes"),
        "pyyeti, as it comes": plain,
        LFILTER: partial(filtered, record, lines),
    }


def filtered(record: Floats, lines: Floats) -> Floats:
    """One `lfilter` for each line."""
    from scipy.signal import lfilter

    filters = absolute_acceleration(2 * np.pi * lines, 1 / RATE_HZ, 1 / (2 * Q))
    return np.array(
        [np.abs(lfilter(b, a, record)).max() for b, a in zip(filters.b.T, filters.a.T, strict=True)]
    )


def measure_srs(folder: Path, repeats: int = 45) -> Iterator[Figure]:
    """Every peer beside ours; and how far its lines are from ours."""
    if processors() > PROCESSORS and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:PROCESSORS])
    record, lines = np.random.default_rng(0).normal(size=SAMPLES), np.geomspace(10, 1e4, LINES)
    methods = spectra(record, lines)
    ours = methods[OURS]()
    difference = {
        name: float(np.abs(method() / ours - 1).max()) for name, method in methods.items()
    }
    functions: dict[str, Callable[[], object]] = {**methods}
    with ExitStack() as stack:
        program = _endaq(stack, folder, record, lines)
        if isinstance(program, Program):
            functions[ENDAQ] = program.seconds
            difference[ENDAQ] = float(
                np.abs(np.array(program.ask(value=True)["value"]) / ours - 1).max()
            )
        seconds = take_turns(functions, repeats, reported=[ENDAQ])
        # The product's threads go on waiting for work and would take a processor from whatever
        # comes next.
        limit = multiplying(float(FLOPS_PER_STEP * SAMPLES * LINES))
        seconds |= take_turns({"bound": limit}, repeats, reported=["bound"])
    for name in [*methods, ENDAQ][1:]:
        apart = f", largest difference {difference[name]:.1g}" if name in difference else ""
        yield beside(
            THEME, f"{name}{apart}", seconds, name, program if isinstance(program, str) else "",
            question=QUESTION,
            limit=LIMIT if name in PROMISED else None,
            bound=f"{FLOPS_PER_STEP} operations a step at the rate of a matrix product",
        )  # fmt: skip
    for name in (*PROMISED, LFILTER):
        yield promised(THEME, f"largest difference from {name}", [difference[name]], DIFFERENCE, "")
    yield from _measure_default(record, lines, repeats)


def _measure_default(noise: Floats, lines: Floats, repeats: int) -> Iterator[Figure]:
    """In seconds of processors, which other work on the machine does not change."""
    hit = _shipped_hit()
    phase = np.clip((np.arange(SAMPLES) / RATE_HZ - 0.05) / 2e-3, 0, 1)
    since = np.maximum(np.arange(SAMPLES) / RATE_HZ - 0.05, 0.0)
    ringing = sum(
        np.exp(-0.03 * 2 * np.pi * f * since) * np.sin(2 * np.pi * f * since)
        for f in (150, 400, 1000)
    )
    half_sine = np.sin(np.pi * phase)
    of_hit = (
        f"a hit of a modal hammer, {hit.si.size:,} samples at {1e-3 * hit.sampling_rate_hz:g} kHz"
    )
    records = {
        "white noise": (noise, RATE_HZ),
        NOT_RESAMPLED: (half_sine, RATE_HZ),
        "that half sine with noise of 0.01 %": (half_sine + 1e-4 * noise, RATE_HZ),
        "ten of that half sine in a batch": (np.tile(half_sine, (10, 1)), RATE_HZ),
        "sines of 150 to 1,000 Hz that decay": (np.asarray(ringing), RATE_HZ),
        of_hit: (hit.si, hit.sampling_rate_hz),
    }
    for name, (record, rate) in records.items():
        spectrum = partial(shock_response_spectrum, record, rate, lines[lines <= rate / 5], q=Q)
        as_it_is = partial(spectrum, resample_within=None)
        seconds = take_turns(
            {"default": spectrum, "as it is": as_it_is}, repeats, processor_seconds
        )
        factor = int(spectrum().resampled.max())
        resampling = f"resampled {factor}-fold" if factor > 1 else "not resampled"
        yield compared(
            DEFAULT_THEME, f"{name}: {resampling}", seconds["default"], seconds["as it is"],
            limit=DEFAULT_LIMIT if name == NOT_RESAMPLED else None,
        )  # fmt: skip
    seconds = take_turns({"ours": partial(shock_figures, hit.si, hit.sampling_rate_hz)}, repeats)
    yield beside(
        DEFAULT_THEME,
        "all figures that an ingest measures of that hit",
        seconds,
        "",
        "no peer, no promise",
    )


def _shipped_hit() -> Channel:
    folder = ROOT / "examples" / "modal-hammer-hit"
    channels, _ = read_channels(
        folder / "recordings" / "acceleration.lvm", read_campaign_file(folder).sensors
    )
    return next(channel for channel in channels if channel.quantity == "acceleration")


def _endaq(stack: ExitStack, folder: Path, record: Floats, lines: Floats) -> Program | str:
    """endaq in a process that lasts as long as `stack`; why not, where it cannot be."""
    python, file = interpreter_with("endaq"), folder / "endaq.npz"
    if python is None:
        return ABSENT
    np.savez(file, record=record, lines_hz=lines, rate_hz=RATE_HZ, damping_ratio=1 / (2 * Q))
    program = stack.enter_context(
        Program("-m", "benchmarks.peer_programs", "endaq", file, python=python)
    )
    try:
        program.seconds()
    except ProgramError as error:
        return str(error)
    return program


if __name__ == "__main__":
    sys.exit(report(measure_srs))
