"""Frozen selections of pulses: what a model was trained on."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, Written


class DatasetSnapshot(HasId, Written, Base):
    """A dataset, identified by the hash of its content."""

    __tablename__ = "dataset_snapshots"
    __table_args__ = (CheckConstraint("length(content_hash) = 64", "content_hash_length"),)

    name: Mapped[str] = mapped_column(unique=True)
    content_hash: Mapped[str] = mapped_column(unique=True)
    frozen_at: Mapped[datetime]
    definition: Mapped[dict[str, Any]]  # campaigns, predictors, targets, quality rule


class SnapshotPulse(Written, Base):
    """A pulse belongs to a snapshot; only a deletion that leaves a tombstone takes it away."""

    __tablename__ = "snapshot_pulses"

    snapshot_id: Mapped[int] = mapped_column(ForeignKey("dataset_snapshots.id"), primary_key=True)
    pulse_id: Mapped[int] = mapped_column(ForeignKey("pulses.id"), primary_key=True, index=True)
