"""Impacts, the pulses that were extracted from their records, the figures of their acceleration
channels, shots of the gun, frozen selections of pulses, and what an impact velocity means, by how
it was obtained.

A velocity that was integrated from the impactor's deceleration to the peak of the force (thesis,
section 4.1) is the one that the impactor lost until then. Where the target gives way, the impactor
still moves with the target's surface at the peak, and the integral is only 0.3 to 0.8 of the
velocity before contact.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, Index, LargeBinary, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import Base, HasId, WithProvenance, names_row, not_negative, positive
from .campaigns import Campaign, Configuration
from .recordings import RecordedChannel, Recording
from .velocity_kinds import BEFORE_CONTACT as BEFORE_CONTACT
from .velocity_kinds import INTEGRATED as INTEGRATED
from .velocity_kinds import KIND_OF_SOURCE as KIND_OF_SOURCE
from .velocity_kinds import KINDS as KINDS
from .velocity_kinds import TARGET_MOTION_ADDED as TARGET_MOTION_ADDED
from .velocity_kinds import velocity_kind as velocity_kind


class Impact(HasId, WithProvenance, Base):
    """One hit of a campaign: which configuration, how fast, and where in the recording."""

    __tablename__ = "impacts"
    __table_args__ = (
        UniqueConstraint("campaign_id", "run", "repetition"),
        CheckConstraint("run >= 0", "run_not_negative"),
        CheckConstraint("repetition >= 1", "repetition_positive"),
        CheckConstraint(not_negative("impact_velocity_m_s"), "velocity_not_negative"),
        CheckConstraint(not_negative("impact_velocity_u_m_s"), "velocity_u_not_negative"),
        CheckConstraint(
            "(impact_velocity_m_s IS NULL) = (velocity_source IS NULL)", "velocity_with_source"
        ),
        # a listing goes through one campaign, or one configuration, in the order of keys
        Index("ix_impacts_campaign_id_id", "campaign_id", "id"),
        Index("ix_impacts_configuration_id_id", "configuration_id", "id"),
        Index("ix_impacts_recording_id", "recording_id"),
    )

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"))
    run: Mapped[int] = mapped_column(info=names_row("run"))
    repetition: Mapped[int] = mapped_column(info=names_row("repetition"))
    configuration_id: Mapped[int] = mapped_column(ForeignKey("configurations.id"))
    recording_id: Mapped[int | None] = mapped_column(ForeignKey("recordings.id"))
    planned_run_id: Mapped[int | None] = mapped_column(ForeignKey("planned_runs.id"), index=True)
    impact_velocity_m_s: Mapped[float | None]
    impact_velocity_u_m_s: Mapped[float | None]
    velocity_source: Mapped[
        str | None
    ]  # of `velocity_kinds.KIND_OF_SOURCE`: what the velocity means
    #: Not known of what was stored before revision 0020. It stays when a fact is corrected, which
    #: gives the row another writer.
    stored_at: Mapped[datetime | None]
    campaign: Mapped[Campaign] = relationship()
    configuration: Mapped[Configuration] = relationship()
    recording: Mapped[Recording | None] = relationship()
    pulses: Mapped[list[Pulse]] = relationship(back_populates="impact")


class ExtractionSettingsRow(HasId, WithProvenance, Base):
    """How pulses were cut out, stored once per distinct setting; `code_version` counts changes of
    the algorithm."""

    __tablename__ = "extraction_settings"
    __table_args__ = (CheckConstraint("code_version >= 1", "code_version_positive"),)

    fingerprint: Mapped[str] = mapped_column(unique=True)
    code_version: Mapped[int]
    settings: Mapped[dict[str, Any]]


class Pulse(HasId, WithProvenance, Base):
    """The contact force of one impact. A re-extraction is a further row; `current` marks the one in
    use."""

    __tablename__ = "pulses"
    __table_args__ = (
        UniqueConstraint("impact_id", "settings_id"),
        CheckConstraint(positive("contact_time_s"), "contact_time_positive"),
        CheckConstraint(positive("peak_force_n"), "peak_force_positive"),
        CheckConstraint(
            "compression_time_s >= 0 AND compression_time_s <= contact_time_s", "compression_within"
        ),
        CheckConstraint("samples_in_contact >= 1", "samples_positive"),
        # one pulse in use per impact; also the join of every listing
        Index(
            "uq_pulses_current",
            "impact_id",
            unique=True,
            sqlite_where=text("current"),
            postgresql_where=text("current"),
        ),
    )

    impact_id: Mapped[int] = mapped_column(ForeignKey("impacts.id"))
    settings_id: Mapped[int] = mapped_column(ForeignKey("extraction_settings.id"), index=True)
    current: Mapped[bool]
    extracted_at: Mapped[datetime]
    start_s: Mapped[float]  # first instant of contact, on the recording's clock
    contact_time_s: Mapped[float]
    compression_time_s: Mapped[float]
    peak_force_n: Mapped[float]  # of the recorded samples
    spline_peak_force_n: Mapped[float]
    impulse_n_s: Mapped[float]
    compression_impulse_n_s: Mapped[float]
    width_half_s: Mapped[float]  # at half of the peak
    width_tenth_s: Mapped[float]  # at a tenth of the peak
    samples_in_contact: Mapped[int]
    spline_nrmse: Mapped[float]  # eq. 4.4
    segmentation_difference: Mapped[float]  # eq. 4.5, as a share
    force_points_n: Mapped[list[Any]]  # 20 equidistant points of the contact
    fine_period_s: Mapped[float]
    fine_force_n: Mapped[bytes] = mapped_column(
        LargeBinary, deferred=True
    )  # float64 frame, see `series`
    impact: Mapped[Impact] = relationship(back_populates="pulses")
    settings: Mapped[ExtractionSettingsRow] = relationship()


class ChannelFigures(HasId, WithProvenance, Base):
    """What one acceleration channel recorded of one impact (see `signals.shock_figures`), above the
    rest before it.

    `largest` marks the channel with the largest peak of the impact, whose figures the listing has.
    """

    __tablename__ = "channel_figures"
    __table_args__ = (
        UniqueConstraint("impact_id", "channel_id"),
        CheckConstraint("peak_acceleration_m_s2 > 0", "peak_acceleration_positive"),
        CheckConstraint(not_negative("pulse_duration_s"), "pulse_duration_not_negative"),
        CheckConstraint(not_negative("effective_duration_s"), "effective_duration_not_negative"),
        CheckConstraint(not_negative("energy_duration_s"), "energy_duration_not_negative"),
        # one channel per impact; also the join of every listing
        Index(
            "uq_channel_figures_largest",
            "impact_id",
            unique=True,
            sqlite_where=text("largest"),
            postgresql_where=text("largest"),
        ),
        Index("ix_channel_figures_channel_id", "channel_id"),
    )

    impact_id: Mapped[int] = mapped_column(ForeignKey("impacts.id"))
    channel_id: Mapped[int] = mapped_column(ForeignKey("channels.id"))
    largest: Mapped[bool]
    rest_m_s2: Mapped[float | None]  # None: no rest was recorded before the shock
    peak_acceleration_m_s2: Mapped[float]
    signed_peak_acceleration_m_s2: Mapped[float]
    peak_time_s: Mapped[float]  # on the recording's clock
    pulse_start_s: Mapped[float]
    pulse_duration_s: Mapped[float]  # at a tenth of the peak
    effective_duration_s: Mapped[float]  # of all beyond a third of the peak
    energy_duration_s: Mapped[float]  # from 5 to 95 % of the energy
    velocity_change_m_s: Mapped[float]  # over the pulse
    record_velocity_change_m_s: Mapped[float]
    srs_frequency_hz: Mapped[list[Any]]  # octaves from 10 Hz
    srs_maximax_m_s2: Mapped[list[Any]]  # Q = 10
    srs_peak_m_s2: Mapped[float | None]
    srs_peak_frequency_hz: Mapped[float | None]
    impact: Mapped[Impact] = relationship()
    channel: Mapped[RecordedChannel] = relationship()


class Shot(HasId, WithProvenance, Base):
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
        CheckConstraint(
            "(measured_velocity_m_s IS NULL) = (velocity_source IS NULL)", "velocity_with_source"
        ),
        Index("ix_shots_campaign_id_id", "campaign_id", "id"),
        Index("ix_shots_configuration_id_id", "configuration_id", "id"),
        Index("ix_shots_recording_id", "recording_id"),
    )

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"))
    run: Mapped[int] = mapped_column(info=names_row("run"))
    repetition: Mapped[int] = mapped_column(info=names_row("repetition"))
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
    stored_at: Mapped[datetime | None]  # not known of what was stored before revision 0020
    campaign: Mapped[Campaign] = relationship()
    configuration: Mapped[Configuration] = relationship()
    recording: Mapped[Recording | None] = relationship()
    impact: Mapped[Impact | None] = relationship()


class DatasetSnapshot(HasId, WithProvenance, Base):
    """A dataset, identified by the hash of its content."""

    __tablename__ = "dataset_snapshots"
    __table_args__ = (CheckConstraint("length(content_hash) = 64", "content_hash_length"),)

    name: Mapped[str] = mapped_column(unique=True, info=names_row("dataset"))
    content_hash: Mapped[str] = mapped_column(unique=True)
    frozen_at: Mapped[datetime]
    definition: Mapped[dict[str, Any]]  # campaigns, predictors, targets, quality rule


class SnapshotPulse(WithProvenance, Base):
    """A pulse belongs to a snapshot; only a deletion that leaves a tombstone takes it away."""

    __tablename__ = "snapshot_pulses"

    snapshot_id: Mapped[int] = mapped_column(ForeignKey("dataset_snapshots.id"), primary_key=True)
    pulse_id: Mapped[int] = mapped_column(ForeignKey("pulses.id"), primary_key=True, index=True)
