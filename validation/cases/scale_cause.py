"""A case with a cause of a given gap over floor.

How strong a cause has to be for a gap of a given size.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...virtualbench.second_laws import law_of
from .case import TIERS, ActingCause, Case
from .designs import design
from .effect_size import gap
from .run_scatter import run_positions
from .unknowns import FAMILIES


@dataclass(frozen=True)
class StrengthRange:
    """Physical range of a strength, and its unit. `low` below 0: either sign."""

    low: float
    high: float
    unit: str


_BENCH = "times the bench's default"
#: Every effect of the catalogue. Contact and gun: what `integrate.assemble` and
#: `gun.build.setting_of` make of a strength.
RANGES: Mapping[str, StrengthRange] = {
    "gun.back_pressure": StrengthRange(0.9, 1.04, "atmospheres"),
    "gun.blow_by": StrengthRange(0.0, 6.0, _BENCH),
    "gun.valve_flow": StrengthRange(0.0, 2.0, _BENCH),
    "gun.barrel_loss": StrengthRange(0.0, 20.0, _BENCH),
    "gun.sliding_friction": StrengthRange(0.0, 10.0, _BENCH),
    "gun.heat_exchange": StrengthRange(0.0, 60.0, _BENCH),
    "gun.dead_volume": StrengthRange(0.0, 8.0, _BENCH),
    "contact.viscous_loss": StrengthRange(0.0, 12.0, _BENCH),
    "contact.plastic_yield": StrengthRange(0.0, 8.0, _BENCH),
    "contact.layer_compliance": StrengthRange(0.0, 4.0, _BENCH),
    "contact.plate_compliance": StrengthRange(0.0, 1.5, _BENCH),
    "contact.effective_mass": StrengthRange(-8.0, 20.0, "5 % of the mass"),
    "contact.tip_geometry": StrengthRange(-6.0, 10.0, "a fifth more radius at the apex"),
    "plate.damping": StrengthRange(-6.0, 30.0, "10 % of the ratios"),
    "plate.stiffness": StrengthRange(-8.0, 8.0, "1 % of the frequencies"),
    "plate.sensor_mass": StrengthRange(0.0, 0.3, "kg"),
    "plate.boundary": StrengthRange(0.0, 150.0, "Hz"),
    "sensor.pressure_offset": StrengthRange(-0.15, 0.15, "bar"),
    "sensor.pressure_gain": StrengthRange(-0.3, 0.3, "1"),
    "sensor.velocity_gain": StrengthRange(-0.15, 0.15, "1"),
    "sensor.force_gain": StrengthRange(-0.3, 0.3, "1"),
    "sensor.force_bandwidth": StrengthRange(0.0, 25.0, "25 kHz over the corner"),
    "sensor.acceleration_gain": StrengthRange(-0.3, 0.4, "1"),
    "sensor.mount_resonance": StrengthRange(0.0, 5.0, "45 kHz over the resonance"),
    "sensor.zero_shift": StrengthRange(-0.05, 0.05, "1"),
}
#: Campaigns that can show an effect, by the beginning of its name.
_SEEN: Mapping[str, tuple[str, ...]] = {
    "gun.": ("gun", "chain", "gun-contact"),
    "contact.": ("hammer", "chain", "gun-contact"),
    "plate.": ("plate", "chain"),
    "sensor.pressure": ("gun", "chain", "gun-contact"),
    "sensor.velocity": ("gun", "hammer", "chain", "gun-contact"),
    "sensor.force": ("hammer", "plate", "chain", "gun-contact"),
    "sensor.acceleration": ("plate", "chain"),
    "sensor.mount": ("plate", "chain"),
    "sensor.zero": ("plate", "chain"),
}
_CLOSE, _TRIES, _HALVINGS = 0.04, 16, 6


def shown_by(kind: str, number: int) -> tuple[str, ...]:
    """Effects that a plan can show: a layer's compliance only where there is a layer."""
    layered = any(setting.insulator != "none" for setting in design(kind, number))
    names = [
        name
        for name in RANGES
        if any(name.startswith(key) and kind in kinds for key, kinds in _SEEN.items())
    ]
    return tuple(name for name in names if layered or name != "contact.layer_compliance")


def cause_of(
    name: str, strength: float, order: tuple[float, ...] = (), laws: str = ""
) -> ActingCause:
    """An effect, or a family outside the catalogue, at a strength; families that drift see the
    order of runs."""
    if name in FAMILIES:
        return ActingCause((), name, strength, order if FAMILIES[name].drift else ())
    return ActingCause(((name, strength),), laws=laws)


def largest(name: str, sign: int, laws: str = "") -> float:
    """The end of the physical range on one side."""
    if name in FAMILIES:
        return FAMILIES[name].high
    if laws:
        return law_of(name, laws).high if sign > 0 else law_of(name, laws).low
    return RANGES[name].high if sign > 0 else RANGES[name].low


def signs(name: str, laws: str = "") -> tuple[int, ...]:
    """Of a strength: errors that go either way have two."""
    if laws:
        return (1, -1) if law_of(name, laws).low < 0 else (1,)
    return (1, -1) if name in RANGES and RANGES[name].low < 0 else (1,)


def strength_for(
    kind: str,
    number: int,
    name: str,
    sign: int,
    wanted: float,
    order: tuple[float, ...] = (),
    laws: str = "",
) -> float | None:
    """The strength whose gap is `wanted` (tolerances), within 4 %; None where the physical range
    does not hold it.

    Doubles the strength until the gap is bracketed, then goes by the secant of the logarithms. The
    same arguments give the same strength, whatever was asked before.
    """

    def size(strength: float) -> float:
        return gap(kind, number, cause_of(name, strength, order, laws))

    end = largest(name, sign, laws)
    high, at_high = end / 2**_HALVINGS, size(end / 2**_HALVINGS)
    while at_high < wanted and high != end:
        high, at_high = 2 * high, size(2 * high)
    if at_high < wanted:
        return None
    low, at_low = high / 2, size(high / 2)
    for _ in range(_TRIES):
        if at_low <= wanted:
            break
        high, at_high, low, at_low = low, at_low, low / 2, size(low / 2)
    for _ in range(_TRIES):
        middle = math.sqrt(high * low) if high > 0 else -math.sqrt(high * low)
        if math.isfinite(at_high) and 0 < at_low < at_high:
            share = math.log(wanted / at_low) / math.log(at_high / at_low)
            middle = low * (high / low) ** min(max(share, 0.05), 0.95)
        now = size(middle)
        if abs(now / wanted - 1) < _CLOSE:
            return middle
        low, at_low, high, at_high = (
            (middle, now, high, at_high) if now < wanted else (low, at_low, middle, now)
        )
    return None


#: Standard error of a configuration's mean, in tolerances.
FLOORS = (0.6, 1.3)


def inside(case: Case, tier: tuple[float, float]) -> bool:
    """Whether gap over floor lies in a range."""
    return tier[0] <= ratio_of(case) < tier[1]


def ratio_of(case: Case) -> float:
    """Gap over floor."""
    return gap(case.kind, case.design, whole_cause(case)) / case.floor


def whole_cause(case: Case) -> ActingCause:
    """What acts in a case."""
    drifting = case.unknown is not None and FAMILIES[case.unknown].drift
    order = run_positions(case) if drifting else ()
    return ActingCause(
        tuple(sorted(case.strengths.items())), case.unknown or "", case.amount, order, case.laws
    )


def with_cause(case: Case, name: str, rng: np.random.Generator) -> Case | None:
    """The case with an effect or family in its tier, or near it; None where the plan cannot show
    it."""
    if name not in FAMILIES and name not in shown_by(case.kind, case.design):
        return None
    low, high = TIERS[case.tier]
    ratio = math.exp(rng.uniform(math.log(low * 1.05), math.log(high * 0.95)))
    return sized(case, name, int(rng.choice(signs(name, case.laws))), ratio, rng)


def sized(case: Case, name: str, sign: int, ratio: float, rng: np.random.Generator) -> Case:
    """The case with a cause of a given gap over floor; where the strongest is too weak, with less
    noise."""
    if name in FAMILIES and FAMILIES[name].drift:
        case = replace(case, blocked=True)
    order = run_positions(case) if name in FAMILIES else ()
    fitted_strength = None
    if name in RANGES and RANGES[name].low > 0:  # what is known of it leaves only the noise free
        strength = float(rng.uniform(RANGES[name].low, RANGES[name].high))
    else:
        fitted_strength = strength_for(
            case.kind, case.design, name, sign, ratio * case.floor, order, case.laws
        )
        strength = fitted_strength or largest(name, sign, case.laws)
    if fitted_strength is None:
        reached = gap(case.kind, case.design, cause_of(name, strength, order, case.laws))
        case = replace(case, floor=min(max(reached / ratio, FLOORS[0]), FLOORS[1]))
    if name in FAMILIES:
        return replace(case, unknown=name, amount=strength)
    return replace(case, strengths={name: strength})
