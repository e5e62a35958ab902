"""A row of a gun's plan as the bench plays it, and what is sealed of its shot."""

from __future__ import annotations

import math

import numpy as np

from ..gun.truth import ShotTruth
from ..gun.valve import ValveWay
from ..impact.build import Impactor, Target, target
from ..impact.impactors import projectile
from ..impact.strike import ImpactTruth
from .base import Row, Truth, cell, positive
from .plates import THICKNESS_M, Key

#: Where the bullet can hit: the frame moves sideways in front of the gun. The first is the default.
POSITIONS = ("#1", "#2", "#3")


def plate_of(row: Row) -> Key:
    return cell(row, "plate_material"), "free"


def point_of(row: Row) -> int:
    """The plate's impact point in the optional column `impact_position`; the first without one."""
    return POSITIONS.index(cell(row, "impact_position", POSITIONS)) if row.get("impact_position") else 0


def valve_way_of(row: Row) -> ValveWay | None:
    """The optional column `valve_profile`: "0:0 0.1:1", points of time (s) and the ball's position; None without one.

    Raises `ValueError` naming the run.
    """
    text = (row.get("valve_profile") or "").strip()
    if not text:
        return None
    try:
        points = [tuple(map(float, point.split(":"))) for point in text.replace(",", " ").split()]
        moments, positions = zip(*points, strict=True)
        return ValveWay(moments, positions)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"plan: run {row.get('run', '?')}: valve_profile is {text!r}; expected points TIME:POSITION in s and 0 "
            "(shut) to 1 (open), such as '0:0 0.1:1'"
        ) from error


def impactor_of(row: Row) -> Impactor:
    radius = positive(row, "tip_radius_mm") * 1e-3
    return projectile(positive(row, "bullet_mass_kg"), cell(row, "tip_material"), radius)


def target_of(row: Row) -> Target:
    anvil, insulator = cell(row, "anvil_material"), cell(row, "insulator")
    return target(cell(row, "plate_material"), THICKNESS_M, anvil_material=anvil, insulator=insulator)


def truth_of(shot: ShotTruth, impact: ImpactTruth | None, origin_s: float, start_s: float, length_m: float) -> Truth:
    """Of a shot whose valve begins to turn at `origin_s` of the recording, and whose impact is at `start_s`."""
    truth: Truth = {
        "tank_pressure_pa": float(shot.tank_pressure_pa[0]),
        "muzzle_velocity_m_s": shot.muzzle_velocity_m_s,
        "bullet_length_m": length_m,
        "exit_time_s": shot.exit_time_s if math.isfinite(shot.exit_time_s) else None,
        "valve_opens_s": origin_s + shot.port_opens_s if math.isfinite(shot.port_opens_s) else None,
        "velocity_m_s": shot.impact_velocity_m_s,
    }
    if impact is None:
        return truth
    return truth | {
        "start_s": start_s,
        "mass_kg": impact.mass_kg,
        "contact_time_s": impact.contact_time_s,
        "restitution": impact.restitution,
        "peak_force_n": impact.peak_force_n,
        "peak_plate_force_n": float(impact.plate_force_n.max()),
        "contacts": impact.contacts,
        "impulse_n_s": float(np.trapezoid(impact.force_n, impact.time_s)),
    }
