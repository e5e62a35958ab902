"""`python -m benchmarks.srs`: shock response spectra from our peers and from us, on two processors, as Markdown.

50,000 samples of noise at 100 kHz, 80 lines from 10 Hz to 10 kHz, Q = 10. Ours are whole spectra: both signs, primary,
residual and pseudo velocity. The peers give the maximax while the record lasts, which is less work; pyyeti also with
more processes and as it comes, which raises the sampling rate for all lines. Compiling is left out: the first call of
each is not counted. The exit code is 1 where a peer's record is not the same to 1e-9, or pyyeti at its fastest is less
than 8 times slower. `spectra.py` gives the same as figures, and endaq beside it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.signals.srs.coefficients import absolute_acceleration
from pyroshock.signals.srs.spectrum import octave_grid, shock_response_spectrum
from pyroshock.signals.srs.threads import processors

from .measuring import Spread, interleaved, ratio

SAMPLES, RATE_HZ, LINES, Q, REPEATS = 50_000, 1e5, 80, 10.0, 45
PROMISED, PROCESSORS = 8.0, 2
#: Ways that are the same to the last digits, of which the fastest is to be beaten.
SAME = ("pyyeti", "pyyeti, processes")
APART = 1e-9

Way = Callable[[], Floats]


def noise(shape: tuple[int, ...]) -> Floats:
    return np.random.default_rng(0).normal(size=shape)


def ways(record: Floats, lines: Floats) -> Mapping[str, Way]:
    from pyyeti.srs import srs

    plain = partial(srs, record, RATE_HZ, lines, Q)
    return {
        "pyroshock": lambda: shock_response_spectrum(record, RATE_HZ, lines, q=Q).primary,
        "pyroshock, one thread": lambda: shock_response_spectrum(record, RATE_HZ, lines, q=Q, threads=1).primary,
        "pyyeti": partial(plain, rolloff="none", parallel="no"),
        "pyyeti, processes": partial(plain, rolloff="none", parallel="yes"),
        "pyyeti, as it comes": plain,
        "scipy lfilter": partial(filtered, record, lines),
    }


def filtered(record: Floats, lines: Floats) -> Floats:
    """One `lfilter` for each line."""
    from scipy.signal import lfilter

    printed = absolute_acceleration(2 * np.pi * lines, 1 / RATE_HZ, 1 / (2 * Q))
    return np.array([np.abs(lfilter(b, a, record)).max() for b, a in zip(printed.b.T, printed.a.T, strict=True)])


def row(name: str, taken: Mapping[str, list[float]], apart: float) -> str:
    spread = Spread.of(taken[name])
    cells = [
        spread.text(" ms", 1e3),
        f"{SAMPLES * LINES / spread.median / 1e9:.2f}",
        ratio(taken[name], taken["pyroshock"]).text(),
        f"{apart:.1g}",
    ]
    return f"| {name} | {' | '.join(cells)} |"


def broken(taken: Mapping[str, list[float]], apart: Mapping[str, float]) -> list[str]:
    """Promises not kept."""
    fastest = min(Spread.of(taken[name]).median for name in SAME)
    times = fastest / Spread.of(taken["pyroshock"]).median
    slow = [f"pyyeti at its fastest takes {times:.1f} times as long, not {PROMISED:g}"] * (times < PROMISED)
    return slow + [f"{name} is {apart[name]:.1g} apart" for name in (*SAME, "scipy lfilter") if apart[name] > APART]


def batch() -> str:
    """What one proposal of the twin asks for at once."""
    records, lines = noise((64, 10_000)), octave_grid(100.0, 10_000.0)
    many = {"batch": lambda: shock_response_spectrum(records, RATE_HZ, lines, q=Q)}
    spread = Spread.of(interleaved(many, REPEATS)["batch"])
    return f"64 records of 10,000 samples, {lines.size} lines: {spread.text(' ms', 1e3)}."


def differences(every: Mapping[str, Way]) -> dict[str, float]:
    """The largest of each way's lines from ours, relative."""
    ours = every["pyroshock"]()
    return {name: float(np.abs(way() / ours - 1).max()) for name, way in every.items()}


def two_processors() -> None:
    if processors() > PROCESSORS and hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:PROCESSORS])


def main() -> int:
    say = sys.stdout.write
    two_processors()
    every = ways(noise((SAMPLES,)), np.geomspace(10, 1e4, LINES))
    taken, apart = interleaved(every, REPEATS), differences(every)
    say("| way | 50,000 samples, 80 lines | 1e9 oscillator steps a second | times ours | apart |\n")
    say("| --- | --- | ---: | --- | ---: |\n")
    say("\n".join(row(name, taken, apart[name]) for name in every) + "\n")
    lost = broken(taken, apart)
    say(f"\n{batch()}\n\nnot kept: {'; '.join(lost) or 'nothing'}\n")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
