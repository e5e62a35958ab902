"""Versions of models that were registered, as the store knows them: what a registry must hold, and
what a lost one held."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import CheckConstraint, Index, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from .base import Base, HasId, WithProvenance, names_row


class RegisteredVersion(HasId, WithProvenance, Base):
    """A version of a model as it was registered. The registry has its files; `record` is all that
    it said of it."""

    __tablename__ = "registered_versions"
    __table_args__ = (
        UniqueConstraint("label", "sha256"),
        CheckConstraint("version > 0", "version_positive"),
        CheckConstraint("length(sha256) = 64", "sha256_length"),
        CheckConstraint("length(dataset_hash) = 64", "dataset_hash_length"),
        # "which versions were trained on this dataset"
        Index("ix_registered_versions_dataset_hash", "dataset_hash"),
    )

    label: Mapped[str] = mapped_column(info=names_row("model"))  # "gp@1"
    name: Mapped[str]
    version: Mapped[int]
    dataset: Mapped[str]
    dataset_hash: Mapped[str]
    sha256: Mapped[str]  # of the model that is put in use with the version
    registry_address: Mapped[str]  # its address, without a password
    registered_at: Mapped[datetime]
    record: Mapped[dict[str, Any]]  # "run_id", "model_id", and "tags", as the registry had them
