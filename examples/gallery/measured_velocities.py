"""Fig. 5.2: the five measured shots on the velocity model, and its mean absolute error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.twin.gun.nominal import muzzle_velocity

from .picture import MEASURED, MODEL
from .shipped_shots import gun, shots

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def errors_percent(found: Sequence[Mapping[str, Any]]) -> list[float]:
    """Eq. 5.1 for each shot: negative where the model predicts too much."""
    predicted = [
        float(muzzle_velocity(gun(), s["tank_pressure_pa"], s["bullet_mass_kg"])) for s in found
    ]
    return [
        100 * (1 - v / shot["measured_velocity_m_s"])
        for shot, v in zip(found, predicted, strict=True)
    ]


def draw() -> Figure:
    """Velocities by laser with twice their standard uncertainty, on the model of the nominal
    gun."""
    found = shots()
    pressure_bar = np.linspace(0.05, 0.7, 200)
    mean = np.mean(np.abs(errors_percent(found)))
    figure = new_figure(6.8, 4.2)
    axes = figure.subplots()
    velocity = muzzle_velocity(gun(), pressure_bar * 1e5, found[0]["bullet_mass_kg"])
    axes.plot(pressure_bar, velocity, color=MODEL, label="model, eq. 2.16 and 2.18")
    axes.errorbar(
        [shot["tank_pressure_pa"] / 1e5 for shot in found],
        [shot["measured_velocity_m_s"] for shot in found],
        yerr=[2 * shot["measured_velocity_u_m_s"] for shot in found],
        fmt="o",
        color=MEASURED,
        capsize=3,
        label="measured by laser (bars: 2u, eq. 5.2)",
    )
    axes.set_xlabel("tank pressure, gauge (bar)")
    axes.set_ylabel("exit velocity (m/s)")
    axes.set_title(f"Five shots: mean absolute error {mean:.2f} %")
    axes.legend(frameon=False)
    return figure
