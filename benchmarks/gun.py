"""`python -m benchmarks.gun [CASE…]`: 10,000 gun shots with three effects beside scipy, in one run.

The peer is the same physics as plain scalar functions, one shot after the other through `solve_ivp`: the fastest of
its methods, each at the loosest tolerance with which its own velocities hold to 1e-6. It fires some of the shots;
its time for all of them is that times their share. Times are of the processor, one core on both sides, so that what
else runs does not count. The limit: as many evaluations of the rates as the peer's thriftiest method needs, at what one
of a whole batch costs us.
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

from .apart import busy_seconds_of, in_turn
from .figures import Figure
from .gun_scalar import THESIS_GUN, Method, ScalarGun, scalar_guns
from .measuring import Spread, ratio

Floats = NDArray[np.float64]
THEME = "Gun shots in one call, beside solve_ivp shot by shot"
SHOTS, PEER_SHOTS, REPEATS = 10_000, 100, 5
ACCURACY = 1e-6
FASTER = 100.0
EXACT: tuple[Method, float] = ("LSODA", 1e-10)
METHODS: tuple[Method, ...] = ("RK45", "DOP853", "LSODA")
STIFF: tuple[Method, ...] = ("LSODA",)
TOLERANCES = (1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9, 1e-9, 1e-10)


def three_effects(n: int, rng: np.random.Generator) -> tuple[Floats, Floats, list[GunEffect]]:
    """Pressures, masses and effects that differ from shot to shot: the atmosphere, leakage, losses in the barrel."""
    effects = [
        BackPressure(rng.uniform(95e3, 103e3, n)),
        BlowBy(rng.uniform(0.3, 1.0, n), rng.uniform(0.0, 1e-3, n)),
        BarrelLoss(rng.uniform(0.01, 0.1, n), rng.uniform(0.5, 5.0, n)),
    ]
    return rng.uniform(0.5e5, 10e5, n), rng.uniform(0.1, 2.0, n), effects


def with_valve(n: int, rng: np.random.Generator) -> tuple[Floats, Floats, list[GunEffect]]:
    """The same with a valve, for leakage: the costliest three."""
    pressure, mass, effects = three_effects(n, rng)
    return pressure, mass, [effects[0], ValveFlow(rng.uniform(0.5, 5.0, n), rng.uniform(0.02, 0.2, n)), effects[1]]


Case = Callable[[int, np.random.Generator], tuple[Floats, Floats, list[GunEffect]]]


@dataclass(frozen=True)
class Peer:
    """What holds 1e-6 in the least time; `evaluations` a shot of whichever method holds it with the fewest."""

    seconds: float
    method: Method
    rtol: float
    evaluations: float


@dataclass(frozen=True)
class Race:
    """Seconds for all shots in turn, ours, the peer's and the limit's; greatest relative difference of velocities."""

    ours: Sequence[float]
    peer: Sequence[float]
    limit: Sequence[float]
    by: Peer
    difference: float

    @property
    def factor(self) -> float:
        return ratio(self.peer, self.ours).median


def race(case: Case, seed: int = 1, shots: int = SHOTS, peer_shots: int = PEER_SHOTS, repeats: int = REPEATS) -> Race:
    """Both on one case. Behind a valve the explicit methods take minutes, and are not tried."""
    pressure, mass, effects = case(shots, np.random.default_rng(seed))
    rows = np.arange(peer_shots)
    guns = scalar_guns(THESIS_GUN, pressure[rows], mass[rows], [effect.take(rows) for effect in effects])
    exact = np.array([gun.velocity(*EXACT) for gun in guns])
    by = quickest(guns, exact, STIFF if case is with_valve else METHODS)
    fire = partial(gun_velocity, THESIS_GUN, pressure, mass, effects)
    rates = evaluated(pressure, mass, effects)
    difference = float(np.max(np.abs(fire().velocity_m_s[rows] / exact - 1)))
    rates()
    ways: dict[str, Callable[[], object]] = {
        "ours": fire,
        "peer": partial(fired, guns, by.method, by.rtol),
        "rates": rates,
    }
    taken = in_turn({name: partial(busy_seconds_of, way) for name, way in ways.items()}, repeats)
    peer = [seconds * shots / peer_shots for seconds in taken["peer"]]
    return Race(taken["ours"], peer, [seconds / EACH * by.evaluations for seconds in taken["rates"]], by, difference)


#: Evaluations of the rates that are timed together.
EACH = 20


def evaluated(pressure: Floats, mass: Floats, effects: Sequence[GunEffect]) -> Callable[[], object]:
    """`EACH` evaluations of the rates of all shots, as they start: what a step cannot do without."""
    shot = nominal_shot(THESIS_GUN, pressure, mass)
    for effect in effects:
        shot = effect.prepare(shot)
    kind = TwoChambers if np.isfinite(shot.valve_area_m2).any() else Chamber
    chamber = kind(shot, [])
    start, instant = chamber.start(), np.zeros(len(shot))
    return lambda: [chamber.rates(instant, start) for _ in range(EACH)]


def fired(guns: Sequence[ScalarGun], method: Method, rtol: float) -> Floats:
    return np.array([gun.velocity(method, rtol) for gun in guns])


def quickest(guns: Sequence[ScalarGun], exact: Floats, methods: Sequence[Method]) -> Peer:
    """The quickest method at the loosest tolerance with which it holds 1e-6."""
    held = [found for method in methods if (found := _loosest(guns, exact, method))]
    least = min(found.evaluations for found in held)
    first = min(held, key=lambda found: found.seconds)
    return Peer(first.seconds, first.method, first.rtol, least)


def _loosest(guns: Sequence[ScalarGun], exact: Floats, method: Method) -> Peer | None:
    """Found on the way from loose to tight."""
    for rtol in TOLERANCES:
        begin = time.process_time()
        found = [gun.solved(method, rtol) for gun in guns]
        seconds = time.process_time() - begin
        velocity = np.array([v for v, _ in found])
        if np.max(np.abs(velocity / exact - 1)) <= ACCURACY:
            return Peer(seconds, method, rtol, float(np.mean([count for _, count in found])))
    return None


def measure_gun(
    _folder: Path, full: bool = False, shots: int = SHOTS, peer_shots: int = PEER_SHOTS
) -> Iterator[Figure]:
    """Both cases; the one with a valve, which is stiff, with fewer shots unless `full`."""
    valve_shots, valve_peers = (shots, peer_shots) if full else (shots // 20, peer_shots // 20)
    yield figure(race(three_effects, shots=shots, peer_shots=peer_shots), f"{shots:,} shots with {THREE}", FASTER)
    stiff = race(with_valve, shots=valve_shots, peer_shots=valve_peers, repeats=3)
    yield figure(stiff, f"{valve_shots:,} shots with {VALVE}", None)


THREE, VALVE = "atmosphere, leakage and losses in the barrel", "a valve, atmosphere and leakage"


def figure(found: Race, name: str, promised: float | None) -> Figure:
    by, difference = found.by, found.difference
    if not difference <= ACCURACY:
        raise ValueError(f"{name}: velocities {difference:.1g} apart; expected at most {ACCURACY:g}")
    nature = (
        f"{by.evaluations:.0f} evaluations of the rates of each shot, as the thriftiest of scipy's methods needs them "
        f"(velocities within {difference:.1g})"
    )
    peer = f"{Spread.of(found.peer).text(' s')}, {by.method} at {by.rtol:g}"
    return Figure(
        THEME, name, Spread.of(found.ours).text(" s"), peer,
        ratio(found.peer, found.ours), "at least", promised, nature, near=ratio(found.ours, found.limit),
        question="a batch of gun shots" if promised else "", rival="solve_ivp loop",
    )  # fmt: skip


def main() -> None:
    cases = {case.__name__: case for case in (three_effects, with_valve)}
    for case in [cases[name] for name in sys.argv[1:]] or cases.values():
        sys.stdout.write(
            figure(race(case), f"{case.__name__}: {SHOTS:,} shots, {PEER_SHOTS} scaled", None).row() + "\n"
        )


if __name__ == "__main__":
    main()
