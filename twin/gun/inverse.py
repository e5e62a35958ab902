"""Tank pressures for wanted muzzle velocities, effects included."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from .bench import GunBench, checked
from .effect import GunEffect
from .shot import Floats
from .shots import gun_velocity

_WITHIN = 1e-9
_MOST_TRIES = 100


def tank_pressure_for_velocity(
    bench: GunBench,
    velocity_m_s: ArrayLike,
    bullet_mass_kg: ArrayLike,
    effects: Sequence[GunEffect] = (),
    *,
    highest_pa: float = 50e5,
) -> Floats:
    """Gauge pressures (n,) that give muzzle velocities (n,), both positive, to 1e-9 of the velocity.

    Velocity rises with pressure, so there is one. By the Illinois rule of false position on the energy, which is nearly
    a straight line. Raises `ValueError` naming the first velocity that `highest_pa` does not reach.
    """
    wanted, mass = np.broadcast_arrays(
        np.atleast_1d(checked("velocity_m_s", velocity_m_s)), np.atleast_1d(checked("bullet_mass_kg", bullet_mass_kg))
    )

    def excess(pressure: Floats, rows: np.ndarray[tuple[int, ...], np.dtype[np.intp]]) -> Floats:
        velocity = gun_velocity(bench, pressure, mass[rows], [effect.take(rows) for effect in effects]).velocity_m_s
        return np.asarray((velocity / wanted[rows]) ** 2 - 1)

    rows = np.arange(wanted.size)
    low, high = np.zeros(wanted.size), np.full(wanted.size, highest_pa)
    below, above = np.full(wanted.size, -1.0), excess(high, rows)
    if np.any(above < 0):
        first = int(np.flatnonzero(above < 0)[0])
        raise ValueError(f"velocity_m_s = {wanted[first]:g}: {highest_pa:g} Pa in the tank do not reach it")
    result = high.copy()
    for _ in range(_MOST_TRIES):
        middle = (low * above - high * below) / (above - below)
        found = excess(middle, rows)
        result[rows] = middle
        under = found < 0
        # The end that stays counts half, or it would stay for ever.
        above, below = np.where(under, above / 2, found), np.where(under, found, below / 2)
        low, high = np.where(under, middle, low), np.where(under, high, middle)
        stay = np.flatnonzero((np.abs(found) > 2 * _WITHIN) & (high - low > 1e-14 * high))
        if not stay.size:
            return result
        rows, low, high, below, above = rows[stay], low[stay], high[stay], below[stay], above[stay]
    raise RuntimeError(f"no tank pressure found for {rows.size} velocities; the first is {wanted[rows[0]]:g} m/s")
