"""Fig. 2.12: how tank pressure and bullet mass set the exit velocity."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.twin.gun.nominal import muzzle_velocity

from .picture import QUIET
from .shipped_shots import gun

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The bullet of the preliminary tests (section 3.1), and the levels of Table 3.2.
MASSES_KG = (0.1428, 0.2, 0.5, 1.0)
#: What the regulator gives at most (section 2.1.2).
MOST_BAR = 8.0
#: What the bench is designed for, with 1 kg (section 2.1.3).
DESIGN_M_S = 80.0


def draw() -> Figure:
    """A line a mass, over the gauge pressures that the regulator gives."""
    bench = gun()
    pressure_bar = np.linspace(0, MOST_BAR, 161)
    figure = new_figure(6.8, 4.2)
    axes = figure.subplots()
    for mass in MASSES_KG:
        axes.plot(
            pressure_bar, muzzle_velocity(bench, pressure_bar * 1e5, mass), label=f"{mass:g} kg"
        )
    axes.axhline(DESIGN_M_S, color=QUIET, lw=0.8, label=f"design, 1 kg at {DESIGN_M_S:g} m/s")
    axes.set_xlabel("tank pressure, gauge (bar)")
    axes.set_ylabel("exit velocity (m/s)")
    axes.set_title(f"Nominal gun, eq. 2.16, efficiency {bench.efficiency:g} (eq. 2.18)")
    axes.set_ylim(0, 1.06 * DESIGN_M_S)
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(0.0, 0.93))
    return figure
