"""The contact's second laws for calibration, as curves of force over indentation and figures of
what moves.

`table.LAWS` names each law's source; here it stands as an equation. Strength s of each, d the
indentation:

- loss: F + c d', c = 2 z sqrt(m k) of the strength that Hertz's contact has at 1 m/s, by the tip's
  material;
- yield: F = pi a^2 p beyond the Hertzian onset, p = 2/3 Y (1.8 + ln(E a / (3 Y R))) up to 3 Y, a^2
  = R d, Y the yield strength over 2 s at the rate of strain, Y (1 + (e' / D)^(1/q));
- layer: d + s sqrt(F t / (pi R E)), in series with the contact;
- plate: s (F + 1.29 F') / Z, F' the force behind a low pass of 0.1 ms: an edge more than doubles
  the mobility for long;
- mass: 0.2 kg that pushes and is pushed by s times 10 N of dry friction;
- tip: a profile r^4 / (2 R (r^2 + b^2)), b = s times 0.15 mm and the wear of the tip's material.
"""

from __future__ import annotations

import math

import numpy as np

from ...array_types import Floats
from .owners import tip_value

#: The part of the speed that the damper takes at strength 1 and 1 m/s, by tip.
LOST_AT_1_M_S = {
    "aluminum": 0.025,
    "steel": 0.02,
    "delrin": 0.08,
    "polyurethane": 0.15,
    "PLA": 0.08,
}
#: D (1/s) and q of Cowper and Symonds by the softer material: mild steel and aluminium as Jones has
#: them, polymers by the order of magnitude.
RATE_1_S = {"aluminum": 6500.0, "steel": 40.4, "delrin": 500.0, "polyurethane": 500.0, "PLA": 500.0}
RATE_ROOT = {"aluminum": 4.0, "steel": 5.0, "delrin": 3.0, "polyurethane": 3.0, "PLA": 3.0}
#: Mean pressure over yield strength at the onset of yield, and at most.
ONSET_RATIO, FULL_RATIO = 1.1, 3.0
#: Tabor's representative strain over a / R.
STRAIN_SHARE = 0.2
SHEET_THICKNESS_M, SHEET_MODULUS_PA = 3e-3, 5e8
#: Impedances of Cremer, Heckl and Petersson: 8 sqrt(D m'') far from edges, 3.5 at a free one. Waves
#: take this time to one that is 40 mm away, d^2 sqrt(m'' / D).
EDGE_GAIN, EDGE_S = 8 / 3.5 - 1, 1e-4
JOINT_KG, JOINT_N, SLIP_M_S = 0.2, 10.0, 0.01
CROWN_M = 1.5e-4


def dashpot_n_s_m(mass_kg: float, time_1_m_s: float, lost: float) -> float:
    """The damper that takes a share of the speed from a linear oscillator with the contact time of
    Hertz at 1 m/s."""
    return -2 * mass_kg * math.log(max(1 - lost, 0.1)) / time_1_m_s


def dynamic_yield_pa(yield_pa: float, rate_1_s: float, material: str) -> float:
    """Yield strength at a rate of strain, by Cowper and Symonds. Raises `ValueError` for an unknown
    material."""
    root = tip_value(RATE_ROOT, material)
    share = float((rate_1_s / tip_value(RATE_1_S, material)) ** (1 / root))
    return yield_pa * (1 + share)


def strain_rate_1_s(depth_m: float, radius_m: float, time_s: float) -> float:
    """Tabor's strain of the deepest indentation over half of the contact's time."""
    return STRAIN_SHARE * math.sqrt(depth_m / radius_m) / (time_s / 2)


def cavity(
    depth_m: Floats, modulus: float, radius: float, yield_pa: float
) -> tuple[Floats, Floats]:
    """Force (N) and residual depth (m) by Johnson's expanding cavity, beyond a mean pressure of 1.1
    yield strengths."""
    onset = radius * (3 * math.pi * ONSET_RATIO * yield_pa / (4 * modulus)) ** 2
    contact = np.sqrt(radius * depth_m)
    # the constant, 1.7 of Johnson, with which the onset's pressure is Hertz's
    constant = 1.5 * ONSET_RATIO - math.log(math.pi * ONSET_RATIO / 4)
    growing = 2 / 3 * (constant + np.log(modulus * contact / (3 * yield_pa * radius)))
    plastic = math.pi * contact**2 * yield_pa * np.minimum(growing, FULL_RATIO)
    beyond = depth_m > onset
    force = np.where(beyond, plastic, 4 / 3 * modulus * math.sqrt(radius) * depth_m**1.5)
    elastic = np.minimum(3 * force / (4 * modulus * contact), depth_m)
    return np.asarray(force), np.asarray(np.where(beyond, depth_m - elastic, 0.0))


def on_sheet(
    depth_m: Floats, force_n: Floats, residual_m: Floats, radius: float, strength: float
) -> tuple[Floats, Floats]:
    """Force and residual depth of a curve in series with a thin sheet, whose indentation is the
    root of force."""
    bed = math.pi * radius * SHEET_MODULUS_PA / SHEET_THICKNESS_M
    whole = depth_m + strength * np.sqrt(force_n / bed)
    force = np.exp(np.interp(np.log(depth_m), np.log(whole), np.log(force_n)))
    # below the indentation under the least tabulated force the sheet alone gives way
    force = force * np.minimum(depth_m / whole[0], 1.0) ** 2
    return np.asarray(force), np.asarray(np.interp(depth_m, whole, residual_m))


def worn_crown(depth_m: Floats, modulus: float, radius: float, crown_m: float) -> Floats:
    """Force (N) of a ball with the profile r^4 / (2 R (r^2 + b^2)), b the crown's radius, by
    Sneddon's integrals."""
    narrow = math.sqrt(radius * depth_m[0])
    wide = (
        2 * math.sqrt(radius * depth_m[-1] + crown_m**2)
        + 2 * (crown_m**2 * radius * depth_m[-1]) ** 0.25
    )
    a = np.geomspace(narrow / 4, wide, 16 * depth_m.size)
    depth = crown_depth_m(a, radius, crown_m)
    slope = 2 * modulus * a  # of force over depth, for any body of revolution
    # below the first point the profile is a power of r, and force the power of depth that its slope
    # has there
    power = 1 + (np.log(a[1]) - np.log(a[0])) / (np.log(depth[1]) - np.log(depth[0]))
    shallow = slope[0] * depth[0] / power
    force = shallow + np.concatenate(
        [[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2 * np.diff(depth))]
    )
    return np.asarray(np.exp(np.interp(np.log(depth_m), np.log(depth), np.log(force))))


def crown_depth_m(contact_m: Floats, radius: float, crown_m: float) -> Floats:
    """Indentation at which the contact has a radius: a times the integral of the profile's slope
    over its depth."""
    if crown_m == 0:
        return np.asarray(contact_m**2 / radius)
    share = (contact_m / crown_m) ** 2
    ratio = np.sqrt(share / (1 + share))  # a / sqrt(a^2 + b^2)
    missing = (
        crown_m**2 / (2 * (1 + share)) * (1 + np.arcsinh(np.sqrt(share)) / (ratio * (1 + share)))
    )
    exact = contact_m**2 - missing * share
    # the difference is all rounding where the contact is far smaller than the crown: its series
    series = 4 / 3 * contact_m**4 / crown_m**2
    return np.asarray(np.where(share < 1e-4, series, exact) / radius)
