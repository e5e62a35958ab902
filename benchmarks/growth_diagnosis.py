"""What a diagnosis of 12 to 400 configurations takes: shots of a gun, each configuration three times."""

from __future__ import annotations

from functools import partial
from itertools import product

import numpy as np
from pyroshock.diagnosis.diagnose import diagnose
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.twin.gun.effects.valve_flow import ValveFlow
from pyroshock.twin.gun.shots import gun_velocity

from .growth import Point, fitting, repeated
from .gun_scalar import THESIS_GUN
from .measuring import Spread

AXIS, CURVE = "configurations", "where and causes of a gun's gap"
#: Pressures by masses.
GRIDS = ((4, 3), (8, 5), (12, 10), (20, 20))
REPETITIONS, SCATTER = 3, 0.01
OPTIONS = Options(shrink=False, plan=False, rate_pulses=False)


def shots(pressures: int, masses: int, seed: int = 0) -> CampaignRecord:
    """Shots that lose gas to a valve which no nominal law knows, with scatter."""
    rng = np.random.default_rng(seed)
    settings = list(product(np.geomspace(0.4e5, 4e5, pressures).tolist(), np.geomspace(0.1, 1.0, masses).tolist()))
    pressure, mass = np.array(settings).T
    velocity = gun_velocity(THESIS_GUN, pressure, mass, [ValveFlow()]).velocity_m_s
    configurations = tuple(
        RunConfiguration(f"{p:g}, {m:g}", {"tank_pressure": p, "bullet_mass": m}) for p, m in settings
    )
    runs = []
    for order, (repetition, c) in enumerate(product(range(1, REPETITIONS + 1), range(len(settings)))):
        read = float(velocity[c] * np.exp(SCATTER * rng.standard_normal()))
        runs.append(Run(c, order + 1, repetition, order, *settings[c], read, SCATTER * read))
    return CampaignRecord("shots", "gun", configurations, tuple(runs), THESIS_GUN)


def diagnosis_points(
    budget_s: float, grids: tuple[tuple[int, int], ...] = GRIDS
) -> tuple[list[Point], dict[tuple[str, str], str]]:
    """A grid that takes longer than the budget is left out."""
    by_size = {pressures * masses: (pressures, masses) for pressures, masses in grids}
    diagnose(shots(*grids[0]), options=OPTIONS)  # imports
    found = fitting(lambda size: _taken(shots(*by_size[size])), list(by_size), budget_s)
    points = [Point(AXIS, CURVE, size, seconds) for size, seconds in found]
    size = points[-1].size
    left = [str(each) for each in by_size if each > size]
    nature = f"one Cholesky factorisation of {size} x {size}: {Spread.of(cholesky(size)).text(' ms', 1e3)}"
    nature += f"; {', '.join(left)} would take more than {budget_s:g} s: left out" if left else ""
    return points, {(AXIS, CURVE): nature}


def _taken(record: CampaignRecord) -> tuple[float, ...]:
    return repeated(partial(diagnose, record, options=OPTIONS), most=3)


def cholesky(n: int) -> tuple[float, ...]:
    """Seconds of factorising a covariance of n x n."""
    from scipy.linalg import cholesky as factorised

    a = np.random.default_rng(0).normal(size=(n, n))
    covariance = a @ a.T + n * np.eye(n)
    return repeated(lambda: factorised(covariance, lower=True, check_finite=False))
