"""A campaign as a report: what was planned and recorded, how good it is, what the pulses and the shots are."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Shot
from ...schema.listings import get_campaign_id
from ...schema.recordings import Recording
from .campaign_design import coverage_section, plans_of, settings_section, status_counts
from .campaign_pulses import pulses_section
from .campaign_quality import quality_section
from .campaign_settings import achieved_settings
from .campaign_shots import shots_of, shots_section
from .document import Document
from .pulse_groups import pulses_of


def campaign_document(session: Session, name: str) -> Document:
    """The report on a campaign of the store. Raises `LookupError` naming those there are."""
    campaign = session.get_one(Campaign, get_campaign_id(session, name))
    recordings, impacts, shots = (_count(session, table, campaign.id) for table in (Recording, Impact, Shot))
    plans = plans_of(session, campaign)
    sections = [
        coverage_section(plans),
        settings_section(achieved_settings(session, campaign, plans)),
        *([pulses_section(pulses_of(session, name))] if impacts else []),
        quality_section(session, campaign.id),
        *([shots_section(shots_of(session, name))] if shots else []),
    ]
    states = [status_counts(plan) for plan in plans]
    runs = ", ".join(f"{sum(plan[state] for plan in states)} {word}" for state, word in _STATES) if plans else "none"
    facts = {
        "Kind": campaign.kind,
        "Date": campaign.date.isoformat(),
        "Operator": campaign.operator or "",
        "Planned runs": runs,
        "Recordings": str(recordings or ""),
        "Impacts": str(impacts or ""),
        "Shots": str(shots or ""),
    }
    return Document(
        kind="Campaign",
        title=name,
        lead=campaign.description or "",
        facts={key: value for key, value in facts.items() if value},
        sections=sections,
        date=campaign.date,
    )


_STATES = (("done", "done"), ("planned", "to do"), ("discarded", "discarded"))


def _count(session: Session, table: type[Recording] | type[Impact] | type[Shot], campaign_id: int) -> int:
    return session.scalar(select(func.count()).select_from(table).where(table.campaign_id == campaign_id)) or 0
