"""What the checks said of a campaign's recordings: how often, and each doubt by itself."""

from __future__ import annotations

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.impacts import Impact
from ...schema.recordings import SET_ASIDE, SEVERITIES, QualityFinding, RecordedChannel, Recording
from ..campaigns.overview import count_findings
from .document import Block, Paragraph, Section, Table

#: Findings that are listed one by one.
_MOST = 100


def quality_section(session: Session, campaign_id: int) -> Section:
    """Findings by check and severity, doubts one by one, recordings that were set aside with their reasons."""
    heads = ("severity", "check", "channels", "findings")
    counts = [[row[head] for head in heads] for row in count_findings(session, campaign_id)]
    blocks: list[Block] = [Table("Findings by check.", heads, counts, "No findings.")]
    doubts = _doubts(session, campaign_id)
    if doubts:
        blocks.append(_listed(doubts[:_MOST]))
    if len(doubts) > _MOST:
        blocks.append(Paragraph(f"The first {_MOST}; pyroshock show IMPACT has those of an impact.", quiet=True))
    if aside := _set_aside(session, campaign_id):
        blocks.append(Table("Recordings that were set aside.", ("recording", "reason"), aside))
    return Section("Quality", blocks)


def _listed(doubts: list[list[Any]]) -> Table:
    """Without the columns that say nothing: most findings are of a whole recording."""
    heads = ("severity", "check", "recording", "run", "repetition", "channel", "message")
    columns = [i for i in range(len(heads)) if any(row[i] is not None for row in doubts)]
    return Table("Rejects and warnings.", [heads[i] for i in columns], [[row[i] for i in columns] for row in doubts])


def _doubts(session: Session, campaign_id: int) -> list[list[Any]]:
    """One more than are listed, rejects first."""
    rows: list[list[Any]] = []
    columns = (Recording.path, Impact.run, Impact.repetition, RecordedChannel.name)
    for severity in reversed(SEVERITIES[1:]):
        query = (
            select(QualityFinding.severity, QualityFinding.check, *columns, QualityFinding.message)
            .join(Recording, QualityFinding.recording_id == Recording.id)
            .outerjoin(Impact, QualityFinding.impact_id == Impact.id)
            .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
            .where(Recording.campaign_id == campaign_id, QualityFinding.severity == severity)
            .order_by(QualityFinding.id)
            .limit(_MOST + 1 - len(rows))
        )
        rows += [list(row) for row in session.execute(query)]
    return rows


def _set_aside(session: Session, campaign_id: int) -> list[list[Any]]:
    query = select(Recording.path, Recording.reason).where(
        Recording.campaign_id == campaign_id, Recording.status == SET_ASIDE
    )
    return [list(row) for row in session.execute(query.order_by(Recording.path))]
