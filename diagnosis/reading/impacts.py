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


_PULSE = (Pulse.start_s, Pulse.contact_time_s)
_IMPACT_SPEED = (Impact.impact_velocity_m_s, Impact.impact_velocity_u_m_s, Impact.velocity_source)
_SHOT_SPEED = (Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s, Shot.velocity_source)


def read_hits(session: Session, campaign: Campaign) -> tuple[Hit, ...]:
    """All of a campaign by run, then repetition."""
    query = _shots(campaign.id) if campaign.kind == "gun" else _impacts(campaign.id)
    make = _shot if campaign.kind == "gun" else _impact
    return tuple(make(tuple(row)) for row in session.execute(query))


def _impacts(campaign: int) -> Any:
    keys = (Impact.run, Impact.repetition, Impact.configuration_id, Impact.recording_id, Impact.id)
    query = select(*keys, *_IMPACT_SPEED, *_PULSE)
    query = query.outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
    return query.where(Impact.campaign_id == campaign).order_by(Impact.run, Impact.repetition)


def _shots(campaign: int) -> Any:
    keys = (Shot.run, Shot.repetition, Shot.configuration_id, Shot.recording_id, Shot.impact_id)
    own = (Shot.tank_pressure_pa, Shot.recorded_pressure_pa, Shot.bullet_mass_kg)
    query = select(*keys, *_SHOT_SPEED, *_PULSE, *own, *_IMPACT_SPEED).select_from(Shot)
    query = query.outerjoin(Impact, Shot.impact_id == Impact.id)
    query = query.outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
    return query.where(Shot.campaign_id == campaign).order_by(Shot.run, Shot.repetition)


def _impact(row: tuple[Any, ...]) -> Hit:
    return Hit(*row)


def _shot(row: tuple[Any, ...]) -> Hit:
    """What was measured at the muzzle goes before what was measured at the plate."""
    keys, muzzle, rest, plate = row[:5], row[5:8], row[8:13], row[13:]
    if muzzle[0] is None and plate[0] is not None:
        muzzle = (plate[0], plate[1], "integrated" if plate[2] == "integrated" else "impact")
    return Hit(*keys, *muzzle, *rest)
