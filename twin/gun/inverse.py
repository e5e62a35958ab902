"""Tank pressures for wanted muzzle velocities, effects included."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bench import GunBench, checked
from .effect import GunEffect
from .shot import Floats
from .shots import gun_velocity

_WITHIN = 1e-9


def tank_pressure_for_velocity(
    bench: GunBench,
    velocity_m_s: ArrayLike,
    bullet_mass_kg: ArrayLike,
    effects: Sequence[GunEffect] = (),
    *,
    highest_pa: float = 50e5,
) -> Floats:
    """Gauge pressures (n,) that give muzzle velocities (n,), both positive, to 1e-9 of the velocity.

    Velocity rises with pressure, so there is one; Chandrupatla's bracketing finds it on the energy, which is nearly a
    straight line. Raises `ValueError` naming the first velocity that `highest_pa` does not reach.
    """
    from scipy.optimize import elementwise

    wanted, mass = np.broadcast_arrays(
        np.atleast_1d(checked("velocity_m_s", velocity_m_s)), np.atleast_1d(checked("bullet_mass_kg", bullet_mass_kg))
    )

    def excess(pressure: Floats, shot: NDArray[np.intp]) -> Floats:
        taken = [effect.take(shot) for effect in effects]
        velocity = gun_velocity(bench, pressure, mass[shot], taken).velocity_m_s
        return np.asarray((velocity / wanted[shot]) ** 2 - 1)

    shots, highest = np.arange(wanted.size), np.full(wanted.size, float(highest_pa))
    beyond = np.flatnonzero(excess(highest, shots) < 0)
    if beyond.size:
        first = wanted[beyond[0]]
        raise ValueError(f"velocity_m_s = {first:g}: {highest_pa:g} Pa in the tank do not reach it")
    tolerances = {"fatol": 2 * _WITHIN, "xrtol": 1e-14}
    bracket = (np.zeros(wanted.size), highest)
    # The stubs want a function of any arguments.
    roots = elementwise.find_root(excess, bracket, args=(shots,), tolerances=tolerances)  # type: ignore[call-overload]
    if not np.all(roots.success):
        missed = np.flatnonzero(~roots.success)
        raise RuntimeError(
            f"no tank pressure found for {missed.size} velocities; the first is {wanted[missed[0]]:g} m/s"
        )
    return np.asarray(roots.x)
