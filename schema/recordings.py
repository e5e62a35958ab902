"""Recordings as the bench wrote them: one row per file, one per channel, the samples in chunks; and
verdicts on the signals, each with its evidence.

The numbers are the file's own, bit for bit; `si_gain` and `si_offset` take them to SI. Chunks lie
in a table of their own so that no listing touches them, and a slice reads the chunks that it needs.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey, Index, LargeBinary, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from .base import LONG, Base, HasId, WithProvenance, names_row, one_of, positive

STORED, SET_ASIDE = STATUSES = ("stored", "set aside")
#: Keys of a channel's header, which no instrument writes: of the tank's pressure, of the laser, and
#: of any channel whose sensor was calibrated.
VALVE_OPENING = "pyroshock_valve_opening"
MUZZLE_VELOCITY = "pyroshock_muzzle_velocity"
CALIBRATION = "pyroshock_calibration"


class Recording(HasId, WithProvenance, Base):
    """A file of a campaign. A damaged one is set aside: its row says why, and nothing else is
    stored of it."""

    __tablename__ = "recordings"
    __table_args__ = (
        UniqueConstraint("campaign_id", "path"),
        CheckConstraint(one_of("status", STATUSES), "status_known"),
        CheckConstraint("status = 'stored' OR reason IS NOT NULL", "set_aside_with_reason"),
        CheckConstraint("length(sha256) = 64", "sha256_length"),
        # "was this file ingested before, under whatever name?"
        Index("ix_recordings_sha256", "sha256"),
    )

    campaign_id: Mapped[int] = mapped_column(ForeignKey("campaigns.id"))
    path: Mapped[str] = mapped_column(
        info=names_row("recording")
    )  # relative to the campaign folder
    sha256: Mapped[str]  # of the file
    size_bytes: Mapped[int] = mapped_column(LONG)
    format: Mapped[str]
    status: Mapped[str]
    reason: Mapped[str | None]
    channels: Mapped[list[RecordedChannel]] = relationship(
        order_by="RecordedChannel.name", cascade="all, delete-orphan", passive_deletes=True
    )


class RecordedChannel(HasId, WithProvenance, Base):
    """A sensor's record in one recording, with the calibration that was valid for it."""

    __tablename__ = "channels"
    __table_args__ = (
        UniqueConstraint("recording_id", "name"),
        CheckConstraint(positive("sampling_rate_hz"), "sampling_rate_positive"),
        CheckConstraint("samples > 0", "samples_positive"),
        CheckConstraint("chunk_samples > 0", "chunk_samples_positive"),
        CheckConstraint(positive("step"), "step_positive"),
        CheckConstraint("sensitivity <> 0", "sensitivity_not_zero"),
        CheckConstraint("length(sha256) = 64", "sha256_length"),
        # "the same shot exported twice in two formats"
        Index("ix_channels_sha256", "sha256"),
    )

    recording_id: Mapped[int] = mapped_column(ForeignKey("recordings.id", ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(info=names_row("channel"))
    quantity: Mapped[str]
    unit: Mapped[str]  # the laboratory's, as in campaign.toml
    sensitivity: Mapped[float | None]  # volt per unit
    offset_v: Mapped[float | None]
    position: Mapped[str | None]
    axis: Mapped[str | None]
    full_scale: Mapped[float | None]  # in `unit`
    si_unit: Mapped[str]
    si_gain: Mapped[float]
    si_offset: Mapped[float]
    sampling_rate_hz: Mapped[float]
    start_s: Mapped[float]
    samples: Mapped[int]
    dtype: Mapped[str]
    chunk_samples: Mapped[int]
    step: Mapped[float | None]  # samples are multiples of it, and stored as counts
    sha256: Mapped[str]  # of the samples
    header: Mapped[dict[str, Any]]


class SeriesChunk(WithProvenance, Base):
    """`chunk_samples` consecutive samples as one Blosc frame (see `series`)."""

    __tablename__ = "series_chunks"

    channel_id: Mapped[int] = mapped_column(
        ForeignKey("channels.id", ondelete="CASCADE"), primary_key=True
    )
    number: Mapped[int] = mapped_column(primary_key=True, info=names_row("chunk"))
    frame: Mapped[bytes] = mapped_column(LargeBinary)


REJECT = "reject"
SEVERITIES = ("note", "warning", REJECT)
#: What the listing says of an impact that no check has seen, because it has no recording.
NOT_JUDGED = "not judged"


class QualityFinding(HasId, WithProvenance, Base):
    """What a check said about a recording, one of its channels, or one impact in it."""

    __tablename__ = "quality_findings"
    __table_args__ = (CheckConstraint(one_of("severity", SEVERITIES), "severity_known"),)

    recording_id: Mapped[int] = mapped_column(ForeignKey("recordings.id"), index=True)
    channel_id: Mapped[int | None] = mapped_column(ForeignKey("channels.id"), index=True)
    impact_id: Mapped[int | None] = mapped_column(ForeignKey("impacts.id"), index=True)
    check: Mapped[str] = mapped_column(index=True, info=names_row("finding"))
    severity: Mapped[str]
    message: Mapped[str]
    evidence: Mapped[dict[str, Any]]
