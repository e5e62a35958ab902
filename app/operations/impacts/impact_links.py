"""What an impact belongs to: its velocity, shot, run, plan and prediction, each with the address
that shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote, urlencode

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....schema.campaigns import Plan, PlannedRun
from ....schema.impacts import Impact
from ....schema.velocity_kinds import BEFORE_CONTACT, velocity_kind
from ...common.quantities import cell, display_of, measured_cell, velocity_label

#: Settings that the page of the twin takes from an impact.
_TWIN_SETTINGS = (
    *("bullet_mass_kg", "tip_material", "tip_radius_m", "anvil_material", "insulator"),
    *("impact_position", "boundary_conditions"),
)


@dataclass(frozen=True)
class ImpactLink:
    """`value` under its `label`; `address` is empty where nothing else shows it."""

    label: str
    value: str
    address: str


def impact_links(session: Session, impact_view: Mapping[str, Any]) -> list[ImpactLink]:
    """Velocity, shot, run, plan and prediction, as far as there are any.

    Parameters:
        session: Open for reading.
        impact_view: The impact, as `impact.impact_page` gives it.
    """
    campaign = str(impact_view["campaign"])
    planned = session.execute(
        select(Plan.name, PlannedRun.run)
        .join(PlannedRun, PlannedRun.plan_id == Plan.id)
        .join(Impact, Impact.planned_run_id == PlannedRun.id)
        .where(Impact.id == impact_view["id"])
    ).one_or_none()
    links = [_velocity(impact_view, campaign)]
    if "shot" in impact_view:
        shot = impact_view["shot"]
        links.append(ImpactLink("shot", str(shot), _listed("/shots", campaign, f"id={shot}")))
    run = f"{impact_view['run']}, repetition {impact_view['repetition']}"
    if planned is None:
        listed = _listed("/impacts", campaign, f"run={impact_view['run']}")
        links += [ImpactLink("run", run, listed), ImpactLink("plan", "none", "")]
    else:
        plan, number = planned
        address = f"/plans/{quote(plan, safe='')}"
        links.append(ImpactLink("run", run, f"{address}/sheet?{urlencode({'run': number})}"))
        links.append(ImpactLink("plan", plan, address))
    links += _predictions(impact_view, campaign)
    return links


def _velocity(impact_view: Mapping[str, Any], campaign: str) -> ImpactLink:
    """That of the shot, measured before the contact, else that of the impact by its source."""
    measured = impact_view.get("measured_velocity_m_s")
    if measured is not None:
        text = _measured("measured_velocity_m_s", measured, impact_view["measured_velocity_u_m_s"])
        shot = f"id={impact_view['shot']}"
        return ImpactLink("velocity", text, _listed("/shots", campaign, shot))
    value, source = impact_view["impact_velocity_m_s"], impact_view["velocity_source"]
    if value is None:
        return ImpactLink("velocity", "not known", "")
    kind = velocity_kind(source)
    text = _measured("impact_velocity_m_s", value, impact_view["impact_velocity_u_m_s"])
    label = "velocity" if kind == BEFORE_CONTACT else velocity_label([kind])
    return ImpactLink(label, text, _listed("/impacts", campaign, f"id={impact_view['id']}"))


def _measured(key: str, value: float, uncertainty: float | None) -> str:
    number = measured_cell(key, value, uncertainty) if uncertainty else cell(key, value)
    return f"{number} {display_of(key).unit}"


def _predictions(impact_view: Mapping[str, Any], campaign: str) -> list[ImpactLink]:
    """The velocity that the nominal gun gives, which rests on no shot, and the address at which the
    twin predicts these settings."""
    settings: dict[str, Any] = {"campaign": campaign}
    pressure, velocity = impact_view.get("tank_pressure_pa"), impact_view["impact_velocity_m_s"]
    if pressure is not None:
        settings["tank_pressure_pa"] = pressure
    elif velocity is not None and velocity_kind(impact_view["velocity_source"]) == BEFORE_CONTACT:
        settings["impact_velocity_m_s"] = velocity
    else:  # an integrated velocity is smaller than that before the contact, which the twin takes
        return []
    for name in _TWIN_SETTINGS:
        if impact_view.get(name) is not None:
            settings[name] = impact_view[name]
    address = f"/twin?{urlencode(settings)}"
    nominal = impact_view.get("predicted_velocity_m_s")
    text = "of the twin for these settings"
    if nominal is not None:
        key = "predicted_velocity_m_s"
        text = f"{cell(key, nominal)} {display_of(key).unit} by the nominal gun"
    return [ImpactLink("prediction", text, address)]


def _listed(page: str, campaign: str, condition: str) -> str:
    return f"{page}?{urlencode({'campaign': campaign, 'where': condition})}"
