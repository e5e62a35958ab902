"""10,000 gun shots with three effects against scipy, in one run: `python -m benchmarks.gun`.

The peer is the same physics as plain scalar functions, one shot after the other through `solve_ivp`: the fastest of
three methods, each at the loosest tolerance with which its own velocities hold to 1e-6. It fires some of the shots;
its time for all of them is that times their share. Times are of the processor, one core on both sides, so that what
else runs does not count.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.effect import GunEffect
from pyroshock.twin.gun.effects.back_pressure import BackPressure
from pyroshock.twin.gun.effects.barrel_loss import BarrelLoss
from pyroshock.twin.gun.effects.blow_by import BlowBy
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.shots import gun_velocity

Floats = NDArray[np.float64]
THESIS_GUN = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
SHOTS, PEER_SHOTS = 10_000, 100
ACCURACY = 1e-6
EXACT = ("LSODA", 1e-10)
GAS, AIR, ROOM, GRAVITY = 287.05, 101_325.0, 293.15, 9.80665


@dataclass
class ScalarGun:
    """One shot as numbers: chapter and verse of docs/gun.md, written anew."""

    pressure: float
    mass: float
    bench: GunBench = THESIS_GUN
    atmosphere: float = 0.0
    discharge: float = 0.0
    wear: float = 0.0
    gauge_discharge: float = 0.0
    loss: float = 0.0
    opening: float = 0.0
    steady_loss: float = 0.0
    friction_factor: float = 0.0
    drag: float = 0.0
    gas_heads: float = 0.0
    added_friction: float = 0.0
    seal: float = 0.0
    seal_share: float = 0.0
    heat: float = 0.0
    heat_rate: float = 0.0
    dead: float = 0.0

    def __post_init__(self) -> None:
        b, g = self.bench, self.bench.heat_capacity_ratio
        self.area = math.pi * b.projectile_diameter_m**2 / 4
        time = math.sqrt(2 * b.travel_m * self.mass / (self.pressure * self.area))
        self.index = g - min(self.heat + 1 - math.exp(-self.heat_rate * time), 1.0) * (g - 1)
        self.room_air = max(AIR, self.atmosphere)
        self.zero = self.room_air - self.atmosphere
        self.drag_n = (b.friction_coefficient + self.added_friction) * self.mass * GRAVITY + self.seal
        self.drag_n += (self.atmosphere + self.seal_share * self.pressure) * self.area
        self.ring = (
            self.discharge * math.pi / 4 * ((b.bore_diameter_m + 2 * self.wear) ** 2 - b.projectile_diameter_m**2)
        )
        self.gauge_ring = self.gauge_discharge * math.pi / 4 * (b.bore_diameter_m**2 - b.projectile_diameter_m**2)
        self.choked = math.sqrt(g) * (2 / (g + 1)) ** ((g + 1) / (2 * (g - 1)))
        self.critical = (2 / (g + 1)) ** (g / (g - 1))
        passage = 1e-4 if self.loss > 0 else 1.0
        self.tank = b.tank_volume_m3 * (1 - passage)
        self.front = b.tank_volume_m3 * passage + self.dead
        self.filled = b.tank_volume_m3 * passage
        self.valve = math.pi / 4 * b.bore_diameter_m**2 / math.sqrt(self.loss) if self.loss > 0 else 0.0

    def start(self) -> list[float]:
        drive, full = self.pressure + self.atmosphere, self.pressure + self.room_air
        p = (drive * self.filled + self.atmosphere * self.dead) / self.front
        m = (full * self.filled + self.room_air * self.dead) / (GAS * ROOM)
        tank = [drive, full * self.tank / (GAS * ROOM)] if self.loss > 0 else []
        return [0.0, 0.0, p, m, *tank]

    def flow(self, area: float, p1: float, t1: float, p2: float, t2: float) -> float:
        if p1 < p2:
            return -self.flow(area, p2, t2, p1, t1)
        over = max(p2 / p1 - self.critical, 0.0) / (1 - self.critical)
        free = 1 - over * over
        # Steps that solve_ivp only tries may be anywhere.
        return area * self.choked * p1 / math.sqrt(GAS * max(t1, 1.0)) * free / math.sqrt(max(free, 0.0) + 1e-3)

    def open_share(self, t: float) -> float:
        if self.opening <= 0 or t >= self.opening:
            return 1.0
        s = 1 - t / self.opening
        return 2 / math.pi * (math.acos(s) - s * math.sqrt(1 - s * s))

    def rates(self, t: float, y: Sequence[float]) -> list[float]:
        x, v, p, m = y[0], y[1], y[2], y[3]
        b, speed = self.bench, v if v > 0 else 0.0
        volume = self.front + self.area * x
        absolute, density = p + self.zero, m / volume
        warm = absolute / (GAS * density)
        leak = self.flow(self.ring, absolute, warm, self.room_air, ROOM) if self.ring > 0 else 0.0
        leak += self.gauge_ring * self.choked * max(p, 0.0) / math.sqrt(GAS * max(warm, 1.0))
        outside = (self.drag + self.steady_loss) * self.room_air / (GAS * ROOM)
        entrance = self.gas_heads * max(p, 0.0) / (GAS * max(warm, 1.0))
        heads = self.friction_factor * x / b.bore_diameter_m * density + outside + entrance
        force = p * self.area - self.drag_n - self.area * heads * speed * speed / 2
        if v <= 0 and force < 0:
            force = 0.0
        heat = -GAS * (warm if leak > 0 else ROOM) * leak - p * self.area * speed
        if self.loss <= 0:
            return [speed, force / self.mass, self.index / volume * heat, -leak]
        tank = y[4] + self.zero
        tank_warm = tank * self.tank / (GAS * y[5])
        inflow = self.flow(self.valve * self.open_share(t), tank, tank_warm, absolute, warm)
        carried = GAS * (tank_warm if inflow > 0 else warm) * inflow
        into = self.index / volume * (heat + carried)
        return [speed, force / self.mass, into, inflow - leak, -self.index / self.tank * carried, -inflow]

    def velocity(self, method: str, rtol: float, longest_s: float = 5.0) -> float:
        """By `solve_ivp`; 0 for a shot that does not get to the vent holes."""
        from scipy.integrate import solve_ivp

        start = self.start()
        sizes = [
            self.bench.travel_m,
            10.0,
            max(start[2], 1e3),
            *([1e-3] if self.loss <= 0 else [1e-4, max(start[4], 1e3), 1e-2]),
        ]

        def at_vents(_: float, y: Sequence[float]) -> float:
            return y[0] - self.bench.travel_m

        at_vents.terminal = True  # type: ignore[attr-defined]
        end = solve_ivp(
            self.rates, (0.0, longest_s), start, method, events=at_vents, rtol=rtol, atol=[rtol * s for s in sizes]
        )
        return float(end.y[1, -1]) if end.t_events[0].size else 0.0


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


_NAMES = {
    "atmosphere_pa": "atmosphere",
    "discharge_coefficient": "discharge",
    "wear_m": "wear",
    "gauge_discharge_coefficient": "gauge_discharge",
    "loss_coefficient": "loss",
    "opening_time_s": "opening",
    "steady_loss_coefficient": "steady_loss",
    "friction_factor": "friction_factor",
    "drag_coefficient": "drag",
    "gas_heads": "gas_heads",
    "added_coefficient": "added_friction",
    "seal_force_n": "seal",
    "seal_share": "seal_share",
    "share": "heat",
    "rate_1_s": "heat_rate",
    "volume_m3": "dead",
}


def scalar_guns(bench: GunBench, pressure: Floats, mass: Floats, effects: Sequence[GunEffect]) -> list[ScalarGun]:
    """The peer's shots for ours."""
    values: dict[str, Floats] = {}
    for effect in effects:
        for item in effect.parameters():
            values[_NAMES[item.name]] = np.broadcast_to(
                np.asarray(getattr(effect, item.name), dtype=float), pressure.shape
            )
    return [
        ScalarGun(float(q), float(m), bench, **{name: float(value[i]) for name, value in values.items()})
        for i, (q, m) in enumerate(zip(pressure, mass, strict=True))
    ]


@dataclass(frozen=True)
class Race:
    """Seconds for all shots, ours and the peer's; the greatest difference of velocities, relative."""

    ours_s: float
    peer_s: float
    method: str
    rtol: float
    difference: float

    @property
    def factor(self) -> float:
        return self.peer_s / self.ours_s


Case = Callable[[int, np.random.Generator], tuple[Floats, Floats, list[GunEffect]]]


def race(case: Case, seed: int = 1) -> Race:
    """Both on one case; ours is the median of five runs."""
    pressure, mass, effects = case(SHOTS, np.random.default_rng(seed))
    times = []
    for _ in range(6):  # the first one warms up
        begin = time.process_time()
        shots = gun_velocity(THESIS_GUN, pressure, mass, effects)
        times.append(time.process_time() - begin)
    rows = np.arange(PEER_SHOTS)
    some = [effect.take(rows) for effect in effects]
    guns = scalar_guns(THESIS_GUN, pressure[rows], mass[rows], some)
    exact = np.array([gun.velocity(*EXACT) for gun in guns])
    seconds, method, rtol = min(_fit(guns, exact, method) for method in ("RK45", "DOP853", "LSODA"))
    difference = float(np.max(np.abs(shots.velocity_m_s[rows] / exact - 1)))
    return Race(statistics.median(times[1:]), seconds * SHOTS / PEER_SHOTS, method, rtol, difference)


def _fit(guns: Sequence[ScalarGun], exact: Floats, method: str) -> tuple[float, str, float]:
    """Seconds at the loosest tolerance that holds 1e-6, found on the way from loose to tight."""
    for rtol in (1e-6, 3e-7, 1e-7, 3e-8, 1e-8, 3e-9, 1e-9, 1e-10):
        begin = time.process_time()
        velocity = np.array([gun.velocity(method, rtol) for gun in guns])
        seconds = time.process_time() - begin
        if np.max(np.abs(velocity / exact - 1)) <= ACCURACY:
            return seconds, method, rtol
    return math.inf, method, 0.0


def main() -> None:
    cases = {case.__name__: case for case in (three_effects, with_valve)}
    for case in [cases[name] for name in sys.argv[1:]] or cases.values():
        r = race(case)
        print(
            f"{case.__name__}: {SHOTS} shots {r.ours_s:.3f} s; solve_ivp {r.method}, rtol {r.rtol:g}: {r.peer_s:.1f} s "
            f"({PEER_SHOTS} shots scaled): {r.factor:.0f} times; velocities within {r.difference:.1e}"
        )


if __name__ == "__main__":
    main()
