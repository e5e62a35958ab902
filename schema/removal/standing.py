"""What stands on a campaign or recording, within the store: datasets, diagnoses and adopted effects."""

from __future__ import annotations

from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..datasets import DatasetSnapshot, SnapshotPulse
from ..diagnoses import Diagnosis
from ..tombstones import CAMPAIGN
from ..twins import TwinVersion
from .part import Part
from .returning import pulse_digests


def datasets_on(session: Session, part: Part) -> list[dict[str, Any]]:
    """Frozen datasets with pulses of this part: name, hash, how many, how many pulses they have at all, and digests."""
    every = select(func.count()).where(SnapshotPulse.snapshot_id == DatasetSnapshot.id).correlate(DatasetSnapshot)
    query = (
        select(
            DatasetSnapshot.id,
            DatasetSnapshot.name,
            DatasetSnapshot.content_hash,
            func.count(),
            every.scalar_subquery(),
        )
        .join(SnapshotPulse, SnapshotPulse.snapshot_id == DatasetSnapshot.id)
        .where(SnapshotPulse.pulse_id.in_(part.pulses))
        .group_by(DatasetSnapshot.id, DatasetSnapshot.name, DatasetSnapshot.content_hash)
        .order_by(DatasetSnapshot.id)
    )
    keys = ("name", "hash", "pulses", "before")
    return [
        {**dict(zip(keys, row, strict=True)), "members": sorted(pulse_digests(session, part, key).values())}
        for key, *row in session.execute(query).all()
    ]


def diagnoses_on(session: Session, part: Part) -> list[dict[str, Any]]:
    """Diagnoses of this part's campaign. Those of a campaign that goes are given with their report, which is kept."""
    rows = session.scalars(select(Diagnosis).where(Diagnosis.campaign_id == part.campaign_id).order_by(Diagnosis.id))
    return [
        {
            "id": row.id,
            "diagnosed_at": row.diagnosed_at.isoformat(),
            "simulator": row.simulator,
            **({"report": row.report} if part.kind == CAMPAIGN else {}),
        }
        for row in rows
    ]


def adopted_on(session: Session, part: Part) -> list[dict[str, Any]]:
    """Versions of the twin's configuration that were adopted from diagnoses of this part's campaign."""
    query = select(TwinVersion).where(TwinVersion.campaign_id == part.campaign_id).order_by(TwinVersion.version)
    return [
        {
            "version": row.version,
            "diagnosis": row.diagnosis_id,
            "reason": row.reason,
            "adopted_at": row.adopted_at.isoformat(),
            "configuration": row.configuration,
        }
        for row in session.scalars(query)
    ]
