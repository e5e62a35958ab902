"""Every table, imported once so that `Base.metadata` is complete."""

from __future__ import annotations

from . import (
    benches,
    campaign_counts,
    campaigns,
    diagnoses,
    home_pictures,
    impacts,
    jobs,
    provenance,
    recordings,
    registered_models,
    saved_views,
)
from .base import Base

metadata = Base.metadata

__all__ = [
    "benches",
    "campaign_counts",
    "campaigns",
    "diagnoses",
    "home_pictures",
    "impacts",
    "jobs",
    "metadata",
    "provenance",
    "recordings",
    "registered_models",
    "saved_views",
]
