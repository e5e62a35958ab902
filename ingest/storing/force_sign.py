"""The sign of the force in each recording of a campaign, held against that of the others.

A contact pushes. Which sign a push has is the wiring's choice, and an extraction turns it upright
by itself; but within a campaign it is the same, unless a cable was turned over or the sensor was
pulled.
"""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.access.append_only import withdraw_findings
from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Pulse
from ...schema.recordings import QualityFinding, RecordedChannel, Recording
from ...schema.session import Store
from ..extraction.record_checks import NEGATIVE_FORCE

#: Keys of a recording and of the channel that measured its force.
Place = tuple[int, int | None]


OTHER_SIGN = "force-sign"


def warn_of_sign(store: Store, campaign: str) -> None:
    """A `warning` on each recording of `campaign` whose force has another sign than that of most;
    on those of negative force where there are as many of either. What was said before is brought up
    to date."""
    wanted, present = store.read(lambda session: _minority(session, campaign))
    if wanted.keys() != present:
        store.write(
            lambda session: _write(store, session, wanted, present - wanted.keys(), present),
            idempotent=True,
        )


def _minority(session: Session, campaign: str) -> tuple[dict[Place, str], set[Place]]:
    """(recording, channel) -> what is to be said of it; and those of which it is said already."""
    with_pulses = (
        select(Impact.recording_id)
        .join(Pulse, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .where(Campaign.name == campaign)
        .distinct()
    )
    forces = select(RecordedChannel.recording_id, RecordedChannel.id).where(
        RecordedChannel.quantity == "force", RecordedChannel.recording_id.in_(with_pulses)
    )
    channels: dict[int, int] = dict(
        iter(session.execute(forces.order_by(RecordedChannel.id.desc())))
    )
    columns = (QualityFinding.recording_id, QualityFinding.channel_id, QualityFinding.check)
    query = select(*columns).join(Recording, QualityFinding.recording_id == Recording.id)
    query = query.join(Campaign, Recording.campaign_id == Campaign.id).where(
        Campaign.name == campaign, QualityFinding.check.in_((NEGATIVE_FORCE, OTHER_SIGN))
    )
    findings = session.execute(query).all()
    negative = {
        recording for recording, _, check in findings if check == NEGATIVE_FORCE
    } & channels.keys()
    positive = channels.keys() - negative
    minority, sign, others = negative, "negative", len(positive)
    if len(positive) < len(negative):
        minority, sign, others = positive, "positive", len(negative)
    message = (
        f"the force is {sign} here and the other way in {others} recordings "
        f"of the campaign: a cable was turned over, "
        "or the sensor was pulled; look at the wiring and at the sensitivity's sign"
    )
    wanted: dict[Place, str] = {(key, channels[key]): message for key in minority} if others else {}
    return wanted, {(row[0], row[1]) for row in findings if row[2] == OTHER_SIGN}


def _write(
    store: Store,
    session: Session,
    wanted: dict[Place, str],
    withdrawn: set[Place],
    present: set[Place],
) -> None:
    for recording, _ in sorted(withdrawn):
        withdraw_findings(session.connection(), recording, OTHER_SIGN)
    rows: list[dict[str, object]] = [
        {
            "recording_id": recording,
            "channel_id": channel,
            "impact_id": None,
            "check": OTHER_SIGN,
            "severity": "warning",
            "message": message,
            "evidence": {},
        }
        for (recording, channel), message in sorted(wanted.items())
        if (recording, channel) not in present
    ]
    store.add_rows(session, QualityFinding, rows)
