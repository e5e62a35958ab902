"""Force records of the virtual bench whose truth is known: ten hits each, some soon followed by a
second one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pyroshock.virtualbench.campaigns.hammer import (
    LOAD_CELL,
    PLATE_MATERIAL,
    RATE_HZ,
    RATIO,
    moments,
)
from pyroshock.virtualbench.campaigns.ringing import THICKNESS_M, add_pulse
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import hammer, hand_speed, target
from pyroshock.virtualbench.impact.strike import strike_many
from pyroshock.virtualbench.sensors import digitised

Floats = NDArray[np.float64]

HITS = 10
TIPS = (("aluminum", 0.030), ("delrin", 0.030), ("polyurethane", 0.015))
SPEEDS, ANVILS = ("low", "high"), (("none", "none"), ("steel", "polymeric"))
#: Every fourth hit is followed by another of this share of its speed, after so long (s).
EVERY, SHARE, DELAYS_S = 4, 0.35, (8e-3, 40e-3)


@dataclass(frozen=True)
class Hit:
    """`chatters`: the tip parted and touched again within the contact, which may or may not be
    called a second hit."""

    start_s: float
    contact_time_s: float
    followed: bool
    chatters: bool


@dataclass(frozen=True)
class ForceRecord:
    """Force (n,), newtons, as the recorder gives it, and what really happened."""

    force_n: Floats
    hits: list[Hit]
    rate_hz: float = RATE_HZ


def force_records(seed: int = 5) -> Iterator[ForceRecord]:
    """A recording for each tip, speed and anvil."""
    combinations = list(product(TIPS, SPEEDS, ANVILS))
    for choice, rng in zip(
        combinations, np.random.default_rng(seed).spawn(len(combinations)), strict=True
    ):
        yield _force_record(*choice, rng)


def _force_record(
    tip: tuple[str, float], level: str, anvil: tuple[str, str], rng: np.random.Generator
) -> ForceRecord:
    effects, followed = Effects.default(), np.arange(HITS) % EVERY == 1
    speeds = [hand_speed(level, effects, rng) for _ in range(HITS)]
    starts, duration = moments(HITS, rng)
    speeds += [SHARE * speeds[i] for i in np.flatnonzero(followed)]
    later = [starts[i] + float(rng.uniform(*DELAYS_S)) for i in np.flatnonzero(followed)]
    plate = target(PLATE_MATERIAL, THICKNESS_M, anvil_material=anvil[0], insulator=anvil[1])
    impacts = strike_many(
        [hammer(*tip)] * len(speeds), [plate] * len(speeds), effects, speeds, rng, tail_s=10e-3
    )
    force = np.zeros(round(duration * RATE_HZ))
    for impact, start in zip(impacts, [*starts, *later], strict=True):
        add_pulse(
            force, start, impact.time_s, impact.cell_force_n, LOAD_CELL, RATE_HZ, RATIO, effects
        )
    recorded = digitised(force, LOAD_CELL, RATE_HZ, effects, rng).astype(np.float64)
    truths = zip(starts, impacts, followed.tolist(), strict=False)
    return ForceRecord(
        recorded, [Hit(s, i.contact_time_s, again, i.contacts > 1) for s, i, again in truths]
    )
