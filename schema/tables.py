"""Every table, imported once so that `Base.metadata` is complete."""

from __future__ import annotations

from . import (
    audit,
    benches,
    campaign_counts,
    campaigns,
    corrections,
    diagnoses,
    home_pictures,
    impacts,
    jobs,
    notes,
    provenance,
    recordings,
    registered_models,
    saved_views,
    sign_on_identities,
    users,
)
from .base import Base

metadata = Base.metadata

__all__ = [
    "audit",
    "benches",
    "campaign_counts",
    "campaigns",
    "corrections",
    "diagnoses",
    "home_pictures",
    "impacts",
    "jobs",
    "metadata",
    "notes",
    "provenance",
    "recordings",
    "registered_models",
    "saved_views",
    "sign_on_identities",
    "users",
]
