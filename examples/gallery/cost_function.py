"""Fig. 5.3: the cost of eq. 5.4 around a pulse, and its tolerances in time and force."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.training.evaluation.metrics import FORCE_SPREAD, TIME_SPREAD

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Floats = NDArray[np.float64]

#: A generic pulse: the asymmetric shape of a contact that loses energy, in units of contact time
#: and peak force.
PHASE: Floats = np.linspace(0.0, 1.0, 400)
PULSE: Floats = np.sin(np.pi * PHASE**0.85) ** 1.4


def element_cost(late: Floats, off: Floats) -> Floats:
    """The summand of eq. 5.4 for errors in time (of the contact time) and in force (of the peak),
    broadcasting."""
    return np.asarray(-np.expm1(-((late / TIME_SPREAD) ** 2 + (off / FORCE_SPREAD) ** 2) / 2))


def cost_map(time: Floats, force: Floats) -> Floats:
    """The cost (f, t) of a point at each time (t,) and force (f,), measured to the pulse's nearest
    element."""
    late = time[:, None] - PHASE
    return np.stack([element_cost(late, each - PULSE).min(axis=1) for each in force])


def draw() -> Figure:
    """The colour is what one element of a predicted pulse would cost there: 0 on the pulse, 1 far
    from it."""
    time, force = np.linspace(-0.2, 1.2, 281), np.linspace(-0.3, 1.3, 201)
    figure = new_figure(6.8, 4.4)
    axes = figure.subplots()
    picture = axes.pcolormesh(
        time, force, cost_map(time, force), cmap="viridis_r", vmin=0, vmax=1, rasterized=True
    )
    axes.plot(PHASE, PULSE, color="black", lw=1.2, label="measured pulse")
    top = int(np.argmax(PULSE))
    tolerances = "5 % of the contact time, 10 % of the peak"
    axes.errorbar(
        PHASE[top],
        1.0,
        FORCE_SPREAD,
        TIME_SPREAD,
        fmt="none",
        color="#d55e00",
        lw=1.4,
        capsize=3,
        label=tolerances,
    )
    axes.set_xlabel("time over contact time (-)")
    axes.set_ylabel("force over peak force (-)")
    figure.legend(loc="outside upper center", ncols=2, frameon=False)
    figure.colorbar(picture, ax=axes, label="cost of an element, eq. 5.4 (-)")
    return figure
