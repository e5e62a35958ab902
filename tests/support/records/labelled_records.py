"""Records whose faults are known because they were put in: made of NumPy alone, by nothing that the
checks use.

A kind is a function of `rng` to the channels of one recording; its verdict is what a person who
knows the fault would say: "ok" where every figure drawn from the record is right, "warning" where
some are doubtful (percents), "reject" where they are lost. Each record has its own rate, length,
height, noise, converter and time of the shock.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rng = np.random.Generator


@dataclass(frozen=True)
class Signal:
    """One channel in SI: samples (n,), and what campaign.toml would say of it."""

    name: str
    quantity: str
    samples: Floats
    range_si: float | None = None
    axis: str | None = None
    position: str = "plate"


@dataclass(frozen=True)
class Labelled:
    """One recording with its verdict; `origin` is "made" or the folder of a measured one."""

    kind: str
    verdict: str
    rate_hz: float
    signals: tuple[Signal, ...]
    origin: str = "made"


@dataclass
class _Shot:
    """A record in the making: where the shock begins, its height, and the deviation of its
    noise."""

    x: Floats
    rate_hz: float
    first: int
    width: int
    height: float
    noise: float


def _hit(rng: Rng, narrow: tuple[float, float] = (14, 300)) -> _Shot:
    """A contact force: a half sine to a power of 1 to 1.6, lopsided, 20 N to 20 kN."""
    n, first = int(rng.integers(6000, 20000)), int(rng.integers(700, 2500))
    width, height = int(np.exp(rng.uniform(*np.log(narrow)))), 10 ** rng.uniform(1.3, 4.3)
    phase = ((np.arange(width) + rng.random()) / width) ** rng.uniform(0.85, 1.15)
    x = np.zeros(n)
    x[first : first + width] = height * np.clip(np.sin(np.pi * phase), 0, None) ** rng.uniform(
        1, 1.6
    )
    return _Shot(
        x,
        rng.choice([20e3, 51.2e3, 102.4e3]),
        first,
        width,
        height,
        height * 10 ** rng.uniform(-4.3, -3),
    )


def _ring(rng: Rng, begin: int | None = None) -> _Shot:
    """Damped modes that build up within a few samples, 30 to 30,000 m/s2."""
    n = int(rng.integers(8000, 24000))
    first = int(rng.integers(800, 3000)) if begin is None else begin
    t, modes = np.arange(n - first), int(rng.integers(3, 9))
    omega = np.exp(rng.uniform(np.log(0.02), np.log(0.8), modes))
    decay = omega * 10 ** rng.uniform(-2.2, -1.2, modes) + 2e-4
    x = np.zeros(n)
    swing = np.exp(-decay * t[:, None]) * np.sin(omega * t[:, None] + rng.uniform(0, 6.28, modes))
    x[first:] = swing @ rng.normal(size=modes) * (1 - np.exp(-t / rng.uniform(1, 6)))
    height = 10 ** rng.uniform(1.5, 4.5)
    return _Shot(
        x * height / np.abs(x).max(),
        51.2e3,
        first,
        200,
        height,
        height * 10 ** rng.uniform(-4.3, -2.7),
    )


def _drop(rng: Rng) -> _Shot:
    """A drop table's pulse: a haversine or half sine with a slow foot, then a small rebound
    ripple."""
    n, first = int(rng.integers(5000, 16000)), int(rng.integers(1200, 2500))
    width, height = int(rng.integers(150, 1500)), 10 ** rng.uniform(2, 4)
    x = np.zeros(n)
    x[first : first + width] = height * np.sin(np.pi * np.arange(width) / width) ** rng.choice(
        [1, 2, 3]
    )
    t = np.arange(n - first - width)
    x[first + width :] += 0.02 * height * np.exp(-t / 150) * np.sin(0.1 * t)
    return _Shot(x, 20e3, first, width, height, height * 10 ** rng.uniform(-4.3, -3))


def _read(
    shot: _Shot, rng: Rng, quantity: str = "acceleration", top: float | None = None, **more: Any
) -> Labelled:
    """Through a converter of 14 to 24 bits; `top` is a level in SI at which it ends."""
    x = shot.x + rng.normal(size=shot.x.size) * shot.noise
    if top is not None:
        x = np.clip(x, -top, top)
    full = np.nanmax(np.abs(x[np.isfinite(x)])) * (1.0 if top is not None else rng.uniform(1.1, 6))
    step = full / 2 ** (int(rng.integers(14, 25)) - 1)
    return Labelled(
        "", "", shot.rate_hz, (Signal("probe", quantity, np.round(x / step) * step, **more),)
    )


def good_hit(rng: Rng) -> Labelled:
    return _read(_hit(rng), rng, "force")


def good_ring(rng: Rng) -> Labelled:
    return _read(_ring(rng), rng)


def good_drop(rng: Rng) -> Labelled:
    return _read(_drop(rng), rng)


def slow_pulse(rng: Rng) -> Labelled:
    """A bell-shaped pulse of which the record lacks the first 0.5 to 4 % of the peak."""
    width, height = int(rng.integers(40, 300)), 10 ** rng.uniform(1.7, 3.5)
    t = np.arange(width * int(rng.integers(20, 200))) - width * np.sqrt(
        2 * np.log(1 / rng.uniform(0.005, 0.04))
    )
    x = height * np.exp(-((t / width) ** 2) / 2)
    return _read(_Shot(x, 10e3, 0, width, height, height * 10 ** rng.uniform(-4.3, -3.3)), rng)


def slow_force(rng: Rng) -> Labelled:
    """A contact that grows and fades exponentially, as of foam."""
    width, height = int(rng.integers(50, 800)), 10 ** rng.uniform(1.7, 3.5)
    t = np.arange(int(width * rng.uniform(12, 60))) - width * rng.uniform(3.2, 5)
    x = height / np.cosh(np.clip(1.3 * t / width, -50, 50))
    return _read(
        _Shot(x, 51.2e3, 0, width, height, height * 10 ** rng.uniform(-4.3, -3.5)), rng, "force"
    )


def good_below_range(rng: Rng) -> Labelled:
    shot = _hit(rng)
    return _read(shot, rng, "force", range_si=shot.height * rng.uniform(1.05, 5))


def free_plate(rng: Rng) -> Labelled:
    """It keeps the velocity that the pulse gave it."""
    shot = _ring(rng)
    shot.x[shot.first : shot.first + 40] += 0.4 * shot.height
    return _read(shot, rng)


def gravity(rng: Rng) -> Labelled:
    """A sensor that responds to DC, one way up or the other, on a shock of 15 g and more."""
    shot = _drop(rng)
    shot.x += rng.choice([-9.80665, 9.80665])
    return _read(shot, rng)


def tank(rng: Rng) -> Labelled:
    """A tank's pressure: constant, or until the valve opens."""
    n, level = 20000, rng.uniform(0.2e5, 6e5)
    t, at = np.arange(n), int(rng.uniform(0.2, 0.7) * n)
    after = rng.choice([0.0, 1.0]) * rng.uniform(0.1, 0.9)
    x = level * (
        1 - after * (t > at) * (1 - np.exp(-np.maximum(t - at, 0) / rng.uniform(100, 3000)))
    )
    x += level * rng.choice([0.0, 1e-4, 2e-3]) * np.sin(2 * np.pi * 50 * t / 51200)
    return _read(
        _Shot(x, 51.2e3, at, 1, level, level * rng.choice([1e-6, 1e-4, 1e-3])), rng, "pressure"
    )


def quiet_axis(rng: Rng) -> Labelled:
    """A hit, and three axes of one sensor on what was hit: one takes the shock, one hardly
    moves."""
    shot = _ring(rng)
    loud = _read(shot, rng).signals[0].samples
    shares = (1.0, rng.uniform(0.2, 0.6), 0.0)
    noise = shot.height * rng.uniform(0.002, 0.01)
    names = zip("xyz", rng.permutation(3), strict=True)
    signals = [
        Signal(
            f"a{axis}",
            "acceleration",
            loud * shares[i] + rng.normal(size=loud.size) * noise * (i == 2),
            axis=axis,
        )
        for axis, i in names
    ]
    force = np.zeros(loud.size)
    force[shot.first : shot.first + 60] = 1000 * np.sin(np.pi * np.arange(60) / 60)
    force += rng.normal(size=force.size) * rng.uniform(0.05, 0.5)
    return Labelled("", "", shot.rate_hz, (Signal("force", "force", force), *signals))


def noisy(rng: Rng) -> Labelled:
    shot = _hit(rng) if rng.random() < 0.5 else _ring(rng)
    shot.noise = shot.height * rng.uniform(0.025, 0.08)
    return _read(shot, rng, "force" if shot.x.min() >= 0 else "acceleration")


def shifted(rng: Rng) -> Labelled:
    shot = _ring(rng)
    shot.x[shot.first + 5 :] += rng.choice([-1, 1]) * rng.uniform(0.02, 0.15) * shot.height
    return _read(shot, rng)


def shifted_force(rng: Rng) -> Labelled:
    shot = _hit(rng)
    shot.x[shot.first + shot.width :] += rng.choice([-1, 1]) * rng.uniform(0.015, 0.1) * shot.height
    return _read(shot, rng, "force")


def hit_twice(rng: Rng) -> Labelled:
    shot = _hit(rng)
    start = shot.first + shot.width + int(rng.uniform(1e-3, 50e-3) * shot.rate_hz)
    again = np.sin(np.pi * np.arange(shot.width) / shot.width) * rng.uniform(0.1, 0.7) * shot.height
    room = shot.x[start : start + shot.width]
    room += again[: room.size]
    return _read(shot, rng, "force")


def few_samples(rng: Rng) -> Labelled:
    shot = _hit(rng, (14, 15))
    shot.x = np.roll(shot.x, int(rng.integers(0, 5)))[::5].copy()
    shot.x = np.concatenate([np.zeros(400), shot.x])
    return _read(shot, rng, "force")


def rests_high(rng: Rng) -> Labelled:
    shot = _ring(rng)
    shot.x *= max(1.0, 2000 / shot.height)
    shot.height = float(np.abs(shot.x).max())
    shot.x += rng.choice([-1, 1]) * rng.uniform(0.07, 0.17) * shot.height
    return _read(shot, rng)


def clipped_hit(rng: Rng) -> Labelled:
    shot = _hit(rng, (20, 300))
    return _read(shot, rng, "force", top=rng.uniform(0.5, 0.9) * shot.height)


def clipped_ring(rng: Rng) -> Labelled:
    shot = _ring(rng)
    return _read(shot, rng, top=rng.uniform(0.4, 0.8) * shot.height)


def short_top(rng: Rng) -> Labelled:
    """A fast pulse of which two samples stand at the rail, in a fine converter."""
    while True:
        shot = _hit(rng, (8, 14))
        shot.noise = shot.height * 1e-5
        made = _read(shot, rng, top=rng.uniform(0.8, 0.93) * shot.height)
        x = made.signals[0].samples
        if np.count_nonzero(x >= x.max()) == 2:
            return made


def at_full_scale(rng: Rng) -> Labelled:
    shot = _drop(rng)
    top = rng.uniform(0.6, 0.95) * shot.height
    return _read(shot, rng, top=top, range_si=top)


def pressed(rng: Rng) -> Labelled:
    """An amplifier's rail before the converter, with the converter's noise."""
    shot = _hit(rng, (80, 300))
    shot.x = np.minimum(shot.x, rng.uniform(0.5, 0.75) * shot.height)
    shot.noise = shot.height * 10 ** rng.uniform(-3.3, -2.9)
    return _read(shot, rng, "force")


def lost_samples(rng: Rng) -> Labelled:
    shot = _hit(rng)
    at = shot.first + shot.width // 2 + int(rng.integers(-3, 3))
    shot.x[at : at + int(rng.integers(1, 5))] = np.nan
    return _read(shot, rng, "force")


def dead(rng: Rng) -> Labelled:
    level = rng.choice([0.0, 1.0]) * rng.uniform(-50, 50)
    return Labelled("", "", 51.2e3, (Signal("probe", "acceleration", np.full(9000, level)),))


def only_noise(rng: Rng) -> Labelled:
    """White, low-passed, or mains hum with noise."""
    n, height = int(rng.integers(3000, 30000)), 10 ** rng.uniform(-1, 3)
    x = rng.normal(size=n + 64)
    x = np.convolve(x, np.ones(length := int(rng.choice([1, 3, 10]))), "full")[length : n + length]
    x = height * x / x.std() + height * rng.choice([0, 0, 3]) * np.sin(
        2 * np.pi * 50 / 51200 * np.arange(n)
    )
    return _read(_Shot(x, 51.2e3, 0, 1, height, 0.0), rng)


def noise_on_force(rng: Rng) -> Labelled:
    return _read(_Shot(np.zeros(15000), 51.2e3, 0, 1, 1.0, 10 ** rng.uniform(-1, 1)), rng, "force")


def tail(rng: Rng) -> Labelled:
    """The recorder started late: a tenth to a half of the ringing is gone."""
    shot = _ring(rng, begin=0)
    swing = np.abs(shot.x)
    late = int(np.flatnonzero(swing > rng.uniform(0.3, 0.7) * swing.max())[-1])
    shot.x = shot.x[late - int(rng.integers(0, 10)) :] if late > 20 else shot.x[20:]
    shot.noise = float(np.abs(shot.x).max()) * 10 ** rng.uniform(-4, -2.7)
    return _read(shot, rng)


def rests_far_off(rng: Rng) -> Labelled:
    shot = _ring(rng)
    shot.x *= max(1.0, 500 / shot.height)
    shot.height = float(np.abs(shot.x).max())
    shot.x += rng.choice([-1, 1]) * rng.uniform(0.22, 1.58) * shot.height
    return _read(shot, rng)


def cut_by_the_end(rng: Rng) -> Labelled:
    shot = _hit(rng, (40, 300))
    shot.x = shot.x[: shot.first + int(shot.width * rng.uniform(0.5, 0.8))]
    return _read(shot, rng, "force")


KINDS: dict[str, tuple[Callable[[Rng], Labelled], ...]] = {
    "ok": (
        good_hit,
        good_ring,
        good_drop,
        slow_pulse,
        slow_force,
        good_below_range,
        free_plate,
        gravity,
        tank,
        quiet_axis,
    ),
    "warning": (noisy, shifted, shifted_force, hit_twice, few_samples, rests_high),
    "reject": (
        *(
            clipped_hit,
            clipped_ring,
            short_top,
            at_full_scale,
            pressed,
            lost_samples,
            dead,
            only_noise,
        ),
        *(noise_on_force, tail, rests_far_off, cut_by_the_end),
    ),
}


def made_records(seed: int, each: int) -> Iterator[Labelled]:
    """`each` records of every kind."""
    for verdict, kinds in KINDS.items():
        for kind in kinds:
            rng = np.random.default_rng([seed, *kind.__name__.encode()])
            for _ in range(each):
                made = kind(rng)
                yield Labelled(kind.__name__, verdict, made.rate_hz, made.signals)
