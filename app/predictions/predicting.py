"""One shot asked of a twin, in SI: what `predict`, the web page and the JSON API share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ...dataset.sources import STATED_PLATE_MASS
from ..finite import finite
from .given_factors import Value, check_used

if TYPE_CHECKING:
    from ...twin.prediction import Prediction
    from ...twin.setting import Setting
    from ..twins.building import BuiltTwin

NONE = "none"
#: Gauge, where neither pressure nor velocity is said.
TANK_PRESSURE_PA = 5e5
#: Random shots for the bands.
DRAWS = 64


@dataclass(frozen=True)
class ShotRequest:
    """What an operator sets, by name and in SI; at most one of `tank_pressure_pa` (gauge) and `impact_velocity_m_s`.

    Without either a gun fires it with `TANK_PRESSURE_PA`; other benches need the velocity, before contact. The mass is
    the bench's where none is given. `factors` are a lab's own, and `plate_mass_kg`, by name: for models that learned
    from them.
    """

    bullet_mass_kg: float | None = None
    tip_material: str = "steel"
    tip_radius_m: float = 0.045
    tank_pressure_pa: float | None = None
    impact_velocity_m_s: float | None = None
    anvil_material: str = NONE
    insulator: str = NONE
    impact_position: str = "#1"
    boundary_conditions: str | None = None
    valve_profile: str | None = None  # as `ValveProfile.parse` takes it
    factors: Mapping[str, Value] = field(default_factory=dict, hash=False)

    def setting(self, built: BuiltTwin) -> Setting:
        """On the twin's plate. Raises `LookupError` for an unknown material, `ValueError` as `Setting`, for a bench
        without a gun where no velocity is given, and for a factor that no stage of the twin uses."""
        from ...signals.valve_profile import ValveProfile

        check_used(built, self.factors, self.boundary_conditions)
        fired = self.tank_pressure_pa is None and self.impact_velocity_m_s is None
        if not built.bench.has_gun and self.impact_velocity_m_s is None:
            bench = f"campaign {built.bench.campaign!r} is of kind {built.bench.kind!r}"
            raise ValueError(f"{bench} and has no gun: give the impact velocity, such as --velocity 1.5m/s")
        mass = built.bench.impactor_mass_kg if self.bullet_mass_kg is None else self.bullet_mass_kg
        lab_factors = {name: value for name, value in self.factors.items() if name != STATED_PLATE_MASS}
        plate = {STATED_PLATE_MASS: self.factors[STATED_PLATE_MASS]} if STATED_PLATE_MASS in self.factors else {}
        return built.setting(
            impactor_mass_kg=mass,
            tip=built.material(self.tip_material),
            tip_radius_m=self.tip_radius_m,
            tank_pressure_pa=TANK_PRESSURE_PA if fired else self.tank_pressure_pa,
            impact_velocity_m_s=self.impact_velocity_m_s,
            anvil=None if self.anvil_material.lower() == NONE else built.material(self.anvil_material),
            insulator=self.insulator,
            impact_position=self.impact_position,
            boundary_conditions=self.boundary_conditions or "free",
            factors=lab_factors,
            valve_profile=None if self.valve_profile is None else ValveProfile.parse(self.valve_profile),
            **plate,
        )


def predicted(built: BuiltTwin, shot: ShotRequest, *, draws: int = DRAWS, seed: int = 0) -> Prediction:
    """The shot with its bands; the same seed, the same answer.

    Raises `LookupError` for a material or an impact position there is none of, `ValueError` as `Setting` and for a
    bullet that stays in the barrel.
    """
    import numpy as np

    return built.twin.predict(shot.setting(built), draws=draws, rng=np.random.default_rng(seed))


def predicted_json(built: BuiltTwin, shot: ShotRequest, *, draws: int = DRAWS, seed: int = 0) -> dict[str, Any]:
    """The JSON of `pyroshock predict`. Raises as `predicted`."""
    return prediction_json(built, predicted(built, shot, draws=draws, seed=seed))


def prediction_json(built: BuiltTwin, prediction: Prediction) -> dict[str, Any]:
    """The same of a prediction that is there, with the twin's notes and the warnings in sentences.

    The command, the page and the API show what stands here; a value that is not known is null.
    """
    from .warnings import warnings

    plain = finite(prediction.as_json())
    assert isinstance(plain, dict)
    return {**plain, "notes": list(built.notes), "warnings": list(warnings(prediction))}
