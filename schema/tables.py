"""Every table, imported once so that `Base.metadata` is complete."""

from __future__ import annotations

from . import (
    benches,
    campaign_counts,
    campaigns,
    corrections,
    diagnoses,
    impacts,
    jobs,
    provenance,
    recordings,
    registered_models,
)
from .base import Base

metadata = Base.metadata

__all__ = [
    "benches",
    "campaign_counts",
    "campaigns",
    "corrections",
    "diagnoses",
    "impacts",
    "jobs",
    "metadata",
    "provenance",
    "recordings",
    "registered_models",
]
