"""A campaign's impacts and shots as the store has them, in the order in which they were run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import and_, case, select
from sqlalchemy.orm import Session, outerjoin

from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Pulse, Shot


@dataclass(frozen=True)
class StoredImpact:
    """One impact or shot. Keys are the store's; what it does not know is None.

    `velocity_source` is "reported", "laser", "integrated", or "impact" where a shot's muzzle velocity is missing and
    that at the plate stands in. `start_s` is the pulse's, on the recording's clock.
    """

    run: int
    repetition: int
    configuration_id: int
    recording_id: int | None
    impact_id: int | None
    velocity_m_s: float | None
    velocity_u_m_s: float | None
    velocity_source: str | None
    start_s: float | None
    contact_time_s: float | None
    set_pressure_pa: float | None = None
    recorded_pressure_pa: float | None = None
    bullet_mass_kg: float | None = None

    @property
    def has_pulse(self) -> bool:
        return self.recording_id is not None and self.start_s is not None


def read_hits(session: Session, campaign: Campaign) -> tuple[StoredImpact, ...]:
    """All of a campaign by run, then repetition."""
    table: Any = Impact
    source: Any = Impact
    velocity: list[Any] = [Impact.impact_velocity_m_s, Impact.impact_velocity_u_m_s, Impact.velocity_source]
    settings: list[Any] = []
    if campaign.kind == "gun":
        table, source = Shot, outerjoin(Shot, Impact, Shot.impact_id == Impact.id)
        stand_in = case((Impact.velocity_source == "reported", "impact"), else_=Impact.velocity_source)
        at_muzzle = (Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s, Shot.velocity_source)
        velocity = [
            case((Shot.velocity_source.is_not(None), muzzle), else_=plate)
            for muzzle, plate in zip(at_muzzle, (*velocity[:2], stand_in), strict=True)
        ]
        settings = [Shot.tank_pressure_pa, Shot.recorded_pressure_pa, Shot.bullet_mass_kg]
    keys = (table.run, table.repetition, table.configuration_id, table.recording_id, Impact.id)
    query = (
        select(*keys, *velocity, Pulse.start_s, Pulse.contact_time_s, *settings)
        .select_from(source)
        .outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
        .where(table.campaign_id == campaign.id)
        .order_by(table.run, table.repetition)
    )
    return tuple(StoredImpact(*row) for row in session.execute(query))
