"""Ways to a prescribed spectrum: the tuner, and an operator who changes one variable at a time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from pyroshock.array_types import Floats
from pyroshock.twin.setting import Setting
from pyroshock.twin.tune.goal import Forward, Goal, Refusals, level_db
from pyroshock.twin.tune.space import Amount, Mount, TuningSpace, mount_of
from pyroshock.twin.tune.tuner import FiredShots, tune

from .tuning_bench import Spoiled

#: A shot: the spectrum (f,) in m/s2, or how the record is spoiled.
Fire = Callable[[Setting], Floats | Spoiled]
MOST_SHOTS, MOST_OVAT = 3, 30


@dataclass(frozen=True, eq=False)
class Task:
    """All that a way may know: what is asked, what there is, what the bench refuses, how to fire."""

    goal: Goal
    space: TuningSpace
    refusals: Refusals
    fire: Fire


@dataclass
class Outcome:
    """The setting handed over, shots fired, seconds of each proposal, and whether a shot had shown it to be good."""

    setting: Setting
    shots: int
    seconds: list[float] = field(default_factory=list)
    shown: bool = False


def by_tuner(task: Task, forward: Forward, history: FiredShots, rng: np.random.Generator) -> Outcome:
    """Fire the best proposal until a shot meets the goal, three times at most; then hand over the best by then."""
    measured, seconds = history, []
    spoiled: list[tuple[Setting, Spoiled]] = []
    for shots in range(MOST_SHOTS + 1):
        begin = time.perf_counter()
        refusals = _and_spoiled(task.refusals, spoiled)
        found = tune(forward, task.space, task.goal, rng, measured=measured, refusals=refusals, extrapolate=True)
        seconds.append(time.perf_counter() - begin)
        best = found.proposals[0].setting
        if shots == MOST_SHOTS:
            break
        spectrum = task.fire(best)
        if isinstance(spectrum, str):
            spoiled.append((best, spectrum))
            continue
        measured = measured + FiredShots((best,), level_db(spectrum)[None])
        if task.goal.met(level_db(spectrum)):
            return Outcome(best, shots + 1, seconds, True)
    return Outcome(best, MOST_SHOTS, seconds)


def _and_spoiled(refusals: Refusals, spoiled: list[tuple[Setting, Spoiled]]) -> Refusals:
    """What clipped the record is not fired as hard again on the same mount, what did not hit not as softly."""

    def both(settings: Sequence[Setting]) -> list[tuple[str, ...]]:
        again = [tuple(why for other, why in spoiled if _worse(s, other, why)) for s in settings]
        return [a + b for a, b in zip(refusals(settings), again, strict=True)]

    return both


def _worse(setting: Setting, other: Setting, why: Spoiled) -> bool:
    assert setting.tank_pressure_pa is not None and other.tank_pressure_pa is not None
    if why == "silent":
        return setting.tank_pressure_pa <= 1.2 * other.tank_pressure_pa
    return mount_of(setting) == mount_of(other) and setting.tank_pressure_pa >= 0.8 * other.tank_pressure_pa


def by_one_variable(task: Task) -> Outcome:
    """Coordinate search from the middle: each variable in turn, keeping what brings more lines within.

    Numbers step by a ratio in the direction that helps, and by its root once no variable helps any more; words are
    tried one after the other. Thirty shots at most; what the bench refuses is not fired.
    """
    here = _middle(task)
    best, shots = _worth(task, here), 1
    ratio = 1.6
    while shots < MOST_OVAT and not best[0]:
        before = best
        for variable in _variables(task.space, ratio):
            for other in _tried(task, here, variable):
                if shots == MOST_OVAT or best[0]:
                    break
                shots += 1
                if (worth := _worth(task, other)) > best:
                    best, here = worth, other
        ratio = ratio if best > before else float(np.sqrt(ratio))
    return Outcome(here, shots, shown=best[0])


Worth = tuple[bool, float, float]
Variable = Callable[[Setting], Iterator[Setting]]


def _middle(task: Task) -> Setting:
    """Of the permitted settings of the middle mount the one in the middle of pressures and masses."""
    space = task.space
    mount = Mount(space.tips[len(space.tips) // 2], space.tip_radii_m[len(space.tip_radii_m) // 2], None, "none",
                  space.impact_positions[0])  # fmt: skip
    mass = float(np.median(space.impactor_mass_kg.grid(3)))
    settings = [space.setting(mount, p, mass) for p in space.tank_pressure_pa.grid(21)]
    order = sorted(range(21), key=lambda i: abs(i - 10))
    allowed = task.refusals(settings)
    return next(settings[i] for i in order if not allowed[i])


def _worth(task: Task, setting: Setting) -> Worth:
    """Met; share of lines within; minus the mean error (dB). A spoiled record is worth nothing."""
    spectrum = task.fire(setting)
    if isinstance(spectrum, str):
        return False, 0.0, -np.inf
    levels = level_db(spectrum)
    share = float(np.mean(task.goal.margin_db(levels) >= 0))
    return bool(task.goal.met(levels)), share, -float(np.mean(np.abs(levels - task.goal.level_db)))


def _tried(task: Task, setting: Setting, variable: Variable) -> list[Setting]:
    others = [other for other in variable(setting) if other != setting]
    return (
        [other for other, refused in zip(others, task.refusals(others), strict=True) if not refused] if others else []
    )


def _variables(space: TuningSpace, ratio: float) -> list[Variable]:
    """Pressure, mass, tip, radius, layers, position."""

    def amounts(setting: Setting, pressure: float, mass: float) -> Setting:
        assert setting.tank_pressure_pa is not None
        return replace(
            setting,
            tank_pressure_pa=float(np.clip(setting.tank_pressure_pa * pressure, *_ends(space.tank_pressure_pa))),
            impactor_mass_kg=float(np.clip(setting.impactor_mass_kg * mass, *_ends(space.impactor_mass_kg))),
        )

    layers = dict.fromkeys((m.anvil, m.insulator) for m in space.mounts())
    return [
        lambda s: (amounts(s, r, 1.0) for r in (ratio, 1 / ratio)),
        lambda s: (replace(s, tip=tip) for tip in space.tips),
        lambda s: (replace(s, impact_position=p) for p in space.impact_positions),
        lambda s: (replace(s, anvil=a, insulator=i) for a, i in layers),
        lambda s: (amounts(s, 1.0, r) for r in (ratio, 1 / ratio)),
        lambda s: (replace(s, tip_radius_m=r) for r in space.tip_radii_m),
    ]


def _ends(amount: Amount) -> tuple[float, float]:
    ends: NDArray[np.float64] = amount.grid(2)
    return float(ends[0]), float(ends[-1])
