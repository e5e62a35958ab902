"""Every table, imported once so that `Base.metadata` is complete."""

from __future__ import annotations

from . import (
    attachments,
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
    run_predictions,
    saved_views,
    sign_on_identities,
    users,
)
from .base import Base

metadata = Base.metadata

__all__ = [
    "attachments",
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
    "run_predictions",
    "saved_views",
    "sign_on_identities",
    "users",
]
