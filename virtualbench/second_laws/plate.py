"""The second laws of the plate: what its modal table becomes.

`table.LAWS` names each law's source; here it stands as an equation. phi are mass-normalised shapes,
f_m the median frequency of the table, f_t the highest. Strengths have the unit of the first laws:
tenths of damping, per cent of frequency, kg of a sensor, Hz of the rigid plate on its springs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...array_types import Floats
from ..plate.modes import PlateModes
from .table import checked_split

#: Sensors on soft mounts resonate here; the dynamic mass is bounded near it.
MOUNT_HZ, LARGEST_GAIN = 14e3, 4.0
PAD_LOSS = 0.5
#: What the second sensor weighs of the first, and how much more high modes feel by its rotation.
SECOND_SENSOR, ROTARY = 0.3, 0.8
#: By how much shear takes back a thickness's gain at the highest mode.
SHEAR = 0.6
#: Across a rolled sheet the modulus is off by so much of what it is off along it.
ACROSS = -0.4
#: A modulus that grows with frequency: by this share of its error in each decade, about the median
#: mode.
PER_DECADE = 0.6
#: Coincidence of 10 mm of steel or aluminium in air, and the efficiency of radiation that a finite
#: plate reaches there.
COINCIDENCE_HZ, LARGEST_EFFICIENCY = 1200.0, 1.5
#: The half width of a sensor's block, and sqrt(D / m'') of 10 mm of steel or aluminium in m2/s.
BLOCK_RADIUS_M, BENDING_M2_S = 0.03, 15.6
#: The order of a foam's fractional derivative: its stiffness goes with that power of frequency.
FOAM_ORDER = 0.4
LEAST_DAMPING = 1e-4


def changed_modes(
    modes: PlateModes, supports: Floats, strengths: Mapping[str, float], split: str
) -> PlateModes:
    """All modes of a plate with its `supports` (points, modes), under effects.

    Raises `ValueError` for a split without laws.
    """
    if checked_split(split) == "calibration":
        return _calibration(modes, strengths)
    laws = _development if split == "development" else _sealed
    return laws(modes, supports, strengths)


def _development(modes: PlateModes, supports: Floats, strengths: Mapping[str, float]) -> PlateModes:
    f = modes.frequencies_hz
    middle, top = float(np.median(f)), float(f[-1])
    # thickness: f (1 + s (1 - 0.6 f^2 / f_t^2) %)
    f = f * (1 + 0.01 * strengths.get("plate.stiffness", 0.0) * (1 - SHEAR * (f / top) ** 2))
    # soft mounts: f / sqrt(1 + sum m / (1 - f^2 / f_mount^2) phi^2)
    mass = strengths.get("plate.sensor_mass", 0.0)
    dynamic = mass * np.minimum(1 / np.maximum(1 - (f / MOUNT_HZ) ** 2, 1e-3), LARGEST_GAIN)
    loaded = f / np.sqrt(1 + dynamic * np.sum(modes.shapes**2, axis=0))
    # pads: f^2 + f_s^2 phi_pad^2 / mean, and half their loss factor by their part of the energy
    felt = np.sum(supports**2, axis=0) / np.mean(np.sum(supports**2, axis=0))
    held = strengths.get("plate.boundary", 0.0) ** 2 * felt
    raised = np.sqrt(loaded**2 + held)
    # Rayleigh: s / 10 zeta_m (f_m / f + f / f_m) / 2
    share = 0.1 * strengths.get("plate.damping", 0.0) * float(np.median(modes.damping))
    added = share * (middle / modes.frequencies_hz + modes.frequencies_hz / middle) / 2
    damping = modes.damping + added + PAD_LOSS / 2 * held / raised**2
    return _with(modes, raised, damping)


def _calibration(modes: PlateModes, strengths: Mapping[str, float]) -> PlateModes:
    """Without the places of supports: a foam lies under all of the plate."""
    from scipy.special import j1

    f = modes.frequencies_hz
    # a modulus that relaxes: f (1 + s (1 + 0.6 lg(f / f_m)) %)
    decades = np.log10(f / float(np.median(f)))
    f = f * (1 + 0.01 * strengths.get("plate.stiffness", 0.0) * (1 + PER_DECADE * decades))
    # wide blocks: f / sqrt(1 + sum m (2 J1(k a) / (k a))^2 phi^2)
    across = np.sqrt(2 * np.pi * f / BENDING_M2_S) * BLOCK_RADIUS_M
    mass = strengths.get("plate.sensor_mass", 0.0) * (2 * j1(across) / across) ** 2
    loaded = f / np.sqrt(1 + mass * np.sum(modes.shapes**2, axis=0))
    # foam: f^2 + f_s^2 (f / f_1)^0.4, and the loss factor tan(0.4 pi / 2) of that power
    held = strengths.get("plate.boundary", 0.0) ** 2 * (loaded / loaded[0]) ** FOAM_ORDER
    raised = np.sqrt(loaded**2 + held)
    # radiation: s / 10 zeta_m over its share at coincidence
    share = 0.1 * strengths.get("plate.damping", 0.0) * float(np.median(modes.damping))
    foam = np.tan(FOAM_ORDER * np.pi / 2) / 2 * held / raised**2
    return _with(modes, raised, modes.damping + share * radiated(modes.frequencies_hz) + foam)


def radiated(frequencies_hz: Floats) -> Floats:
    """Damping by radiation (n,) over that at coincidence: sigma / f, as rho_0 c sigma / (omega m'')
    is its loss factor.

    The efficiency sigma is 1 / sqrt(1 - f_c / f) above, at most 1.5, and falls with the square of
    frequency below.
    """
    x = frequencies_hz / COINCIDENCE_HZ
    above = 1 / np.sqrt(np.maximum(1 - 1 / np.maximum(x, 1.0), LARGEST_EFFICIENCY**-2))
    return np.asarray(np.where(x < 1, x, above / LARGEST_EFFICIENCY / x))


def _sealed(modes: PlateModes, supports: Floats, strengths: Mapping[str, float]) -> PlateModes:
    from scipy.linalg import eigh

    f = modes.frequencies_hz
    # a rolled sheet: every second mode bends across
    family = np.where(np.arange(f.size) % 2 == 0, 1.0, ACROSS)
    f = f * (1 + 0.01 * strengths.get("plate.stiffness", 0.0) * family)
    # unlike sensors with rotary inertia: f / sqrt(1 + sum m_k phi_k^2 (1 + 0.8 f / f_t))
    mass = (
        strengths.get("plate.sensor_mass", 0.0)
        * np.array([1.0, SECOND_SENSOR])[: modes.shapes.shape[0]]
    )
    f = f / np.sqrt(1 + mass @ modes.shapes**2 * (1 + ROTARY * f / f[-1]))
    # cables: s / 10 zeta_m phi_sensor^2 / mean
    there = np.sum(modes.shapes**2, axis=0)
    share = 0.1 * strengths.get("plate.damping", 0.0) * float(np.median(modes.damping))
    modes = _with(modes, f, modes.damping + share * there / there.mean())
    swing = (2 * np.pi * strengths.get("plate.boundary", 0.0)) ** 2
    if not swing:
        return modes
    # two supports alone hold, with all of the stiffness
    points = supports[:2]
    scale = swing / np.mean(np.sum(points**2, axis=0))
    squares, vectors = eigh(np.diag((2 * np.pi * f) ** 2) + scale * points.T @ points)
    return replace(
        modes,
        frequencies_hz=np.sqrt(np.maximum(squares, 0.0)) / (2 * np.pi),
        damping=(vectors**2).T @ modes.damping,
        shape_impact=modes.shape_impact @ vectors,
        shapes=modes.shapes @ vectors,
    )


def _with(modes: PlateModes, frequencies_hz: Floats, damping: Floats) -> PlateModes:
    return replace(
        modes, frequencies_hz=frequencies_hz, damping=np.clip(damping, LEAST_DAMPING, 0.5)
    )
