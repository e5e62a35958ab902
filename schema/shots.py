"""Shots of the gun: what the tank held, and how fast the bullet left."""

from __future__ import annotations

from sqlalchemy import CheckConstraint, ForeignKey, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, Written, not_negative, positive
from .campaigns import Campaign, Configuration
from .figures import SHOT, hashed
from .impacts import Impact
from .recordings import Recording


class Shot(HasId, Written, Base):
    """One firing. Pressures are gauge, as the transducer and the thesis give them."""

    __tablename__ = "shots"
    __table_args__ = (
        UniqueConstraint("campaign_id", "run", "repetition"),
        CheckConstraint("run >= 0", "run_not_negative"),
        CheckConstraint("repetition >= 1", "repetition_positive"),
        CheckConstraint(positive("tank_pressure_pa"), "tank_pressure_positive"),
        CheckConstraint(positive("bullet_mass_kg"), "bullet_mass_positive"),
        CheckConstraint(positive("bullet_length_m"), "bullet_length_positive"),
        CheckConstraint(not_negative("measured_velocity_m_s"), "velocity_not_negative"),
        CheckConstraint(not_negative("measured_velocity_u_m_s"), "velocity_u_not_negative"),
        CheckConstraint("(measured_velocity_m_s IS NULL) = (velocity_source IS NULL)", "velocity_with_source"),
        Index("ix_shots_campaign_id_id", "campaign_id", "id"),
        Index("ix_shots_configuration_id_id", "configuration_id", "id"),
        Index("ix_shots_recording_id", "recording_id"),
    )

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"))
    run: Mapped[int]
    repetition: Mapped[int]
    configuration_id: Mapped[int] = mapped_column(ForeignKey("configurations.id"))
    recording_id: Mapped[int | None] = mapped_column(ForeignKey("recordings.id"))
    planned_run_id: Mapped[int | None] = mapped_column(ForeignKey("planned_runs.id"), index=True)
    impact_id: Mapped[int | None] = mapped_column(ForeignKey("impacts.id"))
    tank_pressure_pa: Mapped[float]  # set point, or what the lab wrote down
    recorded_pressure_pa: Mapped[float | None]  # from the transducer, before the valve opened
    recorded_pressure_u_pa: Mapped[float | None]
    bullet_mass_kg: Mapped[float]
    bullet_length_m: Mapped[float | None]
    measured_velocity_m_s: Mapped[float | None]
    measured_velocity_u_m_s: Mapped[float | None]
    velocity_source: Mapped[str | None]  # "reported", or "laser": before contact
    figures_sha256: Mapped[str | None] = mapped_column(default=hashed(SHOT))
    campaign: Mapped[Campaign] = relationship()
    configuration: Mapped[Configuration] = relationship()
    recording: Mapped[Recording | None] = relationship()
    impact: Mapped[Impact | None] = relationship()
