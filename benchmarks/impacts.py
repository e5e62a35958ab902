"""`python -m benchmarks.impacts`: 10,000 impacts with three effects in one call, beside solve_ivp in a loop.

The loop solves every 200th of them, for its time grows with their number. Both are held against solve_ivp at a
tolerance of 1e-11. The exit code is 1 where a promise is lost.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.impact import impact
from pyroshock.twin.contact.impacts import Impacts

from .measuring import Spread, interleaved

IMPACTS, EACH, REPEATS = 10_000, 200, 5
LEAST_RATIO, LARGEST_ERROR = 100.0, 1e-6
EFFECTS = (ViscousLoss(0.05), PlasticYield(), PlateCompliance(0.3))
_NAMES = ("peak force", "contact time", "impulse", "separation velocity")


def bodies(each: int = 1) -> Bodies:
    """Bullets of 0.1 to 1 kg with a tip of delrin on 10 mm of aluminium, 0.5 to 20 m/s; every so manieth of them."""
    rng = np.random.default_rng(7)
    velocity, mass = rng.uniform(0.5, 20, IMPACTS), rng.uniform(0.1, 1, IMPACTS)
    return Bodies.of(
        impactor_radius_m=0.03,
        impactor_youngs_modulus_pa=3.2e9,
        impactor_poisson_ratio=0.35,
        impactor_density_kg_m3=1410.0,
        impactor_yield_strength_pa=71.7e6,
        target_youngs_modulus_pa=69.9e9,
        target_poisson_ratio=0.33,
        target_density_kg_m3=2700.0,
        target_yield_strength_pa=276e6,
        plate_thickness_m=0.01,
        impactor_mass_kg=mass[::each],
        impact_velocity_m_s=velocity[::each],
    )


def ours(some: Bodies) -> NDArray[np.float64]:
    """4 x n."""
    pulse = impact(some, EFFECTS)
    return np.stack([pulse.peak_force_n, pulse.contact_time_s, pulse.impulse_n_s, pulse.separation_velocity_m_s])


def looped(some: Bodies, tolerance: float) -> NDArray[np.float64]:
    """The same, one after the other."""
    prepared = Impacts.of(some)
    for effect in EFFECTS:
        prepared = effect.prepare(prepared)
    names = ("mass_kg", "stiffness_n_mp", "rate_loss_s_m", "yield_load_n", "plate_mobility_m_n_s")
    quantities = np.stack([getattr(prepared, name) for name in names], axis=1).tolist()
    one = [_solved(float(u), *row, tolerance) for u, row in zip(some.impact_velocity_m_s, quantities, strict=True)]
    return np.array(one).T


def _solved(
    u: float, m: float, k: float, chi: float, load: float, mobility: float, tolerance: float
) -> tuple[float, float, float, float]:
    """Loading to the turn, unloading to parting; the peak where the force's rate changes its sign."""
    yields = (load / k) ** (2 / 3)

    def loading(d: float) -> tuple[float, float]:
        d = max(d, 0.0)
        if d < yields:
            return k * d**1.5, 1.5 * k * d**0.5
        return load + 1.5 * load / yields * (d - yields), 1.5 * load / yields

    time, (deepest, v), peak = _run(loading, [0.0, u], m, chi, mobility, 0.0, tolerance)
    top = loading(deepest)[0]
    recovered = deepest * top / (k * deepest**1.5) if deepest > yields else deepest
    stays = deepest - recovered

    def unloading(d: float) -> tuple[float, float]:
        share = max(d - stays, 0.0) / recovered
        return top * share**1.5, 1.5 * top / recovered * share**0.5

    time, (_, v), _ = _run(unloading, [deepest, v], m, chi, mobility, time, tolerance, stays)
    return max(peak, top), time, m * (u - v), -v


def _run(
    law: Callable[[float], tuple[float, float]],
    start: list[float],
    m: float,
    chi: float,
    mobility: float,
    time: float,
    tolerance: float,
    stays: float | None = None,
) -> tuple[float, list[float], float]:
    from scipy.integrate import solve_ivp

    def approach(d: float, v: float) -> tuple[float, float]:
        force = law(d)[0]
        rate = (v - mobility * force) / (1 + chi * mobility * force)
        return rate, force * (1 + chi * rate)

    def rate(_: float, state: NDArray[np.float64]) -> list[float]:
        indentation, force = approach(*state)
        return [indentation, -force / m]

    def end(_: float, state: NDArray[np.float64]) -> float:
        return approach(*state)[0] if stays is None else float(state[0] - stays)

    def steepness(_: float, state: NDArray[np.float64]) -> float:
        rate, force = approach(*state)
        static, slope = law(float(state[0]))
        grip = 1 + chi * rate
        lossy = 1 + chi * mobility * static
        return slope * rate * grip - chi * static * (force / m + mobility * slope * rate * grip) / lossy

    end.terminal, end.direction = True, -1.0  # type: ignore[attr-defined]
    steepness.direction = -1.0  # type: ignore[attr-defined]
    # An event is as exact as the polynomial between two steps.
    step = {"rtol": tolerance, "atol": 1e-15, "max_step": 2e-5 if tolerance < 1e-9 else np.inf}
    run = solve_ivp(rate, (time, time + 1.0), start, "DOP853", events=(end, steepness), first_step=1e-7, **step)
    summit = max((approach(*state)[1] for state in run.y_events[1]), default=0.0)
    return float(run.t[-1]), [float(x) for x in run.y[:, -1]], summit


def main() -> int:
    some, all_of_them = bodies(EACH), bodies()
    exact = looped(some, 1e-11)
    scale = np.stack([*exact[:3], some.impact_velocity_m_s])  # a velocity near nothing has no relative error
    taken = interleaved({"ours": lambda: ours(all_of_them), "solve_ivp": lambda: looped(some, 1e-8)}, REPEATS)
    loop = [EACH * seconds for seconds in taken["solve_ivp"]]
    ratio = Spread.of([theirs / mine for theirs, mine in zip(loop, taken["ours"], strict=True)])
    errors = np.abs((ours(all_of_them)[:, ::EACH] - exact) / scale).max(axis=1)
    peers = np.abs((looped(some, 1e-8) - exact) / scale).max(axis=1)
    sys.stdout.write(f"10,000 impacts, s: ours {Spread.of(taken['ours']).text()}; loop {Spread.of(loop).text()}\n")
    sys.stdout.write(f"times faster: {ratio.text()}; promised at least {LEAST_RATIO:g}\n")
    for name, mine, peer in zip(_NAMES, errors, peers, strict=True):
        sys.stdout.write(f"largest error of {name}: {mine:.1e}, the loop's {peer:.1e}\n")
    return 0 if ratio.median >= LEAST_RATIO and errors.max() <= LARGEST_ERROR else 1


if __name__ == "__main__":
    sys.exit(main())
