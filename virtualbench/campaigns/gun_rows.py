"""A row of a gun's plan as the bench plays it, and what is sealed of its shot."""

from __future__ import annotations

import math

import numpy as np

from ..gun.truth import ShotTruth
from ..gun.valve import ValveWay
from ..impact.build import Impactor, ImpactTarget, target
from ..impact.impactors import projectile
from ..impact.strike import ImpactTruth
from ..plate.resonant import IMPACT_POINTS_M, OUTLINE_M
from .base import Row, Truth, cell, positive
from .plates import THICKNESS_M, Key

#: Where the bullet can hit: the frame moves sideways in front of the gun. The first is the default.
POSITIONS = ("#1", "#2", "#3")
#: Of the chains on which the plate hangs (thesis, section 2.1.1).
CHAIN_PITCH_MM = 56.0


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


def chain_height_of(row: Row) -> float:
    """The optional column `chain_height_mm`, in m: by which the plate hangs higher, in links of 56 mm; 0 without one.

    Raises `ValueError` naming the run, also for a plate so high or low that the bullet misses it.
    """
    text = (row.get("chain_height_mm") or "0").strip()
    try:
        links = float(text) / CHAIN_PITCH_MM
    except ValueError:
        links = math.nan
    if not abs(links - round(links) if math.isfinite(links) else math.inf) < 1e-6:
        raise ValueError(
            f"plan: run {row.get('run', '?')}: chain_height_mm is {text!r}; expected a multiple of {CHAIN_PITCH_MM:g}"
        )
    height = links * CHAIN_PITCH_MM * 1e-3
    x, y = IMPACT_POINTS_M[point_of(row)]
    corners = zip(OUTLINE_M, (*OUTLINE_M[1:], OUTLINE_M[0]), strict=True)
    if any((x1 - x0) * (y - height - y0) < (y1 - y0) * (x - x0) for (x0, y0), (x1, y1) in corners):
        raise ValueError(f"plan: run {row.get('run', '?')}: chain_height_mm is {text!r}: the bullet misses the plate")
    return height


def impactor_of(row: Row) -> Impactor:
    radius = positive(row, "tip_radius_mm") * 1e-3
    return projectile(positive(row, "bullet_mass_kg"), cell(row, "tip_material"), radius)


def target_of(row: Row) -> ImpactTarget:
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
