"""What the web application asks of a twin: the shot that a page or a script describes, what can be
set of it, and what the model has learned from. The first twin is built while nobody waits for
it."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from fastapi import Depends, Query
from pydantic import BaseModel, ConfigDict, Field
from starlette.requests import Request

from ...schema.known_factors import CHAIN_PITCH_M
from ...twin.setting import BOUNDARY_CONDITIONS, INSULATORS
from ..operations.predict.predicting import (
    NONE,
    TANK_PRESSURE_PA,
    ShotRequest,
    is_used,
    parse_factor,
)
from ..twins.benches import LEAST_PRESSURE_PA
from ..twins.building import TwinRequest
from ..twins.twin_cache import TwinCache
from .dependencies import Word

if TYPE_CHECKING:
    from ...dataset.validity_limits import Limit
    from ...doe.factors import DesignFactor
    from ...doe.space import Space
    from ..twins.building import BuiltTwin


def _twins(request: Request) -> TwinCache:
    shelf: TwinCache = request.app.state.twins
    return shelf


Twins = Annotated[TwinCache, Depends(_twins)]


class PredictionOptions(BaseModel):
    """A shot as `pyroshock predict` takes it, SI; the twin is that of a campaign's bench (none: the
    newest gun's).

    The bounds are orders of magnitude beyond any bench: between them an answer takes a second at
    most.
    """

    model_config = ConfigDict(extra="forbid")

    campaign: Word | None = None
    contact: Word | None = Field(
        None, description="a law of contact, or NAME@VERSION; none: the model in use"
    )
    plate: Word | None = None
    q: Annotated[float, Field(gt=0.5, le=1000)] = 10.0
    adopted: bool = True
    coupled: bool = Field(
        False, description="contact law and plate solved together: thin plates, soft tips"
    )
    chain_height_m: Annotated[float, Field(ge=-10, le=10)] = Field(
        0.0,
        description="by which the plate of a gun hangs "
        "higher: a multiple of 0.056, a link of its chain",
    )
    tank_pressure_pa: Annotated[float, Field(ge=1, le=1e8)] | None = None
    impact_velocity_m_s: Annotated[float, Field(ge=1e-3, le=1e4)] | None = None
    bullet_mass_kg: Annotated[float, Field(ge=1e-4, le=1e3)] | None = Field(
        None, description="none: the bench's"
    )
    tip_material: Word = "steel"
    tip_radius_m: Annotated[float, Field(ge=1e-5, le=10)] = 0.045
    anvil_material: Word = "none"
    insulator: Word = "none"
    impact_position: Word = "#1"
    boundary_conditions: Literal["free", "fixed"] | None = None
    factor: list[Word] = Field(
        [], max_length=50, description="NAME=VALUE of a factor that the model learned from, SI"
    )
    valve_profile: Word | None = Field(
        None, description="of the gun's valve, such as '0:0 0.1:1': s, 0 shut to 1 open"
    )
    draws: Annotated[int, Field(ge=2, le=1024)] = 64
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0

    def request(self) -> TwinRequest:
        return TwinRequest(
            campaign=self.campaign,
            contact=self.contact,
            plate=self.plate,
            q=self.q,
            adopted=self.adopted,
            coupled=self.coupled,
            chain_height_m=self.chain_height_m,
        )

    def shot(self) -> ShotRequest:
        names = ("bullet_mass_kg", "tip_material", "tip_radius_m", "tank_pressure_pa",
        "impact_velocity_m_s",
                 "anvil_material", "insulator", "impact_position", "boundary_conditions",
                 "valve_profile")  # fmt: skip
        factors = dict(parse_factor(text) for text in self.factor)
        return ShotRequest(**{name: getattr(self, name) for name in names}, factors=factors)


Asked = Annotated[PredictionOptions, Query()]


def link_arguments(question: PredictionOptions) -> dict[str, Any]:
    """What a link to this question carries."""
    return question.model_dump(exclude_defaults=True)


_log = logging.getLogger("pyroshock.web")
_HEAVY = (
    "scipy.stats",
    "scipy.optimize",
    "scipy.interpolate",
    "pyroshock.app.operations.plan.quality",
    "pyroshock.app.operations.train.comparing",
)


def warm_up_in_thread(twins: TwinCache) -> threading.Thread:
    """Begin in a thread of its own; what fails here is told where it is asked for."""

    def work() -> None:
        try:
            for name in _HEAVY:
                import_module(name)
            twins.get(TwinRequest())
        except Exception as error:  # noqa: BLE001 - a page tells it to who asks
            _log.info("not warmed: %s", error)

    thread = threading.Thread(target=work, name="pyroshock warming", daemon=True)
    thread.start()
    return thread


#: Source of a predictor -> the model's limit of it.
Known = Mapping[str, "Limit"]

#: Name -> unit on the screen, how many of them one SI unit is, step in it.
_SHOWN = {
    "tank_pressure_pa": ("bar", 1e-5, 0.05),
    "impact_velocity_m_s": ("m/s", 1.0, 0.1),
    "bullet_mass_kg": ("kg", 1.0, 0.01),
    "tip_radius_m": ("mm", 1e3, 1.0),
}
_LEAST_M_S = 0.1
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
    from ...doe.limits.bench import read_limits
    from ...doe.space import gun_space

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
            ShotRequest.tip_radius_m,
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
    unit, scale, step = _SHOWN[name]
    return {
        "unit": unit,
        "scale": scale,
        "low": low,
        "high": max(low, high),
        "step": step / scale,
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
    tip = ShotRequest.tip_material if ShotRequest.tip_material in names else names[0]
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
    from ...training.registry.contact_stage import RegisteredContact

    contact = built.twin.contact
    if not isinstance(contact, RegisteredContact):
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
