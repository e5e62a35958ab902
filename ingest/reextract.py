"""Pulses cut anew from the stored series with other settings. Old versions stay; the new one is in use."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.listings import get_campaign_id
from ..schema.recordings import Recording
from ..schema.session import Store
from .recut import Cut, add_versions, cut, impacts_of, put_in_use, versions
from .settings import ExtractionSettings

STORED = "stored"


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
            Recording.campaign_id == get_campaign_id(session, campaign), Recording.status == STORED
        )
        recordings = session.execute(query.order_by(Recording.id)).all()
    for done, (key, path) in enumerate(recordings, 1):
        _one(store, key, path, settings, report)
        if progress:
            progress(done, len(recordings), path)
    return report


def reextract_recording(store: Store, recording_key: int, settings: ExtractionSettings) -> ReextractionReport:
    """`reextract` of one recording, with all its hits. Raises as `preview_impacts`."""
    with store.reading() as session:
        campaign, path, _ = _recording(session, recording_key)
    report = ReextractionReport(campaign)
    _one(store, recording_key, path, settings, report)
    return report


def preview_impacts(store: Store, recording_key: int, settings: ExtractionSettings) -> Cut:
    """What `reextract_recording` would store of a recording; nothing is.

    Raises `LookupError` for a recording that there is not, was set aside, or in which no contact was found.
    """
    with store.reading() as session:
        _, _, impacts = _recording(session, recording_key)
        return cut(session, recording_key, impacts, settings)


def _recording(session: Session, key: int) -> tuple[str, str, list[int]]:
    """Its campaign, its path and the impacts that can be cut."""
    columns = (Campaign.name, Recording.path, Recording.status, Recording.reason)
    found = session.execute(select(*columns).join(Campaign).where(Recording.id == key)).one_or_none()
    if found is None:
        raise LookupError(f"no recording {key} in the store; pyroshock show IMPACT names those of impacts")
    campaign, path, status, reason = found
    if status != STORED:
        raise LookupError(f"recording {path!r} of campaign {campaign!r} was {status}, nothing to cut: {reason}")
    impacts = impacts_of(session, key)
    if not impacts:
        raise LookupError(f"recording {path!r} of campaign {campaign!r} has no impact with a contact to cut")
    return campaign, path, impacts


def _one(store: Store, recording: int, path: str, settings: ExtractionSettings, report: ReextractionReport) -> None:
    with store.reading() as session:
        impacts = impacts_of(session, recording)
        if not impacts:
            return
        known = len(versions(session, impacts, settings)) == len(impacts)
        found = None if known else cut(session, recording, impacts, settings)
    if found is not None and found.mismatch is not None:
        report.skipped.append({"recording": path, "reason": found.mismatch})
        return
    with store.writing() as session:
        # Asked again under the lock: a second request for the same may have been faster.
        earlier = versions(session, impacts, settings)
        if found is None or len(earlier) == len(impacts):
            put_in_use(session, impacts, earlier)
            report.reused += len(earlier)
        else:
            add_versions(session, found)
            report.added += len(found.pulses)
