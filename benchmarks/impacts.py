"""`python -m benchmarks.impacts [laws [FIGURE.png]]`: 10,000 impacts with three effects, beside
solve_ivp in a loop.

The loop solves every 200th of them, for its time grows with their number. Both are compared with
solve_ivp at a tolerance of 1e-11. Times are of the processor, one core on both sides. The limit: as
many evaluations of the rates as the loop needs, at what one of a whole batch costs us.

`laws` prints the nominal laws of contact on one impact: a ball of delrin, 30 mm in radius, on 10 mm
of aluminium at 1 m/s. It is a sphere, so that the laws of a sphere and those of a mass can be
compared. A third of its velocity is lost where a law loses energy, as in Fig. 1.7, which FIGURE.png
shows. The exit code is 1 where a law takes more than a second for 1,800 impacts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.impact import impact
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact.integrate_contact import Numbers
from pyroshock.twin.contact.kernel import Law, rates
from pyroshock.twin.contact.laws import ELASTIC, LOSSY
from pyroshock.twin.contact.pulse import Law as PulseLaw
from pyroshock.twin.contact.restitution_laws import constant

from .harness import (
    Figure,
    beside,
    processor_seconds,
    promised,
    report,
    table,
    table_row,
    take_turns,
    wall_seconds,
)
from .shared_records import ball, impacts

THEME = "Impacts in one call, beside solve_ivp one after the other"
#: Impacts, every so many of which the loop solves.
IMPACTS, LOOP_EVERY, REPEATS = 10_000, 200, 5
LIMIT, LARGEST_ERROR = 1 / 100, 1e-6
EFFECTS = (ViscousLoss(0.05), PlasticYield(), PlateCompliance(0.3))
#: Force and its slope by depth.
_Course = Callable[[float], tuple[float, float]]
_NAMES = ("peak force", "contact time", "impulse", "separation velocity")
RESTITUTION, LAW_IMPACTS, LAW_LIMIT_S = 2 / 3, 1_800, 1.0
LAWS: Mapping[str, PulseLaw] = {
    **ELASTIC,
    **{name: partial(law, restitution=constant(RESTITUTION)) for name, law in LOSSY.items()},
}


def bodies(every: int = 1, count: int = IMPACTS) -> Bodies:
    """Bullets of 0.1 to 1 kg with a tip of delrin on 10 mm of aluminium, 0.5 to 20 m/s; every
    `every`-th of them."""
    rng = np.random.default_rng(7)
    velocity, mass = rng.uniform(0.5, 20, count), rng.uniform(0.1, 1, count)
    return impacts(impactor_mass_kg=mass[::every], impact_velocity_m_s=velocity[::every])


def ours(some: Bodies) -> NDArray[np.float64]:
    """4 x n."""
    pulse = impact(some, EFFECTS)
    return np.stack(
        [pulse.peak_force_n, pulse.contact_time_s, pulse.impulse_n_s, pulse.separation_velocity_m_s]
    )


def looped(
    some: Bodies, tolerance: float, evaluations: list[int] | None = None
) -> NDArray[np.float64]:
    """The same, one after the other; into `evaluations` goes how often each part asked for the
    rates."""
    prepared, counts = _prepared(some), [] if evaluations is None else evaluations
    names = ("mass_kg", "stiffness_n_mp", "rate_loss_s_m", "yield_load_n", "plate_mobility_m_n_s")
    rows = zip(some.impact_velocity_m_s, *(getattr(prepared, name) for name in names), strict=True)
    return np.array([_solved(tolerance, counts, *map(float, row)) for row in rows]).T


def _prepared(some: Bodies) -> Impacts:
    prepared = Impacts.of(some)
    for effect in EFFECTS:
        prepared = effect.prepare(prepared)
    return prepared


def evaluated(some: Bodies, times: int) -> Callable[[], object]:
    """So many evaluations of the rates of all impacts, as they begin: what a step cannot do
    without."""
    numbers = Numbers.of(_prepared(some))
    names = ("exponent", "damping", "inelasticity", "yield_depth")
    columns = np.stack([getattr(numbers, name) for name in names], axis=1)
    return lambda: _evaluations(columns, times)


@njit()
def _evaluations(columns: NDArray[np.float64], times: int) -> float:
    """Each of another depth, or a compiler would do it once."""
    total = 0.0
    for i in range(len(columns)):
        law = Law(
            columns[i, 0], 1.0, 0.0, columns[i, 3], columns[i, 1], columns[i, 2], 0.0, 0.0, 1.0
        )
        for k in range(times):
            total += rates(law, 0.1 + 0.01 * k, 1.0).force_rate
    return total


def _solved(
    tolerance: float,
    counts: list[int],
    u: float,
    m: float,
    k: float,
    chi: float,
    load: float,
    mobility: float,
) -> tuple[float, float, float, float]:
    """Loading to the turn, unloading to parting; the peak where the force's rate changes its
    sign."""
    from scipy.integrate import solve_ivp

    yields = (load / k) ** (2 / 3)

    def loading(d: float) -> tuple[float, float]:
        d = max(d, 0.0)
        if d < yields:
            return k * d**1.5, 1.5 * k * d**0.5
        return load + 1.5 * load / yields * (d - yields), 1.5 * load / yields

    def unloading(d: float) -> tuple[float, float]:
        share = max(d - stays, 0.0) / recovered
        return top * share**1.5, 1.5 * top / recovered * share**0.5

    def run(
        law: _Course, start: list[float], time: float, stays: float | None
    ) -> tuple[float, list[float], float]:
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
            return (
                slope * rate * grip
                - chi * static * (force / m + mobility * slope * rate * grip) / lossy
            )

        end.terminal, end.direction = True, -1.0  # type: ignore[attr-defined]
        steepness.direction = -1.0  # type: ignore[attr-defined]
        # An event is as exact as the polynomial between two steps.
        solved = solve_ivp(
            rate, (time, time + 1.0), start, "DOP853", events=(end, steepness), rtol=tolerance,
            atol=1e-15,
            first_step=1e-7, max_step=2e-5 if tolerance < 1e-9 else np.inf,
        )  # fmt: skip
        counts.append(int(solved.nfev))
        turns = solved.y_events[1] if solved.y_events else ()
        summit = max((approach(*state)[1] for state in turns), default=0.0)
        return float(solved.t[-1]), [float(x) for x in solved.y[:, -1]], summit

    time, (deepest, v), peak = run(loading, [0.0, u], 0.0, None)
    top = loading(deepest)[0]
    recovered = deepest * top / (k * deepest**1.5) if deepest > yields else deepest
    stays = deepest - recovered
    time, (_, v), _ = run(unloading, [deepest, v], time, stays)
    return max(peak, top), time, m * (u - v), -v


def measure_impacts(
    _folder: Path, count: int = IMPACTS, every: int = LOOP_EVERY, repeats: int = REPEATS
) -> Iterator[Figure]:
    some, all_bodies = bodies(every, count), bodies(1, count)
    evaluations: list[int] = []
    exact = looped(some, 1e-11)
    scale = np.stack(
        [*exact[:3], some.impact_velocity_m_s]
    )  # a velocity near nothing has no relative error
    theirs = np.abs((looped(some, 1e-8, evaluations) - exact) / scale).max(axis=1)
    our_error = np.abs((ours(all_bodies)[:, ::every] - exact) / scale).max(axis=1)
    needed = sum(evaluations) / exact.shape[1]
    peer, loop = "solve_ivp loop", partial(looped, some, 1e-8)
    functions: dict[str, Callable[[], object]] = {"ours": partial(ours, all_bodies), peer: loop}
    functions["bound"] = evaluated(all_bodies, 10)
    shares = {"ours": 1, peer: every, "bound": needed / 10}
    taken = take_turns(functions, repeats, processor_seconds)
    yield beside(
        THEME, f"{count:,} impacts with three effects",
        {k: [shares[k] * t for t in taken[k]] for k in taken}, peer,
        unit="s", limit=LIMIT,
        bound=f"{needed:.0f} evaluations of the rates of each, as the loop needs them",
        question="a batch of impacts",
    )  # fmt: skip
    errors = ", ".join(f"{name} {error:.1g}" for name, error in zip(_NAMES, theirs, strict=True))
    for name, own in zip(_NAMES, our_error, strict=True):
        title = f"largest error of the {name}, against solve_ivp at 1e-11"
        yield promised(
            THEME, title, [float(own)], LARGEST_ERROR, "", bound=f"the loop's at 1e-8: {errors}"
        )


def compare_laws(picture: Path | None = None) -> int:
    rows = []
    at, speeds = ball(impact_velocity_m_s=1.0), np.ones(LAW_IMPACTS)
    momentum, slowest = float(np.squeeze(at.sphere_mass_kg * at.impact_velocity_m_s)), 0.0
    for name, law in LAWS.items():
        pulse = law(at)  # compiled
        seconds = wall_seconds(lambda law=law: law(ball(impact_velocity_m_s=speeds)).force_n())  # type: ignore[misc]
        slowest = max(slowest, seconds)
        time_s, share = (
            pulse.contact_time_s[0],
            pulse.compression_time_s[0] / pulse.contact_time_s[0],
        )
        cells = f"{1e3 * time_s:.4f}", f"{share:.3f}", f"{pulse.peak_force_n[0]:.0f}"
        rows.append(
            table_row(
                name, *cells, f"{pulse.impulse_n_s[0] / momentum:.3f}", f"{1e3 * seconds:.1f}"
            )
        )
    print(
        table(
            (
                "law",
                "contact time, ms",
                "compression, share",
                "peak, N",
                "impulse / m u",
                "1,800 impacts, ms",
            ),
            rows,
        )
    )
    if picture:
        _draw_laws(picture, at)
    return 0 if slowest <= LAW_LIMIT_S else 1


def _draw_laws(path: Path, at: Bodies) -> None:
    """Fig. 1.7: force over peak, time over contact time."""
    canvas, phase = new_figure(6.4, 3.6), np.linspace(0, 1, 501)
    axes = canvas.add_subplot()
    for name, law in LAWS.items():
        pulse, style = law(at), "--" if name in ("hertz", "hunt-crossley") else "-"
        axes.plot(phase, pulse.force_at(phase)[0] / pulse.peak_force_n[0], style, label=name)
    axes.set(
        xlabel="time / contact time",
        ylabel="force / peak",
        title="Nominal pulses, e = 2/3 where a law is lossy",
    )
    axes.legend()
    canvas.savefig(path, dpi=120)


if __name__ == "__main__":
    if sys.argv[1:2] == ["laws"]:
        sys.exit(compare_laws(*map(Path, sys.argv[2:])))
    sys.exit(report(measure_impacts))
