"""What the ingest's quality checks said of a campaign: records that are not to be used, and hits that were double."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from sqlalchemy import and_, func, or_, select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...schema.quality import QualityFinding
from ...schema.recordings import RecordedChannel, Recording
from .impacts import StoredImpact

_CUT_TOPS = ("clipping", "saturation")
#: A sample from this share of a rail's level on is at the rail.
_AT_RAIL = 0.999
#: Quantities that a diagnosis reads: pressure and displacement for the gun, the others for contact and plate.
_READ = ("force", "acceleration", "pressure", "displacement")


@dataclass(frozen=True)
class QualityExclusions:
    """`rejected`: (recording, impact, channel) of each finding; an impact or channel of None stands for all of them.

    `double_hits`: impacts. `rails`: by recording and channel, levels (SI) at which tops are cut somewhere outside of
    contacts.
    """

    rejected: frozenset[tuple[int, int | None, str | None]]
    double_hits: frozenset[int]
    rails: Mapping[tuple[int, str], tuple[float, ...]]

    def rejects(self, hit: StoredImpact, channel: str) -> bool:
        """Whether a check said not to use this channel of this hit."""
        if hit.recording_id is None:
            return False
        impacts, channels = (hit.impact_id, None), (channel, None)
        return any((hit.recording_id, i, c) in self.rejected for i in impacts for c in channels)

    def cut_top(self, hit: StoredImpact, channel: str, values: Floats) -> bool:
        """Whether samples of this hit (n,) stand at a rail."""
        rails = self.rails.get((hit.recording_id or 0, channel), ())
        return any((values * np.sign(rail)).max(initial=0.0) >= _AT_RAIL * abs(rail) for rail in rails)


def read_exclusions(session: Session, campaign_id: int) -> QualityExclusions:
    """Of all recordings of a campaign. Raises `ValueError` for a channel without a finite number in any of them."""
    finding, channel = QualityFinding, RecordedChannel
    # Outside of contacts a cut top leaves the pulse whole, but not a record that rings there.
    outside = and_(finding.check.in_(_CUT_TOPS), finding.severity == "warning")
    columns = (finding.recording_id, finding.impact_id, channel.name, finding.check, finding.severity, finding.evidence)
    query = (
        select(*columns)
        .join(Recording, finding.recording_id == Recording.id)
        .outerjoin(channel, finding.channel_id == channel.id)
        .where(Recording.campaign_id == campaign_id)
        .where(or_(finding.severity == "reject", finding.check.in_(("double-hit", "dropouts")), outside))
    )
    rejected: set[tuple[int, int | None, str | None]] = set()
    double: set[int] = set()
    rails: dict[tuple[int, str], tuple[float, ...]] = {}
    empty: set[tuple[int, str]] = set()
    for recording, impact, name, check, severity, evidence in session.execute(query):
        if check == "dropouts" and evidence.get("kind") == "nan" and evidence.get("share") == 1.0:
            empty.add((recording, name))
        if severity == "reject":
            rejected.add((recording, impact, name))
        elif check == "double-hit":
            double.add(impact)
        elif check in _CUT_TOPS:
            rails[recording, name] = (*rails.get((recording, name), ()), float(evidence["level"]))
    _refuse_empty(session, campaign_id, Counter(name for _, name in empty))
    return QualityExclusions(frozenset(rejected), frozenset(double), rails)


def _refuse_empty(session: Session, campaign_id: int, empty: Mapping[str, int]) -> None:
    """`empty`: recordings by channel in which it has no finite number."""
    channels = (
        select(RecordedChannel.name, func.count())
        .join(Recording, RecordedChannel.recording_id == Recording.id)
        .where(Recording.campaign_id == campaign_id, RecordedChannel.quantity.in_(_READ))
        .group_by(RecordedChannel.name)
        .order_by(RecordedChannel.name)
    )
    for name, count in session.execute(channels):
        if empty.get(name) == count:
            raise ValueError(
                f"channel {name} holds no number in any of its {count} recordings: mend these, or take "
                f"[channels.{name}] out of campaign.toml, and ingest anew"
            )
