"""One shot asked of a twin, in SI: what `predict`, the web page and the JSON API share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..finite import finite

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
class Shot:
    """What an operator sets, by name and in SI; at most one of `tank_pressure_pa` (gauge) and `impact_velocity_m_s`.

    Without either it is fired with `TANK_PRESSURE_PA`.
    """

    bullet_mass_kg: float = 0.5
    tip_material: str = "steel"
    tip_radius_m: float = 0.045
    tank_pressure_pa: float | None = None
    impact_velocity_m_s: float | None = None
    anvil_material: str = NONE
    insulator: str = NONE
    impact_position: str = "#1"
    valve_profile: str | None = None  # as `ValveProfile.parse` takes it

    def setting(self, built: BuiltTwin) -> Setting:
        """On the twin's plate. Raises `LookupError` for an unknown material, `ValueError` as `Setting`."""
        from ...signals.valve_profile import ValveProfile

        fired = self.tank_pressure_pa is None and self.impact_velocity_m_s is None
        return built.setting(
            impactor_mass_kg=self.bullet_mass_kg,
            tip=built.material(self.tip_material),
            tip_radius_m=self.tip_radius_m,
            tank_pressure_pa=TANK_PRESSURE_PA if fired else self.tank_pressure_pa,
            impact_velocity_m_s=self.impact_velocity_m_s,
            anvil=None if self.anvil_material.lower() == NONE else built.material(self.anvil_material),
            insulator=self.insulator,
            impact_position=self.impact_position,
            valve_profile=None if self.valve_profile is None else ValveProfile.parse(self.valve_profile),
        )


def predicted(built: BuiltTwin, shot: Shot, *, draws: int = DRAWS, seed: int = 0) -> Prediction:
    """The shot with its bands; the same seed, the same answer.

    Raises `LookupError` for a material or an impact position there is none of, `ValueError` as `Setting` and for a
    bullet that stays in the barrel.
    """
    import numpy as np

    return built.twin.predict(shot.setting(built), draws=draws, rng=np.random.default_rng(seed))


def predicted_json(built: BuiltTwin, shot: Shot, *, draws: int = DRAWS, seed: int = 0) -> dict[str, Any]:
    """The JSON of `pyroshock predict`. Raises as `predicted`."""
    return prediction_json(predicted(built, shot, draws=draws, seed=seed))


def prediction_json(prediction: Prediction) -> dict[str, Any]:
    """The same of a prediction that is there; a value that is not known is null."""
    plain = finite(prediction.as_json())
    assert isinstance(plain, dict)
    return plain
