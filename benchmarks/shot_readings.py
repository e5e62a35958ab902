"""Tank pressure, opening of the valve and muzzle velocity, read from virtual shots and compared
with the truth.

`python -m benchmarks.shot_readings [--seed 0] [--every 1]` prints for each class of shots: the
share that was read, median and root mean square of the errors, median stated uncertainty, and root
mean square and largest of the errors over their stated uncertainties (1 is right, below it is
cautious).
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.ingest.extraction.pressure_drop import NoDropError, pressure_drop
from pyroshock.ingest.extraction.velocity import muzzle_velocity
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, Projectile
from pyroshock.virtualbench.gun.fire import ShotTruth, Trigger, fire, shot_signals
from pyroshock.virtualbench.gun.gas import DEAD_SHARE, RANGEABILITY, ValveWay
from pyroshock.virtualbench.sensors.filters import low_passed

#: Open share of the port over the share of its time; None is the equal percentage of the virtual
#: gun.
PORTS: Mapping[str, Callable[[Floats], Floats] | None] = {
    "equal percentage": None,
    "two circles": lambda u: (2 * np.arccos(1 - u) - 2 * (1 - u) * np.sqrt(u * (2 - u))) / np.pi,
    "ramp": lambda u: u,
    "cosine": lambda u: (1 - np.cos(np.pi * u)) / 2,
    "solenoid": lambda u: 1 - np.exp(-5 * u),
}
SHOTS = ((0.3e5, 0.1428), (1e5, 0.1428), (1e5, 0.5), (3e5, 0.5), (6e5, 1.0), (8e5, 0.1428))
PRE_TRIGGERS_S = (0.01, 0.025, 0.05, 0.3)
#: Rate, white noise (0.25 % of 16 bar, or a good recorder's) and hum at 50 Hz (Pa), corner of the
#: transducer.
RECORDERS = (
    (1e5, 200.0, 0.0, 1e3), (1e5, 4000.0, 0.0, 1e3), (1e4, 4000.0, 0.0, 400.0), (1e5, 200.0, 400.0,
    1e3),
    (2.5e4, 4000.0, 1600.0, 1e3),
)  # fmt: skip
#: Noise and hum of the laser (m; a bullet takes 48 mm), and the corner of its electronics.
LASERS = ((2e-5, 0.0, 1e4), (1e-3, 2e-3, 1e4), (3e-3, 0.0, 3e3), (1e-3, 6e-3, 3e3))
LENGTH_U_M, MAINS_HZ = 0.5e-3, 50.0

Row = dict[str, Any]


def valve_way(port: Callable[[Floats], Floats], opening_s: float) -> ValveWay:
    """The ball's way by which the virtual port opens as another law."""
    time = np.linspace(0, 1, 100)
    position = DEAD_SHARE + (1 - DEAD_SHARE) * np.log1p(port(time) * (RANGEABILITY - 1)) / math.log(
        RANGEABILITY
    )
    return ValveWay(tuple((opening_s * time).tolist()), tuple(np.minimum(position, 1).tolist()))


def truths(every: int) -> Iterator[tuple[Row, ShotTruth, Projectile]]:
    """One shot of `every`."""
    effects, number = Effects.default().with_strength("bench.hand_scatter", 0.0), 0
    for name, port in PORTS.items():
        for opening_s in (0.005, 0.02) if name == "solenoid" else (0.1, 0.25, 0.6, 1.5):
            for pressure_pa, mass_kg in SHOTS:
                number += 1
                if number % every:
                    continue
                gun, bullet = (
                    replace(GunBuild(), valve_opening_time_s=opening_s),
                    Projectile(mass_kg),
                )
                way = None if port is None else valve_way(port, opening_s)
                rng = np.random.default_rng(0)
                shot = fire(
                    gun, effects, pressure_pa, bullet, rng, until_s=1.4 + opening_s, valve_way=way
                )
                opens_s = shot.port_opens_s if port is None else 0.0
                row = {
                    "port": name,
                    "opening_s": opening_s,
                    "pressure_pa": pressure_pa,
                    "opens_s": opens_s,
                }
                yield row, shot, bullet


def with_noise(
    values: Floats, rate_hz: float, noise: float, hum: float, rng: np.random.Generator
) -> Floats:
    """Values (n,) with white noise and hum of any phase."""
    phase = 2 * np.pi * (MAINS_HZ * np.arange(values.size) / rate_hz + rng.uniform())
    return np.asarray(values + noise * rng.standard_normal(values.size) + hum * np.sin(phase))


def pressure_rows(
    row: Row, shot: ShotTruth, bullet: Projectile, rng: np.random.Generator
) -> Iterator[Row]:
    """One row for each pre-trigger and recorder."""
    for pre_trigger_s in PRE_TRIGGERS_S:
        trigger = Trigger(pre_trigger_s=pre_trigger_s)
        for rate_hz, noise, hum, corner_hz in RECORDERS:
            fine = shot_signals(shot, bullet, 1e5, pre_trigger_s + 0.5, trigger)["tank_pressure"]
            tank = low_passed(fine, 1e-5, corner_hz)[:: round(1e5 / rate_hz)]
            case = {**row, "pre_trigger_s": pre_trigger_s, "recorder": (rate_hz, noise, hum)}
            try:
                reading = pressure_drop(with_noise(tank, rate_hz, noise, hum, rng), rate_hz)
            except (
                NoDropError
            ):  # a record that is refused is a row without a reading, and is counted as such
                yield case
                continue
            level, moment = row["pressure_pa"], row["opens_s"] - trigger.begin_s(shot)
            yield case | {
                "pressure, %": (
                    100 * (reading.pressure_pa / level - 1),
                    100 * reading.pressure_u_pa / level,
                ),
                "opening, ms": (1e3 * (reading.time_s - moment), 1e3 * reading.time_u_s),
            }


def laser_rows(
    row: Row, shot: ShotTruth, bullet: Projectile, rng: np.random.Generator
) -> Iterator[Row]:
    """One row for each laser; the stated bullet length is as wrong as its uncertainty says."""
    if not shot.laser_blocked:
        return
    for noise, hum, corner_hz in LASERS:
        fine = shot_signals(shot, bullet, 1e5, 1.1, Trigger(pre_trigger_s=0.1))["laser"]
        laser = with_noise(low_passed(fine, 1e-5, corner_hz), 1e5, noise, hum, rng)
        length_m = bullet.length_m + LENGTH_U_M * rng.standard_normal()
        try:
            reading = muzzle_velocity(laser, 1e5, length_m, length_u_m=LENGTH_U_M)
        except ValueError:  # likewise
            yield {**row, "laser": (noise, hum, corner_hz)}
            continue
        true = shot.muzzle_velocity_m_s
        error = (100 * (reading.velocity_m_s / true - 1), 100 * reading.velocity_u_m_s / true)
        yield {**row, "laser": (noise, hum, corner_hz), "velocity, %": error}


def print_table(rows: list[Row], quantity: str, keys: tuple[str, ...]) -> None:
    heads = ("shots", "read", "median", "rms", "stated", "rms z", "max z")
    print(
        f"\n{quantity}\n{'class':46} "
        + " ".join(f"{head:>{5 if head in heads[:2] else 8}}" for head in heads)
    )
    for key in ("", *keys):
        for value in sorted({str(row.get(key)) for row in rows if not key or key in row}):
            of_class = [row for row in rows if not key or str(row.get(key)) == value]
            pairs = np.array([row[quantity] for row in of_class if quantity in row])
            head = f"{f'{key} {value}' if key else 'all':46} {len(of_class):5}"
            if not pairs.size:
                print(f"{head}  none read")
                continue
            error, z = pairs[:, 0], pairs[:, 0] / pairs[:, 1]
            rms, of_z = np.sqrt(np.mean(error**2)), np.sqrt(np.mean(z**2))
            print(
                f"{head} {len(pairs) / len(of_class):5.2f} {np.median(error):+8.3f} {rms:8.3f} "
                f"{np.median(pairs[:, 1]):8.3f} {of_z:8.2f} {np.abs(z).max():8.1f}"
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="take one shot of so many, of 108")
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    of_pressure: list[Row] = []
    of_laser: list[Row] = []
    for row, shot, bullet in truths(arguments.every):
        of_pressure += pressure_rows(row, shot, bullet, rng)
        of_laser += laser_rows(row, shot, bullet, rng)
    for quantity in ("pressure, %", "opening, ms"):
        print_table(
            of_pressure, quantity, ("pre_trigger_s", "port", "opening_s", "pressure_pa", "recorder")
        )
    print_table(of_laser, "velocity, %", ("opening_s", "laser"))


if __name__ == "__main__":
    main()
