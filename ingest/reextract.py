"""Pulses cut anew from the stored series with other settings. Old versions stay; the new one is in use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from ..schema.impacts import Impact
from ..schema.impacts import Pulse as PulseRow
from ..schema.listings import get_campaign_id
from ..schema.recordings import Recording
from ..schema.session import Store
from .processing import pulses_of
from .rows import pulse_row, settings_id
from .settings import ExtractionSettings
from .stored import list_channels, read_channel


@dataclass
class ReextractionReport:
    """What changed: pulses `added`, pulses of earlier versions put back in use, recordings left as they were."""

    campaign: str
    added: int = 0
    reused: int = 0
    skipped: list[dict[str, str]] = field(default_factory=list)

    def as_json(self) -> dict[str, object]:
        return {"campaign": self.campaign, "added": self.added, "reused": self.reused, "skipped": self.skipped}


def reextract(
    store: Store,
    campaign: str,
    settings: ExtractionSettings,
    progress: Callable[[int, int, str], None] | None = None,
) -> ReextractionReport:
    """Cut every recording of `campaign` again, one transaction each. Raises `LookupError` for an unknown campaign.

    A recording in which the new settings find another number of impacts is skipped and named: which pulse
    belongs to which impact would be a guess.
    """
    report = ReextractionReport(campaign)
    with store.reading() as session:
        query = select(Recording.id, Recording.path).where(
            Recording.campaign_id == get_campaign_id(session, campaign), Recording.status == "stored"
        )
        recordings = session.execute(query.order_by(Recording.id)).all()
    for done, (key, path) in enumerate(recordings, 1):
        _one(store, key, path, settings, report)
        if progress:
            progress(done, len(recordings), path)
    return report


def _one(store: Store, recording: int, path: str, settings: ExtractionSettings, report: ReextractionReport) -> None:
    with store.reading() as session:
        impacts = _impacts(session, recording)
        if not impacts:
            return
        known = _versions(session, impacts, settings)
        channels = [read_channel(session, row) for row in list_channels(session, recording) if row.quantity == "force"]
    if len(known) == len(impacts):
        with store.writing() as session:
            _put_in_use(session, known)
        report.reused += len(known)
        return
    pulses = pulses_of(channels, settings, len(impacts))
    if len(pulses) != len(impacts):
        reason = f"{len(pulses)} impacts found with these settings, {len(impacts)} stored"
        report.skipped.append({"recording": path, "reason": reason})
        return
    with store.writing() as session:
        key = settings_id(session, settings)
        _retire(session, impacts)
        session.add_all(pulse_row(p, impact, key) for p, impact in zip(pulses, impacts, strict=True))
    report.added += len(pulses)


def _impacts(session: Session, recording: int) -> list[int]:
    """Impacts of a recording in the order of their contacts."""
    query = (
        select(Impact.id)
        .join(PulseRow, PulseRow.impact_id == Impact.id)
        .where(Impact.recording_id == recording)
        .group_by(Impact.id)
        .order_by(func.min(PulseRow.start_s))
    )
    return list(session.scalars(query))


def _versions(session: Session, impacts: list[int], settings: ExtractionSettings) -> list[int]:
    """Pulses that were already cut with these settings."""
    query = select(PulseRow.id).join(PulseRow.settings).where(PulseRow.impact_id.in_(impacts))
    return list(session.scalars(query.where(PulseRow.settings.has(fingerprint=settings.fingerprint))))


def _retire(session: Session, impacts: list[int]) -> None:
    session.execute(update(PulseRow).where(PulseRow.impact_id.in_(impacts), PulseRow.current).values(current=False))


def _put_in_use(session: Session, pulses: list[int]) -> None:
    impacts = select(PulseRow.impact_id).where(PulseRow.id.in_(pulses))
    session.execute(update(PulseRow).where(PulseRow.impact_id.in_(impacts), PulseRow.current).values(current=False))
    session.execute(update(PulseRow).where(PulseRow.id.in_(pulses)).values(current=True))
