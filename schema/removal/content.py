"""The hash of a campaign's or recording's content: the same files, ingested again, have it again."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..campaigns import Campaign, Configuration
from ..impacts import ExtractionSettingsRow, Impact, Pulse
from ..recordings import RecordedChannel, Recording
from ..shots import Shot
from .part import Part


def content_hash(session: Session, part: Part) -> str:
    """SHA-256 of what makes the content, without keys, clocks and writers, so that both engines give the same.

    These are the campaign's facts, the SHA-256 of each file and of each channel's samples, and of impacts, pulses and
    shots the configuration and the SHA-256 of the figures.
    """
    digest = hashlib.sha256()
    for kind, query in _queries(part):
        for row in sorted(session.execute(query), key=repr):
            digest.update(f"{kind} {tuple(map(_text, row))!r}\n".encode())
    return digest.hexdigest()


def _text(value: Any) -> str:
    return "" if value is None else str(value)


def _queries(part: Part) -> Iterator[tuple[str, Any]]:
    facts = (Campaign.name, Campaign.kind, Campaign.date, Campaign.fingerprint)
    yield "campaign", select(*facts).where(Campaign.id == part.campaign_id)
    files = (Recording.path, Recording.sha256, Recording.status)
    yield "recording", select(*files).where(Recording.id.in_(part.recordings))
    channels = select(Recording.path, RecordedChannel.name, RecordedChannel.sha256).join(
        Recording, RecordedChannel.recording_id == Recording.id
    )
    yield "channel", channels.where(Recording.id.in_(part.recordings))
    for kind, table, keys in (("impact", Impact, part.impacts), ("shot", Shot, part.shots)):
        columns = (table.run, table.repetition, Configuration.fingerprint, table.figures_sha256)
        hits = select(*columns).join(Configuration, table.configuration_id == Configuration.id)
        yield kind, hits.where(table.id.in_(keys))
    pulses = select(Impact.run, Impact.repetition, ExtractionSettingsRow.fingerprint, Pulse.figures_sha256)
    pulses = pulses.join(Impact, Pulse.impact_id == Impact.id)
    pulses = pulses.join(ExtractionSettingsRow, Pulse.settings_id == ExtractionSettingsRow.id)
    yield "pulse", pulses.where(Pulse.id.in_(part.pulses))
