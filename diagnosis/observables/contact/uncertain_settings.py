"""What uncertain quantities of the nominal impact do to its features."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np

from ....twin.contact.bodies import Bodies
from ....twin.sensors.chain import SensorChain
from ..base import Floats
from .force_histories import law_courses
from .measured_features import seen_features
from .site import Sites

_VELOCITY = "impact_velocity_m_s"
#: Those that Hertz' impact on a rigid target is made of.
KNOWN = (
    *(item.name for item in fields(Bodies) if "modulus" in item.name or "poisson" in item.name),
    "impactor_radius_m",
    "impactor_mass_kg",
    _VELOCITY,
)
#: Share of a quantity: small enough for a derivative, large enough for the digits of features.
_STEP = 0.03


def contact_nuisances(
    sites: Sites, velocity_m_s: Floats, step_s: Floats, uncertain: Mapping[str, float]
) -> dict[str, Floats]:
    """(C, d) by name: the features' derivative for a quantity's logarithm times its relative standard deviation.

    Hertz' impacts at velocities (C,), recorded in steps (C,), central differences. Raises `ValueError` for another name
    than `KNOWN`, and a deviation that is negative.
    """
    for name, sd in uncertain.items():
        if name not in KNOWN:
            raise ValueError(f"no uncertain quantity {name!r} of the contact; there are: {', '.join(KNOWN)}")
        if not (np.isfinite(sd) and sd >= 0):
            raise ValueError(f"uncertain {name} = {sd!r}: expected a relative standard deviation, not negative")

    def seen(name: str, factor: float) -> Floats:
        velocity = velocity_m_s * (factor if name == _VELOCITY else 1.0)
        courses = law_courses(_scaled(sites, name, factor), (), velocity)
        return seen_features(courses, step_s, SensorChain())

    return {
        name: sd * (seen(name, 1 + _STEP) - seen(name, 1 - _STEP)) / np.log((1 + _STEP) / (1 - _STEP))
        for name, sd in uncertain.items()
        if sd > 0
    }


def _scaled(sites: Sites, name: str, factor: float) -> Sites:
    value = getattr(sites.bodies, name)
    return sites if name == _VELOCITY else replace(sites, bodies=replace(sites.bodies, **{name: value * factor}))
