"""The second laws of the contact: an impactor, a contact, a layer, a plate and a hand.

`table.LAWS` names each law's source; here it stands as an equation. Strength s of each, d the
indentation:

- loss: development: F (1 + 1.5 s A d' / d); sealed: F + c d^0.25 d', c = alpha(e) sqrt(m K), e = 1
  - s l;
- yield: development: beyond the Hertzian onset F_y (d / d_y)^(n / 2), n Meyer's index, back with
  the radius of the contact that was left; sealed: Jackson and Green's curve with yield strength
  over s, back to their residual;
- layer: development: t F / (E A + F / e_d), times s; sealed: k u + c u' = F, k and c over s;
- plate: development: s F / Z and s (k y + c y' = F); sealed: s times the modes of a plate of finite
  size;
- mass: development: m (1 + 0.05 s k), k of the tip; sealed: a hand of 0.5 kg behind s times a
  spring and a damper;
- tip: development: P = 2 E / 3 R (2 a^2 + b^2) sqrt(a^2 - b^2), d = a sqrt(a^2 - b^2) / R, b = s
  times 0.1 mm; sealed: the ball goes over into its tangent cone at a contact of radius b = 2 mm /
  s.

A curve of force over indentation is tabulated, evenly in the logarithm; a tip's shape multiplies it
by its own curve over Hertz's. The laws for calibration stand in `contact_calibration`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit

from ...array_types import Floats
from ..impact.build import Impactor, ImpactTarget
from ..impact.kernel import CREEPING
from .contact_calibration import (
    CROWN_M,
    EDGE_GAIN,
    EDGE_S,
    JOINT_KG,
    JOINT_N,
    LOST_AT_1_M_S,
    SLIP_M_S,
    cavity,
    dashpot_n_s_m,
    dynamic_yield_pa,
    on_sheet,
    strain_rate_1_s,
    worn_crown,
)
from .owners import tip_value
from .table import checked_split

#: A of Kuwabara and Kono in s, and the part of the speed lost by Tsuji's damper at strength 1, by
#: tip.
KUWABARA_KONO_S = {
    "aluminum": 1.5e-6,
    "steel": 1.0e-6,
    "delrin": 1.2e-5,
    "polyurethane": 1.2e-4,
    "PLA": 1.2e-5,
}
LOST_SPEED = {"aluminum": 0.03, "steel": 0.02, "delrin": 0.07, "polyurethane": 0.12, "PLA": 0.08}
#: Meyer's index and mean pressure at yield over the yield strength, by the softer material.
MEYER_INDEX = {"aluminum": 2.2, "steel": 2.15, "delrin": 2.35, "polyurethane": 2.4, "PLA": 2.3}
YIELD_RATIO = {"aluminum": 2.8, "steel": 2.9, "delrin": 2.3, "polyurethane": 2.6, "PLA": 2.2}
#: The area under a tip over pi R^2, as the square of this.
AREA_SHARE = {"aluminum": 0.08, "steel": 0.075, "delrin": 0.10, "polyurethane": 0.14, "PLA": 0.10}
LAYER_MODULUS_PA, LAYER_THICKNESS_M, DENSIFIED_STRAIN = 1.0e9, 3e-3, 0.6
SETTLING_S = 20e-6
SPRING_N_M = {
    "aluminum": 1.2e7,
    "steel": 1.0e7,
    "delrin": 1.6e7,
    "polyurethane": 2.5e7,
    "PLA": 1.6e7,
}
RETARDATION_S = 30e-6
#: Local give of a plate's surface, by its material, and how it lags.
LOCAL_N_M = {"aluminum": 6e8, "steel": 1.5e9, "delrin": 3e7, "polyurethane": 1e6, "PLA": 3e7}
LOCAL_LAG_S = 10e-6
#: The finite plate: sides, the point of impact, loss, and the frequency up to which it has modes.
SIDES_M, POINT_M, MODAL_LOSS, HIGHEST_HZ = (1.0, 0.6), (0.47, 0.28), 0.005, 6000.0
PLATE_THICKNESS_M = 0.010
#: Error of mass by tip, of 5 %.
TIP_MASS = {"aluminum": -0.2, "steel": 0.6, "delrin": -0.5, "polyurethane": -0.6, "PLA": -0.5}
HAND_KG, GRIP_N_M, GRIP_N_S_M = 0.5, 2e4, 20.0
#: Wear of tips over steel's.
WEAR = {"aluminum": 1.0, "steel": 0.7, "delrin": 1.5, "polyurethane": 2.0, "PLA": 1.5}
WORN_FLAT_M, CONE_BEGINS_M = 1e-4, 2e-3
_GRID = 400
_SHALLOWEST_M = 1e-9
_LONGEST = 200  # Hertz times; a later end means that something is wrong
_LOOK = 16

# fmt: off
(MASS, KONO, TSUJI, LAYER, SHEET_N, SHEET_E, KELVIN, KELVIN_N_M, MOBILITY, LOCAL, LOCAL_NM, HAND,
GRIP_NM,
 GRIP_NSM, MODAL, DASHPOT, EDGE, JOINT, RETRACES) = range(19)
# fmt: on
_FIGURES = 19


@dataclass(frozen=True, eq=False)
class LoadingCurve:
    """Force (N) and residual indentation (m), (n,), of a first loading up to `depth_m` (n,), even
    in its logarithm."""

    depth_m: Floats
    force_n: Floats
    residual_m: Floats


def contact_forces(
    impactors: Sequence[Impactor],
    targets: Sequence[ImpactTarget],
    strengths: Mapping[str, float],
    split: str,
    velocities_m_s: Floats,
    *,
    steps_per_contact: int = 300,
) -> list[tuple[float, Floats]]:
    """Of each impact the step (s) and the force (n,) in N, from first contact until it lets go.

    Raises `RuntimeError` for an impact that does not end, `ValueError` for a split without laws.
    """
    checked_split(split)
    return [
        _closing_motion(impactor, target, strengths, split, float(speed), steps_per_contact)
        for impactor, target, speed in zip(impactors, targets, velocities_m_s, strict=True)
    ]


def _closing_motion(
    impactor: Impactor,
    target: ImpactTarget,
    strengths: Mapping[str, float],
    split: str,
    speed: float,
    steps: int,
) -> tuple[float, Floats]:
    modulus = 1 / (impactor.tip.compliance_1_pa + target.face.compliance_1_pa)
    stiffness = 4 / 3 * modulus * math.sqrt(impactor.tip_radius_m)
    f = _figures(impactor, target, strengths, split, stiffness)
    shapes, omega = (
        _plate_modes(target.plate_impedance_n_s_m) if f[MODAL] else (np.zeros(0), np.zeros(0))
    )
    time = 3.218 * (f[MASS] / (stiffness * math.sqrt(speed))) ** 0.4
    deepest = speed * time / 2.943
    rate = strain_rate_1_s(deepest, impactor.tip_radius_m, time) if split == "calibration" else 0.0
    curve = _curve(impactor, target, strengths, split, rate)
    soft = float(np.interp(deepest, curve.depth_m, curve.force_n)) / deepest
    step = 1 / max(_rates(f, 1.5 * max(soft, stiffness * math.sqrt(deepest)), omega), default=0.0)
    step = min(step, time / steps)
    limit = int(_LONGEST * (time + 12 * f[MASS] * f[MOBILITY] / 40) / step)
    tables = (np.log(curve.depth_m[0]), np.log(curve.depth_m[1] / curve.depth_m[0]))
    history = run(f, speed, step, limit, *tables, curve.force_n, curve.residual_m, shapes, omega)
    if not history.size:
        raise RuntimeError(f"an impact at {speed!r} m/s has not ended after {limit} steps")
    return step, history


def _rates(f: Floats, contact_n_m: float, omega: Floats) -> list[float]:
    """What the step has to resolve (1/s)."""
    rates = [1e3, math.sqrt(contact_n_m / f[MASS]) / 0.1, f[MOBILITY] * contact_n_m / 0.5]
    if f[LAYER]:
        rates.append(
            (1 + contact_n_m * f[LAYER] * LAYER_THICKNESS_M / f[SHEET_N]) / SETTLING_S / 0.8
        )
    if f[KELVIN]:
        rates.append((1 + contact_n_m / f[KELVIN_N_M]) / RETARDATION_S / 0.8)
    if f[LOCAL]:
        rates.append((1 + contact_n_m / f[LOCAL_NM]) / LOCAL_LAG_S / 0.8)
    if f[HAND]:
        rates.append(f[GRIP_NSM] * (1 / HAND_KG + 1 / f[MASS]) / 0.8)
    if f[JOINT]:
        rates.append(f[JOINT] / SLIP_M_S * (1 / JOINT_KG + 1 / f[MASS]) / 0.8)
    if f[DASHPOT]:
        rates.append(f[DASHPOT] / f[MASS] / 0.8)
    if f[EDGE]:
        rates.append((1 + EDGE_GAIN) * f[MOBILITY] * contact_n_m / 0.5)
    if omega.size:
        rates.append(float(omega.max()) / 0.4)
    return rates


def _figures(
    impactor: Impactor,
    target: ImpactTarget,
    strengths: Mapping[str, float],
    split: str,
    stiffness: float,
) -> Floats:
    """The figures (19,) of an impact, in the order of the names above; spring rates are over the
    strength."""

    def of(name: str, law: str) -> float:
        return strengths.get(f"contact.{name}", 0.0) if split == law else 0.0

    first, middle, last, tip = "development", "calibration", "sealed", impactor.tip.name
    f = np.zeros(_FIGURES)
    f[MASS] = impactor.mass_kg * (1 + 0.05 * of("effective_mass", first) * tip_value(TIP_MASS, tip))
    if f[MASS] <= 0:
        raise ValueError(
            f"strength of contact.effective_mass = "
            f"{strengths['contact.effective_mass']!r} leaves no mass"
        )
    f[KONO] = of("viscous_loss", first) * tip_value(KUWABARA_KONO_S, tip)
    restitution = max(1 - of("viscous_loss", last) * tip_value(LOST_SPEED, tip), 0.2)
    f[TSUJI] = tsuji_alpha(restitution) * math.sqrt(f[MASS] * stiffness)
    if target.insulator is not None:
        area = math.pi * (tip_value(AREA_SHARE, tip) * impactor.tip_radius_m) ** 2
        f[LAYER] = of("layer_compliance", first)
        f[SHEET_N], f[SHEET_E] = LAYER_MODULUS_PA * area, DENSIFIED_STRAIN
        f[KELVIN] = of("layer_compliance", last)
        f[KELVIN_N_M] = tip_value(SPRING_N_M, tip) / max(f[KELVIN], 1e-12)
    f[LOCAL], f[EDGE] = of("plate_compliance", first), of("plate_compliance", middle)
    f[MOBILITY] = (f[LOCAL] or f[EDGE]) / target.plate_impedance_n_s_m
    f[LOCAL_NM] = tip_value(LOCAL_N_M, target.face.name) / max(f[LOCAL], 1e-12)
    f[MODAL] = of("plate_compliance", last)
    f[HAND] = of("effective_mass", last)
    f[GRIP_NM], f[GRIP_NSM] = f[HAND] * GRIP_N_M, f[HAND] * GRIP_N_S_M
    lost = of("viscous_loss", middle) * tip_value(LOST_AT_1_M_S, tip)
    f[DASHPOT] = dashpot_n_s_m(f[MASS], 3.218 * (f[MASS] / stiffness) ** 0.4, lost)
    f[JOINT] = of("effective_mass", middle) * JOINT_N
    f[RETRACES] = float(split == middle)
    return f


def tsuji_alpha(restitution: float) -> float:
    """Tsuji's alpha of a restitution: sqrt(5) times the damping ratio that a linear spring would
    need."""
    loss = -math.log(restitution)
    return math.sqrt(5) * loss / math.sqrt(loss**2 + math.pi**2)


def _curve(
    impactor: Impactor,
    target: ImpactTarget,
    strengths: Mapping[str, float],
    split: str,
    rate_1_s: float,
) -> LoadingCurve:
    """`rate_1_s`: of strain, where the law of yield asks for it; 0 elsewhere, so that one table
    serves all speeds."""
    plastic = strengths.get("contact.plastic_yield", 0.0)
    layered = split == "calibration" and target.insulator is not None
    softer = min(impactor.tip, target.face, key=lambda material: material.yield_strength_pa)
    return _tabulated(
        1 / (impactor.tip.compliance_1_pa + target.face.compliance_1_pa),
        impactor.tip_radius_m,
        impactor.tip.name,
        softer.name,
        softer.yield_strength_pa,
        softer.poisson_ratio,
        plastic,
        strengths.get("contact.tip_geometry", 0.0),
        split,
        rate_1_s if plastic > 0 else 0.0,
        strengths.get("contact.layer_compliance", 0.0) if layered else 0.0,
    )


@lru_cache(maxsize=512)
def _tabulated(
    modulus: float, radius: float, tip: str, softer: str, yields_pa: float, poisson: float,
    plastic: float, worn: float, split: str, rate_1_s: float, sheet: float,
) -> LoadingCurve:  # fmt: skip
    depth = np.geomspace(_SHALLOWEST_M, 0.5 * radius, _GRID)
    force = 4 / 3 * modulus * math.sqrt(radius) * depth**1.5
    residual = np.zeros_like(depth)
    hertz = force
    if plastic > 0 and split == "development":
        pressure = tip_value(YIELD_RATIO, softer) * yields_pa / plastic
        force, residual = meyer(depth, modulus, radius, pressure, tip_value(MEYER_INDEX, softer))
    elif plastic > 0 and split == "calibration":
        force, residual = cavity(
            depth, modulus, radius, dynamic_yield_pa(yields_pa, rate_1_s, softer) / (2 * plastic)
        )
    elif plastic > 0:
        force, residual = jackson_green(depth, modulus, radius, yields_pa / plastic, poisson)
    if worn > 0:
        size = worn * tip_value(WEAR, tip)
        if split == "development":
            shaped = worn_ball(depth, modulus, radius, size * WORN_FLAT_M)
        elif split == "calibration":
            shaped = worn_crown(depth, modulus, radius, size * CROWN_M)
        else:
            shaped = rounded_cone(depth, modulus, radius, CONE_BEGINS_M / size)
        force = force * shaped / hertz
    if sheet > 0:
        force, residual = on_sheet(depth, force, residual, radius, sheet)
    return LoadingCurve(depth, force, residual)


def meyer(
    depth_m: Floats, modulus: float, radius: float, pressure: float, index: float
) -> tuple[Floats, Floats]:
    """Force (N) and residual depth (m) beyond the Hertzian onset of yield at a mean `pressure`
    (Pa)."""
    onset = radius * (math.pi * pressure / (2 * modulus)) ** 2
    stiffness = 4 / 3 * modulus * math.sqrt(radius)
    plastic = stiffness * onset**1.5 * (depth_m / onset) ** (index / 2)
    force = np.where(depth_m > onset, plastic, stiffness * depth_m**1.5)
    contact = np.sqrt(radius * np.maximum(2 * depth_m - onset, depth_m))
    elastic = np.minimum(3 * force / (4 * modulus * contact), depth_m)
    return force, np.asarray(np.where(depth_m > onset, depth_m - elastic, 0.0))


def jackson_green(
    depth_m: Floats, modulus: float, radius: float, yield_pa: float, poisson: float
) -> tuple[Floats, Floats]:
    """Force (N) and residual depth (m) by Jackson and Green's fits; Hertz up to 1.9 critical
    depths."""
    constant = 1.295 * math.exp(0.736 * poisson)
    critical = (math.pi * constant * yield_pa / (2 * modulus)) ** 2 * radius
    onset = 4 / 3 * (radius / modulus) ** 2 * (constant / 2 * math.pi * yield_pa) ** 3
    relative = depth_m / critical
    power = 0.14 * math.exp(min(23 * yield_pa / modulus, 3.0))
    contact = np.sqrt(radius * depth_m) * np.maximum(relative / 1.9, 1.0) ** (power / 2)
    hardness = 2.84 * -np.expm1(-0.82 * (contact / radius) ** -0.7)
    fading = np.exp(-0.25 * relative ** (5 / 12))
    full = 4 * hardness / constant * -np.expm1(-(relative ** (5 / 9)) / 25) * relative
    fitted = onset * (fading * relative**1.5 + full)
    hertz = onset * relative**1.5
    residual_ratio = 1.02 * (1 - ((relative + 5.9) / 6.9) ** -0.54)
    beyond = relative > 1.9
    force = np.where(beyond, np.minimum(fitted, hertz), hertz)
    return np.asarray(force), np.asarray(
        np.where(beyond, np.clip(residual_ratio, 0.0, 0.95) * depth_m, 0.0)
    )


def worn_ball(depth_m: Floats, modulus: float, radius: float, flat_m: float) -> Floats:
    """Force (N) of a ball with a flat of radius b: exact, from a^4 - b^2 a^2 = (R d)^2."""
    square = (flat_m**2 + np.sqrt(flat_m**4 + 4 * (radius * depth_m) ** 2)) / 2
    # a^2 - b^2 without cancellation where the flat is wide
    apart = (radius * depth_m) ** 2 / square
    return np.asarray(2 * modulus / (3 * radius) * (2 * square + flat_m**2) * np.sqrt(apart))


def rounded_cone(depth_m: Floats, modulus: float, radius: float, begins_m: float) -> Floats:
    """Force (N) of a ball that beyond the radius b goes on as its tangent cone, over the contact's
    radius."""
    # a ball's contact is the narrowest of all, a whole cone's the widest: d = pi b a / 2 R
    widest = max(2 * math.sqrt(radius * depth_m[-1]), 2 * radius * depth_m[-1] / begins_m)
    a = np.geomspace(math.sqrt(radius * depth_m[0]) / 2, widest, 8 * depth_m.size)
    b = np.minimum(begins_m, a)
    root, angle = np.sqrt(a**2 - b**2), np.arccos(b / a)
    depth = a / radius * (a - root + b * angle)
    # integrals of r^3 up to b, and of b r^2 beyond, over sqrt(a^2 - r^2)
    inner = 2 / 3 * a**3 - root * (b**2 + 2 * a**2) / 3
    outer = b * (a**2 / 2 * angle + b / 2 * root)
    force = 2 * modulus / radius * (inner + outer)
    return np.asarray(np.exp(np.interp(np.log(depth_m), np.log(depth), np.log(force))))


@lru_cache(maxsize=8)
def _plate_modes(impedance: float) -> tuple[Floats, Floats]:
    """Shapes at the impact (1/sqrt(kg)) and circular frequencies of a simply supported plate with
    this impedance."""
    # Z = 8 sqrt(D m''), and the known plates have m'' of steel or aluminium at 10 mm
    surface = min((78.0, 27.0), key=lambda m: abs(impedance - 8 * math.sqrt(m * m * _SPEEDS[m])))
    rigidity = (impedance / 8) ** 2 / surface
    m, n = np.meshgrid(np.arange(1, 60), np.arange(1, 40), indexing="ij")
    omega = (
        math.sqrt(rigidity / surface) * math.pi**2 * ((m / SIDES_M[0]) ** 2 + (n / SIDES_M[1]) ** 2)
    )
    shape = np.sin(m * math.pi * POINT_M[0] / SIDES_M[0]) * np.sin(
        n * math.pi * POINT_M[1] / SIDES_M[1]
    )
    shape = shape * 2 / math.sqrt(surface * SIDES_M[0] * SIDES_M[1])
    kept = (omega < 2 * math.pi * HIGHEST_HZ) & (np.abs(shape) > 1e-9)
    return np.ascontiguousarray(shape[kept]), np.ascontiguousarray(omega[kept])


#: D / m'' of 10 mm of steel and aluminium, by mass per area (kg/m2).
_SPEEDS = {78.0: 200e9 * 1e-6 / (12 * 0.91) / 78.0, 27.0: 69.9e9 * 1e-6 / (12 * 0.8911) / 27.0}


@njit(cache=True, error_model="numpy")
def _table(depth: float, first: float, width: float, values: Floats) -> float:
    place = (math.log(depth) - first) / width
    if place <= 0:
        shallow: float = values[0] * math.exp(1.5 * place * width)
        return shallow
    low = min(int(place), values.size - 2)
    share = place - low
    value: float = values[low] ** (1 - share) * values[low + 1] ** share
    return value


@njit(cache=True, error_model="numpy")
def _linear(depth: float, first: float, width: float, values: Floats) -> float:
    place = (math.log(depth) - first) / width
    if place <= 0:
        return 0.0
    low = min(int(place), values.size - 2)
    share = place - low
    value: float = values[low] * (1 - share) + values[low + 1] * share
    return value


@njit(cache=True, error_model="numpy")
def _motion(
    s: Floats, deepest: float, f: Floats, first: float, width: float, force: Floats,
    residual: Floats, shapes: Floats, omega: Floats, rate: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Rates of the state: x, v, plate, its surface, layer, hand's x and v, modes; the force and the
    indentation."""
    n = shapes.size
    sheet = 0.0
    if f[LAYER] > 0:
        load = max(s[4], 0.0)
        sheet = f[LAYER] * LAYER_THICKNESS_M * load / (f[SHEET_N] + load / f[SHEET_E])
    elif f[KELVIN] > 0:
        sheet = s[4]
    swing, swinging = 0.0, 0.0
    for i in range(n):
        swing += shapes[i] * s[7 + i]
        swinging += shapes[i] * s[7 + n + i]
    depth = s[0] - s[2] - s[3] - f[MODAL] * swing - sheet
    elastic, own = 0.0, depth
    if depth > 0:
        top = max(depth, deepest)
        elastic = _table(top, first, width, force)
        if depth < top:
            residual_depth = _linear(top, first, width, residual)
            own = depth - residual_depth
            if residual_depth <= 0 and f[RETRACES] > 0:
                elastic = _table(depth, first, width, force)
            else:
                elastic = elastic * (own / (top - residual_depth)) ** 1.5 if own > 0 else 0.0
    surface, layered, closing = 0.0, 0.0, s[1] - f[MODAL] * swinging
    if f[LOCAL] > 0:
        surface = (elastic / f[LOCAL_NM] - s[3]) / LOCAL_LAG_S
        closing -= surface + f[MOBILITY] * elastic
    if f[KELVIN] > 0:
        layered = (elastic / f[KELVIN_N_M] - s[4]) / RETARDATION_S
        closing -= layered
    if f[EDGE] > 0:
        closing -= f[MOBILITY] * (elastic + EDGE_GAIN * s[4])
    total = elastic
    if elastic > 0 and own > 0:
        total += 1.5 * f[KONO] * closing * elastic / own + f[TSUJI] * own**0.25 * closing
        if f[DASHPOT] > 0:  # the damper's own force moves the plate, too
            total += f[DASHPOT] * closing / (1 + f[DASHPOT] * f[MOBILITY])
        total = max(total, 0.0)
    grip = 0.0
    if f[HAND] > 0:
        grip = f[GRIP_NM] * (s[5] - s[0]) + f[GRIP_NSM] * (s[6] - s[1])
    if f[JOINT] > 0:
        grip = f[JOINT] * math.tanh((s[6] - s[1]) / SLIP_M_S)
    rate[0], rate[1] = s[1], (grip - total) / f[MASS]
    rate[2] = f[MOBILITY] * total
    rate[3] = (total / f[LOCAL_NM] - s[3]) / LOCAL_LAG_S if f[LOCAL] > 0 else 0.0
    if f[KELVIN] > 0:
        rate[4] = (total / f[KELVIN_N_M] - s[4]) / RETARDATION_S
    else:
        rate[4] = (total - s[4]) / SETTLING_S if f[LAYER] > 0 else 0.0
    if f[EDGE] > 0:
        rate[2] += f[MOBILITY] * EDGE_GAIN * s[4]
        rate[4] = (total - s[4]) / EDGE_S
    rate[5], rate[6] = s[6], -grip / (JOINT_KG if f[JOINT] > 0 else HAND_KG)
    for i in range(n):
        rate[7 + i] = s[7 + n + i]
        rate[7 + n + i] = shapes[i] * total - omega[i] * (
            omega[i] * s[7 + i] + 2 * MODAL_LOSS * s[7 + n + i]
        )
    return total, depth


@njit(cache=True, error_model="numpy")
def run(
    f: Floats, speed: float, step: float, limit: int, first: float, width: float, force: Floats,
    residual: Floats, shapes: Floats, omega: Floats,
) -> Floats:  # fmt: skip
    """Force (n,) at even steps until the impactor lets go; empty where it has not within `limit`
    steps."""
    size = 7 + 2 * shapes.size
    state, there = np.zeros(size), np.zeros(size)
    k1, k2, k3, k4 = np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size)
    state[1] = state[6] = speed
    history = np.empty(4096)
    deepest, peak, last, count = 0.0, 0.0, 0, 0
    while count <= limit:
        total, depth = _motion(state, deepest, f, first, width, force, residual, shapes, omega, k1)
        if count == history.size:
            longer = np.empty(2 * count)
            longer[:count] = history
            history = longer
        history[count] = total
        count += 1
        peak, deepest = max(peak, total), max(deepest, depth)
        if total > CREEPING * peak:
            last = count
        if count % _LOOK == 0 and ((total == 0 and state[1] < 0) or count > 1.3 * last + _LOOK):
            return history[:count]
        there[:] = state + step / 2 * k1
        _motion(there, deepest, f, first, width, force, residual, shapes, omega, k2)
        there[:] = state + step / 2 * k2
        _motion(there, deepest, f, first, width, force, residual, shapes, omega, k3)
        there[:] = state + step * k3
        _motion(there, deepest, f, first, width, force, residual, shapes, omega, k4)
        state += step / 6 * (k1 + 2 * (k2 + k3) + k4)
    return history[:0]
