"""`python -m benchmarks.gun`: 10,000 gun shots with three effects beside scipy, in one run.

The peer is the same physics as plain scalar functions, one shot after the other through
`solve_ivp`: the fastest of its methods, each at the loosest tolerance with which its own velocities
hold to 1e-6. It fires a hundredth of the shots; its time for all of them is a hundred times that.
Times are of the processor, one core on both sides. The limit: as many evaluations of the rates as
the peer's thriftiest method needs, at what one of a whole batch costs us.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.twin.gun.chambers import Chamber, TwoChambers
from pyroshock.twin.gun.effects.back_pressure import BackPressure
from pyroshock.twin.gun.effects.barrel_loss import BarrelLoss
from pyroshock.twin.gun.effects.blow_by import BlowBy
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.shot import GunEffect, nominal_shot
from pyroshock.twin.gun.shots import gun_velocity

from .harness import Figure, beside, processor_seconds, report, take_turns
from .shared_records import THESIS_GUN, Method, ScalarGun, scalar_guns

Floats = NDArray[np.float64]
Case = Callable[[int, np.random.Generator], tuple[Floats, Floats, list[GunEffect]]]

THEME = "Gun shots in one call, beside solve_ivp shot by shot"
SHOTS, PEER_SHARE, REPEATS = 10_000, 100, 5
ACCURACY, LIMIT = 1e-6, 1 / 100
EXACT: tuple[Method, float] = ("LSODA", 1e-10)
METHODS: tuple[Method, ...] = ("RK45", "DOP853", "LSODA")
STIFF: tuple[Method, ...] = ("LSODA",)
TOLERANCES = (1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9, 1e-9, 1e-10)
#: Evaluations of the rates that are measured together.
EVALUATIONS = 20


def three_effects(n: int, rng: np.random.Generator) -> tuple[Floats, Floats, list[GunEffect]]:
    """Pressures, masses and effects that differ from shot to shot: the atmosphere, leakage, losses
    in the barrel."""
    effects = [
        BackPressure(rng.uniform(95e3, 103e3, n)),
        BlowBy(rng.uniform(0.3, 1.0, n), rng.uniform(0.0, 1e-3, n)),
        BarrelLoss(rng.uniform(0.01, 0.1, n), rng.uniform(0.5, 5.0, n)),
    ]
    return rng.uniform(0.5e5, 10e5, n), rng.uniform(0.1, 2.0, n), effects


def with_valve(n: int, rng: np.random.Generator) -> tuple[Floats, Floats, list[GunEffect]]:
    """The same with a valve in place of the barrel's losses: the costliest three."""
    pressure, mass, effects = three_effects(n, rng)
    return (
        pressure,
        mass,
        [effects[0], ValveFlow(rng.uniform(0.5, 5.0, n), rng.uniform(0.02, 0.2, n)), effects[1]],
    )


@dataclass(frozen=True)
class Solver:
    """What holds 1e-6 at its loosest tolerance; `evaluations` of the rates for a shot."""

    seconds: float
    method: Method
    rtol: float
    evaluations: float


def figure(
    case: Case, name: str, shots: int = SHOTS, repeats: int = REPEATS, limit: float | None = None
) -> Figure:
    """Both on one case. Raises `ValueError` where velocities are not the exact ones to 1e-6."""
    pressure, mass, effects = case(shots, np.random.default_rng(1))
    rows = np.arange(max(shots // PEER_SHARE, 3))
    guns = scalar_guns(
        THESIS_GUN, pressure[rows], mass[rows], [effect.take(rows) for effect in effects]
    )
    exact = np.array([gun.velocity(*EXACT) for gun in guns])
    # Behind a valve the explicit methods take minutes.
    solvers = [
        s
        for method in (STIFF if case is with_valve else METHODS)
        if (s := _loosest(guns, exact, method))
    ]
    solver, needed = min(solvers, key=lambda s: s.seconds), min(s.evaluations for s in solvers)
    fire = partial(gun_velocity, THESIS_GUN, pressure, mass, effects)
    difference = float(np.max(np.abs(fire().velocity_m_s[rows] / exact - 1)))
    if not difference <= ACCURACY:
        raise ValueError(
            f"{name}: velocities {difference:.1g} apart; expected at most {ACCURACY:g}"
        )
    peer = f"solve_ivp loop, {solver.method} at {solver.rtol:g}"
    functions: dict[str, Callable[[], object]] = {
        "ours": fire,
        peer: lambda: [gun.velocity(solver.method, solver.rtol) for gun in guns],
        "bound": evaluated(pressure, mass, effects),
    }
    shares = {"ours": 1, peer: shots / len(rows), "bound": needed / EVALUATIONS}
    taken = take_turns(functions, repeats, processor_seconds)
    return beside(
        THEME, f"{shots:,} shots with {name}",
        {k: [shares[k] * s for s in taken[k]] for k in taken}, peer, unit="s",
        limit=limit, question="a batch of gun shots" if limit else "",
        bound=f"{needed:.0f} evaluations of the rates of each shot, as the thriftiest of scipy's "
        f"methods needs them (velocities within {difference:.1g})",
    )  # fmt: skip


def _loosest(guns: Sequence[ScalarGun], exact: Floats, method: Method) -> Solver | None:
    for rtol in TOLERANCES:
        begin = time.process_time()
        solved = [gun.solved(method, rtol) for gun in guns]
        seconds = time.process_time() - begin
        if np.max(np.abs(np.array([velocity for velocity, _ in solved]) / exact - 1)) <= ACCURACY:
            return Solver(seconds, method, rtol, float(np.mean([count for _, count in solved])))
    return None


def evaluated(pressure: Floats, mass: Floats, effects: Sequence[GunEffect]) -> Callable[[], object]:
    """`EVALUATIONS` of the rates of all shots, as they start: what a step cannot do without."""
    shot = nominal_shot(THESIS_GUN, pressure, mass)
    for effect in effects:
        shot = effect.prepare(shot)
    chamber = (TwoChambers if np.isfinite(shot.valve_area_m2).any() else Chamber)(shot, [])
    start, instant = chamber.start(), np.zeros(len(shot))
    return lambda: [chamber.rates(instant, start) for _ in range(EVALUATIONS)]


def measure_gun(_folder: Path, shots: int = SHOTS, valve_share: int = 20) -> Iterator[Figure]:
    """Both cases; the one with a valve, which is stiff, with a share of the shots."""
    yield figure(three_effects, "atmosphere, leakage and losses in the barrel", shots, limit=LIMIT)
    yield figure(with_valve, "a valve, atmosphere and leakage", shots // valve_share, repeats=3)


if __name__ == "__main__":
    sys.exit(report(measure_gun))
