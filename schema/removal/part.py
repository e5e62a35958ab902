"""What is to be removed: a campaign, or one recording of it with its hits."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from ..impacts import Impact, Pulse
from ..listings import get_campaign_id
from ..recordings import RecordedChannel, Recording
from ..shots import Shot
from ..tombstones import CAMPAIGN, RECORDING

#: Keys of rows, to be used within another question.
Keys = Select[Any]


@dataclass(frozen=True)
class Part:
    """A campaign by its key, whole (`recording` is None) or one recording of it by its key, with its path."""

    campaign_id: int
    campaign: str
    recording_id: int | None = None
    recording: str | None = None

    @property
    def kind(self) -> str:
        return CAMPAIGN if self.recording_id is None else RECORDING

    @property
    def recordings(self) -> Keys:
        return self._of(Recording.id, Recording.campaign_id, Recording.id)

    @property
    def channels(self) -> Keys:
        return select(RecordedChannel.id).where(RecordedChannel.recording_id.in_(self.recordings))

    @property
    def impacts(self) -> Keys:
        return self._of(Impact.id, Impact.campaign_id, Impact.recording_id)

    @property
    def pulses(self) -> Keys:
        return select(Pulse.id).where(Pulse.impact_id.in_(self.impacts))

    @property
    def shots(self) -> Keys:
        return self._of(Shot.id, Shot.campaign_id, Shot.recording_id)

    def _of(self, key: Any, campaign: Any, recording: Any) -> Keys:
        if self.recording_id is None:
            return select(key).where(campaign == self.campaign_id)
        return select(key).where(campaign == self.campaign_id, recording == self.recording_id)


def campaign_part(session: Session, campaign: str) -> Part:
    """A whole campaign. Raises `LookupError` for an unknown one."""
    return Part(get_campaign_id(session, campaign), campaign)
