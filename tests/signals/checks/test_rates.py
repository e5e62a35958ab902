"""False alarms and hits over random records: force pulses, ringing accelerations, clean or with one
fault planted."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks import Contact, run_checks

CASES = 250
RATE_HZ = 51200.0
#: None seen in 250 puts the rate below 1.2 % with 95 % confidence (rule of three); one is let pass.
MOST_MISTAKES = 1
#: Noise and few samples are properties of a record, not faults that a clean one must be free of.
FAULTS = {"clipping", "saturation", "dropouts", "zero-shift", "double-hit"}


@dataclass
class Record:
    x: NDArray[np.float64]
    contact: Contact
    height: float
    noise: float
    quantity: str


def force(rng: np.random.Generator) -> Record:
    """A pulse sin^p, p from 1 to 2.5, 12 to 400 samples, 1 N to 10 kN, noise of 0.01 to 0.5 % of
    it."""
    n, width, first = 16384, int(rng.integers(12, 400)), int(rng.integers(200, 3000))
    height = float(10 ** rng.uniform(0, 4))
    noise = height * 10 ** rng.uniform(-4, -2.3)
    x = rng.normal(scale=noise, size=n) + rng.normal(scale=height)
    phase = (np.arange(width) + rng.random()) / width
    x[first : first + width] += height * np.sin(np.pi * np.minimum(phase, 1.0)) ** rng.uniform(
        1.0, 2.5
    )
    return Record(x, Contact(first, first + width // 2, first + width - 1), height, noise, "force")


def acceleration(rng: np.random.Generator) -> Record:
    """Five decaying modes, 200 Hz to 10 kHz, damping of 0.5 to 3 %, and noise."""
    n, first = 16384, int(rng.integers(200, 3000))
    t = np.arange(n - first) / RATE_HZ
    omega = 2 * np.pi * 10 ** rng.uniform(2.3, 4.0, size=5)
    modes = np.exp(-(10 ** rng.uniform(-2.3, -1.5, size=5)) * omega * t[:, None]) * np.sin(
        omega * t[:, None]
    )
    ring = modes @ rng.uniform(-1, 1, size=5)
    height = float(10 ** rng.uniform(1, 5))
    noise = height * 10 ** rng.uniform(-4, -2.3)
    x = rng.normal(scale=noise, size=n)
    x[first:] += height * ring / np.abs(ring).max()
    return Record(x, Contact(first, first + 10, first + 20), height, noise, "acceleration")


def digitised(record: Record, rng: np.random.Generator) -> Channel:
    """By a converter of 14 to 24 bits whose range is 1.05 to 10 times the largest sample."""
    full_scale = float(np.abs(record.x[np.isfinite(record.x)]).max()) * rng.uniform(1.05, 10.0)
    step = full_scale / 2 ** (int(rng.integers(14, 25)) - 1)
    unit = "N" if record.quantity == "force" else "m/s2"
    return Channel(
        Sensor("probe", record.quantity, unit), np.round(record.x / step) * step, RATE_HZ
    )


def clip(record: Record, rng: np.random.Generator) -> None:
    """At 50 to 85 % of the height, which leaves three samples or more of a force pulse at the
    rail."""
    rest = np.median(record.x)
    side = np.sign(record.x[np.abs(record.x - rest).argmax()] - rest)
    share = rng.uniform(0.5, 0.85)
    cut = np.minimum(side * (record.x - rest), share * record.height)
    record.x[:] = rest + side * cut


def lose(record: Record, rng: np.random.Generator) -> None:
    at = int(rng.integers(record.contact.first, record.contact.last + 1))
    record.x[at : at + int(rng.integers(1, 5))] = rng.choice([np.nan, np.inf, -np.inf])


def offset(record: Record, rng: np.random.Generator) -> None:
    """By 1.5 to 10 % of the height, from the contact's end on."""
    record.x[record.contact.last + 1 :] += (
        rng.choice([-1, 1]) * rng.uniform(0.015, 0.1) * record.height
    )


def hit_again(record: Record, rng: np.random.Generator) -> None:
    """8 to 80 % of the first, 0.3 to 60 ms after its end."""
    first, last = record.contact.first, record.contact.last
    width = last - first + 1
    start = last + int(RATE_HZ * rng.uniform(0.3e-3, 60e-3))
    record.x[start : start + width] += (
        rng.uniform(0.08, 0.8) * record.height * np.sin(np.pi * np.arange(width) / width)
    )


def stand_still(record: Record, rng: np.random.Generator) -> None:
    """At zero deflection for 30 to 200 samples of the rest after the shock, in noise that every
    converter resolves."""
    record.x += rng.normal(scale=0.01 * record.height, size=record.x.size)
    at = int(rng.integers(12000, 15000))
    record.x[at : at + int(rng.integers(30, 200))] = np.median(record.x)


@pytest.fixture(scope="module")
def made_once():
    """Gives a record, and the generator that goes on after it: each is made once, and copied for
    every fault that is planted in it."""

    @cache
    def made(make, seed: int) -> tuple[Record, np.random.Generator]:
        rng = np.random.default_rng(seed)
        return make(rng), rng

    return lambda make, seed: deepcopy(made(make, seed))


def found(made_once, make, seed: int, plant=None) -> set[str]:
    record, rng = made_once(make, seed)
    if plant is not None:
        plant(record, rng)
    return {f.check for f in run_checks(digitised(record, rng), (record.contact,))} & FAULTS


@pytest.mark.parametrize("make", [force, acceleration])
def test_clean_records_raise_no_alarm(made_once, make):
    alarms = {seed: checks for seed in range(CASES) if (checks := found(made_once, make, seed))}
    assert len(alarms) <= MOST_MISTAKES, alarms


@pytest.mark.parametrize(
    ("make", "plant", "check"),
    [
        (force, clip, "clipping"),
        (acceleration, lose, "dropouts"),
        (force, lose, "dropouts"),
        (force, stand_still, "dropouts"),
        (acceleration, stand_still, "dropouts"),
        (force, offset, "zero-shift"),
        (acceleration, offset, "zero-shift"),
        (force, hit_again, "double-hit"),
    ],
    ids=lambda v: v if isinstance(v, str) else v.__name__,
)
def test_planted_fault_is_found(made_once, make, plant, check):
    missed = [seed for seed in range(CASES) if check not in found(made_once, make, seed, plant)]
    assert len(missed) <= MOST_MISTAKES, missed
