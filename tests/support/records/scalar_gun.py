"""The physics of the gun stage as plain scalar functions, one shot after the other by
`solve_ivp`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pyroshock.signals.valve_profile import ValveProfile
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.shot import GunEffect

Floats = NDArray[np.float64]
#: Of `solve_ivp`.
Method = Literal["RK45", "DOP853", "LSODA"]
THESIS_GUN = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 1.0)
GAS, AIR, ROOM, GRAVITY = 287.05, 101_325.0, 293.15, 9.80665


@dataclass
class ScalarGun:
    """One shot as numbers: the equations of docs/explanation/gun.md, written a second time."""

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
    #: In the place of an even opening.
    profile: ValveProfile | None = None
    #: Of the last solution.
    exit_s: float = math.nan

    def __post_init__(self) -> None:
        b, g = self.bench, self.bench.heat_capacity_ratio
        self.area = math.pi * b.projectile_diameter_m**2 / 4
        time = math.sqrt(2 * b.travel_m * self.mass / (self.pressure * self.area))
        self.index = g - min(self.heat + 1 - math.exp(-self.heat_rate * time), 1.0) * (g - 1)
        self.room_air = max(100.0, self.atmosphere)  # a trace of air in a vacuum
        self.zero = self.room_air - self.atmosphere
        self.drag_n = (
            b.friction_coefficient + self.added_friction
        ) * self.mass * GRAVITY + self.seal
        self.drag_n += (self.atmosphere + self.seal_share * self.pressure) * self.area
        self.ring = (
            self.discharge
            * math.pi
            / 4
            * ((b.bore_diameter_m + 2 * self.wear) ** 2 - b.projectile_diameter_m**2)
        )
        self.gauge_ring = (
            self.gauge_discharge * math.pi / 4 * (b.bore_diameter_m**2 - b.projectile_diameter_m**2)
        )
        self.choked: float = math.sqrt(g) * (2 / (g + 1)) ** ((g + 1) / (2 * (g - 1)))
        self.critical: float = (2 / (g + 1)) ** (g / (g - 1))
        passage = 1e-4 if self.loss > 0 else 1.0
        self.tank = b.tank_volume_m3 * (1 - passage)
        self.front = b.tank_volume_m3 * passage + self.dead
        self.filled = b.tank_volume_m3 * passage
        self.valve = (
            math.pi / 4 * b.bore_diameter_m**2 / math.sqrt(self.loss) if self.loss > 0 else 0.0
        )

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
        return (
            area
            * self.choked
            * p1
            / math.sqrt(GAS * max(t1, 1.0))
            * free
            / math.sqrt(max(free, 0.0) + 1e-3)
        )

    def open_share(self, t: float) -> float:
        if self.profile is not None:
            s = 1 - float(np.interp(t, self.profile.time_s, self.profile.position))
        elif self.opening <= 0 or t >= self.opening:
            return 1.0
        else:
            s = 1 - t / self.opening
        return 2 / math.pi * (math.acos(s) - s * math.sqrt(1 - s * s))

    def rates(self, t: float, y: Floats) -> list[float]:
        x, v, p, m = y[0], y[1], y[2], y[3]
        b, speed = self.bench, v if v > 0 else 0.0
        volume = self.front + self.area * x
        absolute, density = p + self.zero, m / volume
        warm = absolute / (GAS * density)
        leak = self.flow(self.ring, absolute, warm, self.room_air, ROOM) if self.ring > 0 else 0.0
        leak += (
            self.gauge_ring
            * self.choked
            * max(absolute - self.room_air, 0.0)
            / math.sqrt(GAS * max(warm, 1.0))
        )
        outside = (self.drag + self.steady_loss) * AIR / (GAS * ROOM)
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
        return [
            speed,
            force / self.mass,
            into,
            inflow - leak,
            -self.index / self.tank * carried,
            -inflow,
        ]

    def velocity(self, method: Method, rtol: float, longest_s: float = 5.0) -> float:
        """By `solve_ivp`; 0 for a shot that does not get to the vent holes."""
        return self.solved(method, rtol, longest_s)[0]

    def solved(self, method: Method, rtol: float, longest_s: float = 5.0) -> tuple[float, int]:
        """The same, and how often the rates were asked for."""
        from scipy.integrate import solve_ivp

        start = self.start()
        sizes = [
            self.bench.travel_m,
            10.0,
            max(start[2], 1e3),
            *([1e-3] if self.loss <= 0 else [1e-4, max(start[4], 1e3), 1e-2]),
        ]

        def at_vents(_: float, y: Floats) -> float:
            return float(y[0]) - self.bench.travel_m

        at_vents.terminal = True  # type: ignore[attr-defined]
        end = solve_ivp(
            self.rates,
            (0.0, longest_s),
            start,
            method,
            events=at_vents,
            rtol=rtol,
            atol=[rtol * s for s in sizes],
        )
        self.exit_s = float(end.t[-1])
        return float(end.y[1, -1]) if end.t_events and end.t_events[0].size else 0.0, int(end.nfev)


_NAMES = {
    "atmosphere_pa": "atmosphere", "discharge_coefficient": "discharge", "wear_m": "wear",
    "gauge_discharge_coefficient": "gauge_discharge", "loss_coefficient": "loss",
    "opening_time_s": "opening",
    "steady_loss_coefficient": "steady_loss", "friction_factor": "friction_factor",
    "drag_coefficient": "drag",
    "gas_heads": "gas_heads", "added_coefficient": "added_friction", "seal_force_n": "seal",
    "seal_share": "seal_share", "share": "heat", "rate_1_s": "heat_rate", "volume_m3": "dead",
}  # fmt: skip

#: Of each parameter, from which tests draw.
WITHIN = {
    "atmosphere_pa": (9e4, 1.05e5),
    "discharge_coefficient": (0.1, 1.0),
    "wear_m": (0.0, 1e-3),
    "gauge_discharge_coefficient": (0.0, 1.0),
    "loss_coefficient": (10.0, 1e3),
    "opening_time_s": (0.0, 0.2),
    "steady_loss_coefficient": (0.0, 50.0),
    "friction_factor": (0.0, 0.2),
    "drag_coefficient": (0.0, 10.0),
    "gas_heads": (0.0, 10.0),
    "added_coefficient": (0.0, 2.0),
    "seal_force_n": (0.0, 20.0),
    "seal_share": (0.0, 0.3),
    "share": (-0.5, 1.0),
    "rate_1_s": (0.0, 3.0),
    "volume_m3": (0.0, 2e-3),
}


def scalar_guns(
    bench: GunBench, pressure: Floats, mass: Floats, effects: Sequence[GunEffect]
) -> list[ScalarGun]:
    """One for each pressure and mass, with the same effects."""
    values: dict[str, Floats] = {}
    for effect in effects:
        for item in effect.parameters():
            values[_NAMES[item.name]] = np.broadcast_to(
                np.asarray(getattr(effect, item.name), dtype=float), pressure.shape
            )
    return [
        ScalarGun(
            float(q), float(m), bench, **{name: float(value[i]) for name, value in values.items()}
        )
        for i, (q, m) in enumerate(zip(pressure, mass, strict=True))
    ]
