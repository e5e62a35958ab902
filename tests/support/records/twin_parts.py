"""Parts of a twin whose answers are known: a half-sine contact, plates of few modes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pyroshock.array_types import Floats
from pyroshock.twin.contact_interface import ForcePulses, ImpactBatch, OutOfDomain
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.setting import THESIS, Setting

BENCH = GunBench(
    tank_volume_m3=0.0095, bore_diameter_m=0.049, projectile_diameter_m=0.048, travel_m=0.9,
    friction_coefficient=1.464, heat_capacity_ratio=1.4, efficiency=0.5,
)  # fmt: skip


@dataclass(frozen=True)
class HalfSine:
    """Impulse 2 m u, over a time of its own; two normals scatter force and time."""

    contact_time_s: float = 4e-4
    scatter: float = 0.2
    points: int = 201

    label = "half-sine"
    normals = 2

    def pulses(self, strikes: ImpactBatch, z: Floats | None = None) -> ForcePulses:
        mass = np.array([setting.impactor_mass_kg for setting in strikes.settings])
        time = np.full(len(strikes), self.contact_time_s)
        peak = np.pi * mass * strikes.impact_velocity_m_s / time
        if z is not None:
            peak, time = (
                peak * np.exp(self.scatter * z[:, 0]),
                time * np.exp(self.scatter * z[:, 1]),
            )
        shape = np.sin(np.pi * np.linspace(0, 1, self.points))
        shape[-1] = 0.0
        return ForcePulses(time, peak[:, None] * shape, time / 2)

    def outside(self, strikes: ImpactBatch) -> list[tuple[OutOfDomain, ...]]:
        told = (
            (OutOfDomain("impact_velocity", float(u), "0 to 30"),)
            for u in strikes.impact_velocity_m_s
        )
        return [one if float(one[0].value) > 30 else () for one in told]


def rigid_plate(mass_kg: float = 8.0) -> ModalPlate:
    """One rigid mode, without rotation, and one at 1 kHz that is felt nowhere."""
    shape = np.array([[mass_kg**-0.5, 0.0]])
    return ModalPlate(
        np.array([0.0, 1e3]), np.zeros(2), shape, np.vstack([shape, shape]), ("#1",), ("a1", "a2")
    )


def ringing_plate(modes: int = 40) -> ModalPlate:
    """Modes from 150 Hz to 15 kHz, damping of 1 %, shapes drawn once; two impact points."""
    rng = np.random.default_rng(3)
    return ModalPlate(
        frequency_hz=np.geomspace(150, 15e3, modes),
        damping_ratio=np.full(modes, 0.01),
        shape_impact=0.5 * rng.standard_normal((2, modes)),
        shapes=0.5 * rng.standard_normal((2, modes)),
        impact_points=("#1", "#2"),
        sensors=("a1", "a2"),
    )


def unsolved(
    drawing: Any, _material: Any, _highest_hz: float, _folder: Any, points: int = 2
) -> ModalPlate:
    """In place of `app.twins.solved`, which takes ten seconds: a ringing plate at the drawing's
    first points."""
    plate, named = ringing_plate(), tuple(drawing.impact_points)[:points]
    shapes = plate.shape_impact[: len(named)]
    return replace(plate, impact_points=named, shape_impact=shapes, sensors=tuple(drawing.sensors))


def setting(**own: Any) -> Setting:
    """Half a kilogram of steel on aluminium at 8 m/s, unless told."""
    given: dict[str, Any] = {
        "impactor_mass_kg": 0.5, "tip": THESIS["steel"], "tip_radius_m": 0.045,
        "plate": THESIS["aluminum"],
        "plate_thickness_m": 0.01, "plate_mass_kg": 8.0,
    }  # fmt: skip
    if "tank_pressure_pa" not in own:
        given["impact_velocity_m_s"] = 8.0
    return Setting(**given | own)
