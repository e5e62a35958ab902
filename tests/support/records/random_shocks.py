"""Random shocks as formulas of time, sampled at any rate: bursts, pulses that ring, noise in
bands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.signals.srs.spectrum import shock_response_spectrum

RATE_HZ = 20_000.0
NYQUIST_HZ = RATE_HZ / 2
#: The rate of the truth over that of the record.
FINER = 64
KINDS = (
    "burst",
    "several bursts",
    "half sine with ringing",
    "band under a bell",
    "band that decays",
)
#: Standard deviations of a burst's spectrum between its centre and the nearer end of the band.
_IN_BAND = 4.5

Formula = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class RandomShock:
    """`acceleration` (m/s2) of time (s) from 0 to `duration_s`, at rest at both ends."""

    kind: str
    duration_s: float
    acceleration: Formula

    def record(self, times: int = 1) -> Floats:
        """Samples at `times` the rate, both ends included."""
        samples = int(self.duration_s * RATE_HZ) * times + 1
        return self.acceleration(np.arange(samples) / (RATE_HZ * times))

    def maximax(self, lines_hz: Floats, q: float) -> Floats:
        """The true spectrum, of the record at the finer rate."""
        fine = shock_response_spectrum(
            self.record(FINER), FINER * RATE_HZ, lines_hz, q=q, resample_within=None
        )
        return fine.maximax


def random_shock(rng: np.random.Generator) -> RandomShock:
    """Any of the kinds, centred at .05 to .95 of half the sampling rate; every sixth or so spills
    over it."""
    number, duration_s = int(rng.integers(len(KINDS))), float(rng.uniform(0.03, 0.12))
    makers = (_one_burst, _bursts, _ringing_pulse, _band_under_bell, _decaying_band)
    return RandomShock(KINDS[number], duration_s, makers[number](rng, duration_s))


def random_lines(rng: np.random.Generator, duration_s: float, count: int = 6) -> Floats:
    """Lines from one cycle in the record up to ten samples a cycle, every third time up to two and
    a half."""
    highest = RATE_HZ / 10 if rng.random() < 0.7 else 0.4 * RATE_HZ
    return np.sort(np.exp(rng.uniform(np.log(1 / duration_s), np.log(highest), count)))


def _burst(rng: np.random.Generator, duration_s: float) -> Formula:
    centre = rng.uniform(0.05, 0.95) * NYQUIST_HZ
    to_edge = min(NYQUIST_HZ - centre, centre) / _IN_BAND
    width = to_edge * (rng.uniform(1, 4) if rng.random() < 0.15 else 10 ** rng.uniform(-0.7, 0))
    bell_s = 1 / (2 * np.pi * max(width, 6 / (2 * np.pi * duration_s)))
    middle = rng.uniform(
        min(5 * bell_s, duration_s / 2), max(duration_s - 5 * bell_s, duration_s / 2)
    )
    phase, size = rng.uniform(0, 2 * np.pi), 10 ** rng.uniform(-0.5, 0.5)
    return lambda t: (
        size
        * np.exp(-(((t - middle) / bell_s) ** 2) / 2)
        * np.sin(2 * np.pi * centre * (t - middle) + phase)
    )


def _one_burst(rng: np.random.Generator, duration_s: float) -> Formula:
    return _burst(rng, duration_s)


def _bursts(rng: np.random.Generator, duration_s: float) -> Formula:
    bursts = [_burst(rng, duration_s) for _ in range(rng.integers(2, 6))]
    return lambda t: np.sum([burst(t) for burst in bursts], axis=0)


def _ringing_pulse(rng: np.random.Generator, duration_s: float) -> Formula:
    """Its slope jumps where the pulse and the modes begin: content falls by 12 dB an octave and
    passes any rate."""
    pulse_s, begin_s = rng.uniform(8, 60) / RATE_HZ, rng.uniform(0.1, 0.3) * duration_s
    modes = [
        (
            2 * np.pi * rng.uniform(0.05, 0.5) * NYQUIST_HZ,
            rng.uniform(0.005, 0.05),
            rng.uniform(-1, 1),
        )
        for _ in range(rng.integers(1, 5))
    ]

    def acceleration(t: Floats) -> Floats:
        since = np.maximum(t - begin_s, 0.0)
        pulse = np.where(since < pulse_s, np.sin(np.pi * since / pulse_s), 0.0)
        return pulse + sum(
            size * np.exp(-zeta * omega * since) * np.sin(omega * since)
            for omega, zeta, size in modes
        )

    return acceleration


def _band(rng: np.random.Generator, lowest: float, widest: float) -> Formula:
    low = rng.uniform(0.03, lowest) * NYQUIST_HZ
    high = min(low * rng.uniform(1.05, widest), 0.95 * NYQUIST_HZ)
    lines, phases = (
        rng.uniform(*ends, rng.integers(5, 60)) for ends in ((low, high), (0, 2 * np.pi))
    )
    return lambda t: np.sum(
        [
            np.sin(2 * np.pi * f * t + phase)
            for f, phase in zip(lines, np.resize(phases, lines.size), strict=True)
        ],
        axis=0,
    )


def _band_under_bell(rng: np.random.Generator, duration_s: float) -> Formula:
    band = _band(rng, 0.85, 3.0)
    return lambda t: np.sin(np.pi * np.clip(t / duration_s, 0, 1)) ** 2 * band(t)


def _decaying_band(rng: np.random.Generator, duration_s: float) -> Formula:
    band, begin_s, rise_s = (
        _band(rng, 0.7, 4.0),
        0.1 * duration_s,
        rng.uniform(0.03, 0.12) * duration_s,
    )

    def acceleration(t: Floats) -> Floats:
        since = np.maximum(t - begin_s, 0.0) / rise_s
        return since**4 * np.exp(-4 * since) * band(t)

    return acceleration
