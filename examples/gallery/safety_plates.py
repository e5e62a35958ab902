"""Fig. 2.6 and 2.7: ballistic limit of a safety plate of aluminium and of steel, for 1 kg of 48
mm."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.doe.limits.ballistic import (
    bulk_modulus,
    forrestal_limit,
    forrestal_thickness,
    hole_opening_stress,
    nishiwaki_limit,
    nishiwaki_thickness,
)

from .picture import MODEL, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROJECTILE_KG, DIAMETER_M = 1.0, 0.048
#: What the thesis sizes the plates for.
VELOCITY_M_S = 150.0
#: The least yield strength of S355 (EN 10025-2), the plate's steel; Table 4.2 has 400 MPa.
S355_PA = 355e6


def draw() -> Figure:
    """Ballistic limit against thickness; a cross where it is 150 m/s."""
    figure = new_figure(9.5, 3.8)
    aluminium, steel = figure.subplots(1, 2)
    _draw_limit(aluminium, nishiwaki_limit, 15.0, "eq. 2.1")
    _mark(aluminium, nishiwaki_thickness(PROJECTILE_KG, DIAMETER_M, VELOCITY_M_S))
    aluminium.set_title("Aluminium (Fig. 2.6)")
    s355 = hole_opening_stress(S355_PA, bulk_modulus(200e9, 0.3), 0.3)
    _draw_limit(steel, forrestal_limit, 10.0, "eq. 2.2, 400 MPa (Table 4.2)")
    of_s355 = partial(forrestal_limit, opening_stress_pa=s355)
    _draw_limit(steel, of_s355, 10.0, "eq. 2.2, 355 MPa (S355)", "--")
    _mark(steel, forrestal_thickness(PROJECTILE_KG, DIAMETER_M, VELOCITY_M_S))
    steel.set_title("Steel (Fig. 2.7)")
    for axes in (aluminium, steel):
        axes.legend(frameon=False, loc="lower right")
    return figure


def _draw_limit(
    axes: Any,
    limit: Callable[[float, float, float], float],
    thickest_mm: float,
    label: str,
    style: str = "-",
) -> None:
    thickness_mm = np.linspace(thickest_mm / 100, thickest_mm, 100)
    limits = [limit(PROJECTILE_KG, DIAMETER_M, each * 1e-3) for each in thickness_mm]
    axes.plot(thickness_mm, limits, style, color=MODEL, label=label)
    axes.set_xlabel("thickness of the plate (mm)")
    axes.set_ylabel("ballistic limit velocity (m/s)")


def _mark(axes: Any, thickness_m: float) -> None:
    axes.axhline(VELOCITY_M_S, color=QUIET, lw=0.8)
    label = f"{VELOCITY_M_S:g} m/s at {thickness_m * 1e3:.1f} mm"
    axes.plot([thickness_m * 1e3], [VELOCITY_M_S], "x", color="black", ms=8, label=label)
