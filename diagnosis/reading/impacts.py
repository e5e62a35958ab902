"""A campaign's impacts and shots as the store has them, in the order in which they were run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import and_, select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Pulse
from ...schema.shots import Shot


@dataclass(frozen=True)
class Hit:
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


def read_hits(session: Session, campaign: Campaign) -> tuple[Hit, ...]:
    """All of a campaign by run, then repetition."""
    table: Any = Shot if campaign.kind == "gun" else Impact
    speed = (Impact.impact_velocity_m_s, Impact.impact_velocity_u_m_s, Impact.velocity_source)
    pulse = (Pulse.start_s, Pulse.contact_time_s)
    keys = (table.run, table.repetition, table.configuration_id, table.recording_id)
    if campaign.kind == "gun":
        muzzle = (Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s, Shot.velocity_source)
        settings = (Shot.tank_pressure_pa, Shot.recorded_pressure_pa, Shot.bullet_mass_kg)
        query: Any = select(*keys, Shot.impact_id, *muzzle, *pulse, *settings, *speed).select_from(Shot)
        query = query.outerjoin(Impact, Shot.impact_id == Impact.id)
    else:
        query = select(*keys, Impact.id, *speed, *pulse)
    query = query.outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
    query = query.where(table.campaign_id == campaign.id).order_by(table.run, table.repetition)
    return tuple(_hit(tuple(row)) for row in session.execute(query))


def _hit(row: tuple[Any, ...]) -> Hit:
    """What was measured at the muzzle goes before what was measured at the plate, which ends a shot's row."""
    keys, velocity, rest, at_plate = row[:5], row[5:8], row[8:13], row[13:]
    if at_plate and velocity[0] is None and at_plate[0] is not None:
        velocity = (at_plate[0], at_plate[1], "integrated" if at_plate[2] == "integrated" else "impact")
    return Hit(*keys, *velocity, *rest)
