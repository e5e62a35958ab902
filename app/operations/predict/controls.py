"""What can be set of a shot, in which ranges, and what the model has learned of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ....schema.known_factors import CHAIN_PITCH_M
from ....twin.setting import BOUNDARY_CONDITIONS, INSULATORS
from ...common.quantities import display_of
from ...twins.benches import LEAST_PRESSURE_PA
from .factors import is_used, registered_contact
from .request import NONE, TANK_PRESSURE_PA, ShotRequest

if TYPE_CHECKING:
    from ....dataset.validity_limits import Limit
    from ....doe.factors import DesignFactor
    from ....doe.space import Space
    from ...twins.building import BuiltTwin

#: Source of a predictor -> the model's limit of it.
Known = Mapping[str, "Limit"]

#: Step of a number, SI.
_STEPS = {
    "tank_pressure_pa": 0.05e5,
    "impact_velocity_m_s": 0.1,
    "bullet_mass_kg": 0.01,
    "tip_radius_m": 1e-3,
}
_LEAST_M_S = 0.1
_USUAL = ShotRequest()
#: Of impact, where neither pressure nor velocity is said on a bench without a gun.
VELOCITY_M_S = 1.0


def sliders(built: BuiltTwin, factors: Space | None = None) -> dict[str, Any]:
    """Plain data: `numbers` and `choices` by the fields of `ShotRequest`.

    A number has `unit` (as shown), `scale` (shown = scale * SI), and in SI `low`, `high`, `step`,
    `default`, `levels` (what the lab owns; none for what goes without steps) and `domain`: from
    what to what the model has learned, None for a law, and for what the model is not asked. A
    choice has `options`, each a `name` with `known`: whether the model has met it, and a `default`;
    `boundary_conditions` is a choice where the contact model takes them. `chain_heights_m`: by how
    much the plate of a gun can hang higher; none on other benches, and for a modal table, which
    knows its points alone. `factors`: what the lab owns, else the shipped gun's. Raises
    `ValueError` for factors without tip radius or bullet mass.
    """
    from ....doe.limits.bench import read_limits
    from ....doe.space import gun_space

    space = factors or gun_space()
    limits, of = read_limits(space.bench), {factor.name: factor for factor in space.factors}
    masses, radii = _owned(of, "bullet_mass", 1.0), _owned(of, "tip_radius", 1e-3)
    highest = min(
        limits.max_tank_pressure_pa, limits.max_regulated_pressure_pa, limits.max_valve_pressure_pa
    )
    values, mass = _seen_in_training(built), built.bench.impactor_mass_kg
    ends = {
        "tank_pressure_pa": (LEAST_PRESSURE_PA, highest, TANK_PRESSURE_PA, (), None),
        "impact_velocity_m_s": (
            _LEAST_M_S,
            limits.max_impact_velocity_m_s,
            VELOCITY_M_S,
            (),
            "impact.velocity",
        ),
        "bullet_mass_kg": (min(masses), limits.max_bullet_mass_kg, mass, masses, "impactor.mass"),
        "tip_radius_m": (
            min(radii),
            max(radii),
            _USUAL.tip_radius_m,
            radii,
            "factor.tip_radius",
        ),
    }
    return {
        "numbers": {
            name: _number(name, *end[:-1], values.get(end[-1] or "")) for name, end in ends.items()
        },
        "choices": _choices(built, values),
        "chain_heights_m": _chain_heights_m(built),
    }


def _owned(factors: Mapping[str, DesignFactor], name: str, scale: float) -> tuple[float, ...]:
    factor = factors.get(name)
    if factor is None or factor.numbers is None:
        raise ValueError(f"the factors have no numbers of {name}; there are: {', '.join(factors)}")
    return tuple(scale * number for number in factor.numbers)


def _number(
    name: str, low: float, high: float, default: float, levels: Sequence[float], limit: Limit | None
) -> dict[str, Any]:
    shown = display_of(name)
    return {
        "unit": shown.unit,
        "scale": shown.scale,
        "low": low,
        "high": max(low, high),
        "step": _STEPS[name],
        "default": min(max(default, low), max(low, high)),
        "levels": list(levels),
        "domain": None if limit is None else [limit.low, limit.high],
    }


def _choices(built: BuiltTwin, seen_levels: Known) -> dict[str, Any]:
    names = sorted({material.name for material in built.materials.values()}, key=str.lower)
    positions = (
        built.twin.plate.ensemble(built.plate.name)[0].impact_points
        if built.twin.sensor_names
        else ("#1",)
    )
    tip = _USUAL.tip_material if _USUAL.tip_material in names else names[0]
    choices = {
        "tip_material": _choice(names, tip, lambda name: _tip_known(built, seen_levels, name)),
        "anvil_material": _choice(
            [NONE, *names], NONE, _level_known(seen_levels, "factor.anvil_material")
        ),
        "insulator": _choice(INSULATORS, NONE, _level_known(seen_levels, "factor.insulator")),
        "impact_position": _choice(positions, positions[0], lambda _: True),
    }
    if is_used(built, "boundary_conditions"):
        is_known = _level_known(seen_levels, "factor.boundary_conditions")
        choices["boundary_conditions"] = _choice(
            BOUNDARY_CONDITIONS, BOUNDARY_CONDITIONS[0], is_known
        )
    return choices


def _chain_heights_m(built: BuiltTwin) -> list[float]:
    """Whole links, as long as every impact position lies on the plate; lowest first."""
    if not built.bench.has_gun or built.bench.modes is not None:
        return []
    return [*reversed(_links_m(built, -1)), 0.0, *_links_m(built, 1)]


def _links_m(built: BuiltTwin, direction: int) -> list[float]:
    heights: list[float] = []
    with suppress(ValueError):  # a point that is beyond the edge
        while built.bench.drawing.impact_points:
            height_m = round(direction * (len(heights) + 1) * CHAIN_PITCH_M, 6)
            built.bench.drawing.raised(height_m)
            heights.append(height_m)
    return heights


def _choice(names: Sequence[str], default: str, is_seen: Callable[[str], bool]) -> dict[str, Any]:
    return {
        "options": [{"name": name, "known": is_seen(name)} for name in names],
        "default": default,
    }


def _seen_in_training(built: BuiltTwin) -> Known:
    """By source, what the registered model was trained on; nothing for a law, which holds
    everywhere."""
    contact = registered_contact(built)
    if contact is None:
        return {}
    return dict(zip(contact.predictor_set.sources, contact.registered.domain.limits, strict=True))


def _tip_known(built: BuiltTwin, seen_levels: Known, name: str) -> bool:
    """A material is known by its properties, which are what a model learns from."""
    material = built.material(name)
    of = {"youngs_modulus": material.youngs_modulus_pa, "poisson_ratio": material.poisson_ratio}
    of |= {
        "density": material.density_kg_m3,
        "yield_strength": material.yield_strength_pa or np.nan,
    }
    pairs = (
        (seen_levels[f"tip.{key}"], value)
        for key, value in of.items()
        if f"tip.{key}" in seen_levels
    )
    return all(bool(limit.inside(np.array([value]))[0]) for limit, value in pairs)


def _level_known(seen_levels: Known, source: str) -> Callable[[str], bool]:
    limit = seen_levels.get(source)
    return lambda name: limit is None or name in limit.range
