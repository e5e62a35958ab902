"""`python -m benchmarks.contact_laws [FIGURE.png]`: the nominal laws of contact on one impact, as Markdown.

A ball of delrin, 30 mm in radius, on 10 mm of aluminium at 1 m/s: a sphere, so that the laws of a sphere and those of a
mass can be held against each other, losing a third of its velocity as in Fig. 1.7. FIGURE.png draws that figure. The
exit code is 1 where a law takes more than a second for 1,800 impacts.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.laws import ELASTIC, LOSSY
from pyroshock.twin.contact.pulse import Law
from pyroshock.twin.contact.restitution_laws import constant

RESTITUTION, IMPACTS, LIMIT_S = 2 / 3, 1_800, 1.0
LAWS: Mapping[str, Law] = {
    **ELASTIC,
    **{name: partial(law, restitution=constant(RESTITUTION)) for name, law in LOSSY.items()},
}


def balls(n: int) -> Bodies:
    """n impacts of the ball at 1 m/s."""
    radius, density = 0.03, 1410.0
    return Bodies.of(
        impactor_radius_m=np.full(n, radius),
        impactor_youngs_modulus_pa=3.2e9,
        impactor_poisson_ratio=0.35,
        impactor_density_kg_m3=density,
        impactor_mass_kg=4 / 3 * np.pi * density * radius**3,
        target_youngs_modulus_pa=69.9e9,
        target_poisson_ratio=0.33,
        target_density_kg_m3=2700.0,
        plate_thickness_m=0.01,
        impact_velocity_m_s=1.0,
    )


def row(name: str, law: Law, seconds: float) -> str:
    one, ball = law(balls(1)), balls(1)
    momentum = float((ball.sphere_mass_kg * ball.impact_velocity_m_s)[0])
    cells = [
        f"{1e3 * one.contact_time_s[0]:.4f}",
        f"{one.compression_time_s[0] / one.contact_time_s[0]:.3f}",
        f"{one.peak_force_n[0]:.0f}",
        f"{one.impulse_n_s[0] / momentum:.3f}",
        f"{1e3 * seconds:.1f}",
    ]
    return f"| {name} | {' | '.join(cells)} |"


def draw(path: Path) -> None:
    """Fig. 1.7: force over peak, time over contact time."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.add_subplot()
    phase = np.linspace(0, 1, 501)
    for name, law in LAWS.items():
        pulse = law(balls(1))
        style = "--" if name in ("hertz", "hunt-crossley") else "-"
        axes.plot(phase, pulse.force_at(phase)[0] / pulse.peak_force_n[0], style, label=name)
    axes.set_xlabel("time / contact time")
    axes.set_ylabel("force / peak")
    axes.set_title("Nominal pulses, e = 2/3 where a law loses energy")
    axes.legend()
    figure.savefig(path, dpi=120)


def main(arguments: list[str]) -> int:
    sys.stdout.write("| law | contact time, ms | compression, share | peak, N | impulse / m u | 1,800 impacts, ms |\n")
    sys.stdout.write("| --- | --- | --- | --- | --- | --- |\n")
    slowest = 0.0
    for name, law in LAWS.items():
        started = time.perf_counter()
        law(balls(IMPACTS)).force_n()
        seconds = time.perf_counter() - started
        slowest = max(slowest, seconds)
        sys.stdout.write(row(name, law, seconds) + "\n")
    if arguments:
        draw(Path(arguments[0]))
    return 0 if slowest <= LIMIT_S else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
