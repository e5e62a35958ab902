"""The five shots of Table 3.1 without their efficiency factor: `python -m
docs.studies.first_shots`.

What single effects and pairs need to be to explain the factor of one half, how much of it a leak
through the stated clearance explains, and which shots would tell the remaining causes apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.record import Run, RunConfiguration
from pyroshock.twin.effects import Effect, effect

from .gun_causes import Fit, Floats, distances, fit, gap
from .real_guns import first_shots_record
from .small_gun import said

#: Scatter of one shot: that of the five about one factor, which eq. 5.2's 1.3 % does not cover.
SCATTER = 0.05
PAIRS = (
    ("gun.blow_by", "gun.valve_flow"),
    ("gun.back_pressure", "gun.valve_flow"),
    ("gun.sliding_friction", "gun.valve_flow"),
    ("gun.valve_flow", "sensor.pressure_offset"),
    ("gun.back_pressure", "gun.dead_volume"),
)
#: Of the thesis's plan: bullets in kg; pressures that its gun was shot at and the double,
#: quadruple, and 6 bar.
SETTINGS = tuple((p, m) for p in (0.6e5, 1.2e5, 2.4e5, 6e5) for m in (0.1428, 0.5, 1.0))
#: Two causes are told apart where they lie this many standard errors from each other.
APART = 4.0


@dataclass(frozen=True, eq=False)
class Leak:
    """A leak through the clearance: ln v lost (C,), the share of the gap that it explains, Corner's
    psi (C,)."""

    discharge_coefficient: float
    lost: Floats
    share: Floats
    psi: Floats


def corner_leakage(velocity_ratio: Floats) -> Floats:
    """psi of eq. 5.3, v / v_tight = (1 - psi)^0.7: 0 for a perfect seal, 1 for gas that all blows
    by.

    Source: Corner, Theory of the Interior Ballistics of Guns (Wiley, 1950), as the thesis quotes
    it, which puts psi of its gun between 0.4 and 0.6.
    """
    return np.asarray(1 - velocity_ratio ** (1 / 0.7))


def clearance_leak(
    stage: GunObservables, discharge_coefficient: float, beside: Sequence[Effect] = ()
) -> Leak:
    """As wide as the bench's diameters say: no wear. With effects `beside` it, what all of them
    do."""
    leak = effect("gun.blow_by", discharge_coefficient=discharge_coefficient, wear_m=0.0)
    change = stage.changes([[leak, *beside]])[0, :, 0]
    return Leak(
        discharge_coefficient, change, change / gap(stage).y, corner_leakage(np.exp(change))
    )


def predicted(
    stage: GunObservables, fits: Sequence[Fit], settings: Sequence[tuple[float, float]]
) -> Floats:
    """(k, n) m/s: what each explanation says of pressures and masses that were not shot; NaN where
    it stays."""
    configurations = tuple(RunConfiguration(f"{p / 1e5:g} bar, {m:g} kg", {}) for p, m in settings)
    runs = tuple(Run(i, i + 1, 1, i, p, m) for i, (p, m) in enumerate(settings))
    asked = GunObservables(replace(stage.record, configurations=configurations, runs=runs))
    return np.array([np.exp(asked.simulated(each.effects)[:, 0]) for each in fits])


def shots_needed(velocities: Floats, scatter: float = SCATTER) -> Floats:
    """(k, k, n): shots of each setting after which two explanations are `APART`; NaN where one
    predicts none."""
    ln = np.log(velocities)
    apart = np.abs(ln[:, None] - ln[None]) / scatter
    with np.errstate(divide="ignore"):
        return np.asarray(np.ceil((APART / apart) ** 2))


def main() -> None:
    stage = GunObservables(first_shots_record())
    stated, seen = gap(stage), gap(stage, SCATTER)
    print("ln measured over nominal", np.round(stated.y, 3), f"stated u {stated.s[0]:.4f}")
    smooth = np.sum(((stated.y - stated.y.mean()) / stated.s) ** 2)
    print(
        f"one factor {np.exp(stated.y.mean()):.3f}: chi2 {smooth:.0f} of 4 by "
        f"stated u, sd {stated.y.std(ddof=1):.3f}"
    )
    for cd in (0.6, 1.0):
        leak = clearance_leak(stage, cd)
        print(
            f"leak, Cd {cd}: share of the gap {np.round(leak.share, 2)}, psi "
            f"{np.round(leak.psi, 2)}"
        )
        both = clearance_leak(stage, cd, [effect("gun.back_pressure")])
        print(f"  and the atmosphere: share {np.round(both.share, 2)}")
    standing = []
    for ids in [*((one,) for one in stage.shows), *PAIRS]:
        found = fit(stage, seen, ids, anywhere=len(ids) == 1)
        left = np.round(seen.y - found.change, 3)
        print(
            f"{found.name}: chi2 {found.chi2:.1f}, {said(found)}, likely "
            f"{found.likely}, left {left}",
            flush=True,
        )
        standing += [found] if found.chi2 < 10 else []
    print("apart, in standard errors\n", np.round(distances(standing, seen.s), 1))
    velocities = predicted(stage, standing, SETTINGS)
    for setting, column in zip(SETTINGS, velocities.T, strict=True):
        print(setting, np.round(column, 1))


if __name__ == "__main__":
    main()
