"""What a campaign's impacts lack for training, as a note of an ingest."""

from __future__ import annotations

from typing import Any

from sqlalchemy import select

from ...dataset.predictors import shipped
from ...dataset.selection import missing_in_campaigns, missing_words
from ...schema.campaigns import Campaign
from ...schema.session import Store

CHECK = "missing-facts"


def training_notes(store: Store, campaign: str) -> list[dict[str, Any]]:
    """A note in the form of an ingest's findings, of the predictors that ship for the campaign's kind; none where
    nothing is missing."""
    with store.reading() as session:
        kind = session.scalars(select(Campaign.kind).where(Campaign.name == campaign)).one()
        words = missing_words(missing_in_campaigns(session, [campaign], shipped(kind)))
    note = {"recording": None, "channel": None, "check": CHECK, "severity": "note", "message": words}
    return [note] if words else []
