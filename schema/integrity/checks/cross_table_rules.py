"""Rows that belong together agree: what no key of the database can say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, case, exists, func, or_, select

from ...campaign_counts import CampaignCounts
from ...campaigns import Campaign, ConfigurationLevel, FactorLevel
from ...impacts import Impact, Pulse, Shot
from ...recordings import QualityFinding, RecordedChannel, Recording
from ..findings import COUNT_ANEW, RESTORE, IntegrityFinding, Query, Scope

#: Rows of one rule that are named.
_MOST = 20


@dataclass(frozen=True)
class CrossTableRule:
    """Rows that break a rule: the query's labels say where they are. `campaign` holds the
    campaign's key."""

    message: str
    query: Query
    campaign: Any
    advice: str = RESTORE


_OF_RECORDING = (Campaign.name.label("campaign"), Recording.path.label("recording"))
_OF_IMPACT = (Campaign.name.label("campaign"), Impact.run, Impact.repetition)
_OF_SHOT = (Campaign.name.label("campaign"), Shot.run, Shot.repetition)
_channels = exists().where(RecordedChannel.recording_id == Recording.id)
_hits = or_(
    exists().where(Impact.recording_id == Recording.id),
    exists().where(Shot.recording_id == Recording.id),
)
_recordings = select(*_OF_RECORDING).join(Campaign, Recording.campaign_id == Campaign.id)
_impacts = select(*_OF_IMPACT).join(Campaign, Impact.campaign_id == Campaign.id)
_shots = select(*_OF_SHOT).join(Campaign, Shot.campaign_id == Campaign.id)
_findings = (
    select(*_OF_RECORDING, QualityFinding.check.label("finding"))
    .join(Recording, QualityFinding.recording_id == Recording.id)
    .join(Campaign, Recording.campaign_id == Campaign.id)
)


def _miscounted(table: type[Impact] | type[Shot]) -> CrossTableRule:
    """Campaigns of which another number of impacts or shots is kept than they have."""
    hits, kept_count = table.__tablename__, getattr(CampaignCounts, table.__tablename__)
    counted = (
        select(func.count())
        .where(table.campaign_id == Campaign.id)
        .correlate(Campaign)
        .scalar_subquery()
    )
    columns = (Campaign.name.label("campaign"), kept_count.label("kept"), counted.label("counted"))
    return CrossTableRule(
        f"another number of {hits} is kept than the campaign has",
        select(*columns)
        .join(CampaignCounts, CampaignCounts.campaign_id == Campaign.id)
        .where(kept_count != counted),
        Campaign.id,
        COUNT_ANEW,
    )


RULES = (
    _miscounted(Impact),
    _miscounted(Shot),
    CrossTableRule(
        "a stored recording without any channel",
        _recordings.where(Recording.status == "stored", ~_channels),
        Recording.campaign_id,
    ),
    CrossTableRule(
        "a recording that was set aside has channels, impacts or shots",
        _recordings.where(Recording.status == "set aside", or_(_channels, _hits)),
        Recording.campaign_id,
    ),
    CrossTableRule(
        "an impact has pulses, and not one of them in use",
        _impacts.join(Pulse, Pulse.impact_id == Impact.id)
        .group_by(Campaign.name, Impact.id)
        .having(func.sum(case((Pulse.current, 1), else_=0)) != 1),
        Impact.campaign_id,
        "cut its recording again, which puts one in use: pyroshock extract CAMPAIGN",
    ),
    CrossTableRule(
        "an impact with a recording of another campaign",
        _impacts.join(Recording, Impact.recording_id == Recording.id).where(
            Recording.campaign_id != Impact.campaign_id
        ),
        Impact.campaign_id,
    ),
    CrossTableRule(
        "a shot with a recording of another campaign",
        _shots.join(Recording,
        Shot.recording_id == Recording.id).where(Recording.campaign_id != Shot.campaign_id),
        Shot.campaign_id,
    ),
    CrossTableRule(
        "a shot with an impact of another run",
        _shots.join(Impact, Shot.impact_id == Impact.id).where(
            or_(
                Impact.campaign_id != Shot.campaign_id, Impact.run != Shot.run,
                Impact.repetition != Shot.repetition
            )
        ),
        Shot.campaign_id,
    ),
    CrossTableRule(
        "a finding about a channel of another recording",
        _findings.join(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id).where(
            RecordedChannel.recording_id != QualityFinding.recording_id
        ),
        Recording.campaign_id,
    ),
    CrossTableRule(
        "a finding about an impact of another recording",
        _findings.join(Impact, QualityFinding.impact_id == Impact.id).where(
            or_(Impact.recording_id.is_(None), Impact.recording_id != QualityFinding.recording_id)
        ),
        Recording.campaign_id,
    ),
)  # fmt: skip


def check_belonging(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Rows that break a rule of `RULES`, and levels under the wrong factor.

    A planned run that is done needs no recorded one: it may have been ticked at the bench.
    """
    for rule in RULES:
        for row in connection.execute(
            scope.within(rule.query, rule.campaign).limit(_MOST)
        ).mappings():
            yield IntegrityFinding("counts", rule.message, rule.advice, dict(row))
    if scope.campaign is None:
        yield from _misplaced_levels(connection)


def _misplaced_levels(connection: Connection) -> Iterator[IntegrityFinding]:
    query = (
        select(ConfigurationLevel.configuration_id)
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .where(FactorLevel.factor_id != ConfigurationLevel.factor_id)
    )
    for key in connection.scalars(query.limit(_MOST)):
        place = {"table": "configuration_levels", "row": key}
        yield IntegrityFinding(
            "counts",
            "a configuration has a level under another factor than the level's own",
            RESTORE,
            place,
        )
