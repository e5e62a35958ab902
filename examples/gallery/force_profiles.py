"""Fig. 1.7: the force of Hunter's, Reed's and the asymmetric von Hann pulse over one contact."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.laws import hunter, reed, von_hann
from pyroshock.twin.contact.pulse import Law
from pyroshock.twin.contact.restitution_laws import constant

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: The figure's; only the von Hann pulse loses energy.
RESTITUTION = 2 / 3
LAWS: Mapping[str, Law] = {
    "Hunter": hunter,
    "Reed": reed,
    "asymmetric von Hann": partial(von_hann, restitution=constant(RESTITUTION)),
}


def ball() -> Bodies:
    """A ball of delrin, 30 mm in radius, on a plate of aluminium at 1 m/s; the shapes do not depend
    on it."""
    return Bodies.of(
        impactor_radius_m=0.03,
        impactor_youngs_modulus_pa=3.2e9,
        impactor_poisson_ratio=0.35,
        impactor_density_kg_m3=1410.0,
        impactor_mass_kg=4 / 3 * np.pi * 1410.0 * 0.03**3,
        target_youngs_modulus_pa=69.9e9,
        target_poisson_ratio=0.33,
        target_density_kg_m3=2700.0,
        impact_velocity_m_s=1.0,
    )


def draw() -> Figure:
    """Force over its peak against time over the contact time."""
    phase = np.linspace(0, 1, 501)
    figure = new_figure(6.4, 3.8)
    axes = figure.subplots()
    for name, law in LAWS.items():
        pulse = law(ball())
        axes.plot(phase, pulse.force_at(phase)[0] / pulse.peak_force_n[0], label=name)
    axes.set_xlabel("time over contact time (-)")
    axes.set_ylabel("force over peak force (-)")
    axes.set_title("Normalised pulses, restitution 2/3 for the von Hann pulse")
    axes.legend(frameon=False)
    return figure
