"""Campaigns page by page, the newest first, and one as its page shows it: plain data, counted in
the database."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, Integer, and_, case, func, or_, select
from sqlalchemy.orm import Session

from ....dataset.predictors import shipped
from ....dataset.selection import missing_in_campaigns, missing_words
from ....ingest.errors import enumerated
from ....ingest.storing.shot_differences import campaign_differences
from ....schema.benches import Material
from ....schema.campaign_counts import hit_counts
from ....schema.campaigns import Campaign, stated_day
from ....schema.conditions import get_campaign_id
from ....schema.listings import is_tagged, list_impacts_page, list_plan_counts, list_shots_page
from ....schema.recordings import SET_ASIDE, SEVERITIES, QualityFinding, RecordedChannel, Recording
from ....schema.row_hashes import ROW_SHA256
from ...common.nominal_velocity import with_predictions
from .design_coverage import achieved_settings, level_coverage, plan_coverage

#: Rows of the first page of impacts, and recordings that were set aside: a page of people, not of
#: machines.
FIRST_ROWS = 20


def campaign_overview(session: Session, name: str) -> dict[str, Any]:
    """Everything that the page of campaign `name` shows, SI, units in the keys. `LookupError` if
    unknown.

    `campaign`, `counts`, `set_aside` (the first ones, with reasons), `plans` and `levels` (design
    coverage), `achieved` and `achieved_summary` (planned settings against recorded ones),
    `findings` (counted by check and severity), `missing_facts` (what training would miss, a
    sentence), `shot_differences` (by what most shots differ from their rows, sentences),
    `first_impacts`, `first_shots`.
    """
    key = get_campaign_id(session, name)
    row = session.get_one(Campaign, key)
    achieved = achieved_settings(session, key)
    shots, _ = list_shots_page(session, name, (), None, FIRST_ROWS)
    return {
        "campaign": _campaign(session, row),
        "counts": _overview_counts(session, key),
        "set_aside": _set_aside(session, key),
        "plans": plan_coverage(session, key, row.name),
        "levels": level_coverage(session, key, row.name),
        "achieved": achieved.rows,
        "achieved_summary": achieved.summary,
        "findings": count_findings(session, key),
        "missing_facts": missing_facts_words(session, row),
        "shot_differences": _differences(session, row),
        "first_impacts": list_impacts_page(session, name, (), None, FIRST_ROWS)[0],
        "first_shots": list(with_predictions(session, shots)),
    }


def missing_facts_words(session: Session, row: Campaign) -> str:
    """What the predictors that ship for the campaign's kind lack in its stored rows ("8 impacts
    have no tip radius"); empty where nothing is missing."""
    return missing_words(missing_in_campaigns(session, [row.name], shipped(row.kind)))


def missing_facts_of(session: Session, name: str) -> list[str]:
    """What the predictors of the campaign's kind lack, a sentence for each ("8 impacts have no tip
    radius"); empty where nothing is missing.

    Parameters:
        session: A session of the store.
        name: The name of the campaign.
    """
    row = session.get_one(Campaign, get_campaign_id(session, name))
    missing = missing_in_campaigns(session, [row.name], shipped(row.kind))
    return [
        f"{facts.impacts} impact{'s have' if facts.impacts > 1 else ' has'} no "
        f"{', '.join(name.replace('_', ' ') for name in facts.predictors)}."
        for facts in missing
    ]


def _differences(session: Session, row: Campaign) -> list[str]:
    """By what most shots of a gun's campaign differ from their rows."""
    return (
        [finding.message for finding in campaign_differences(session, row.id)]
        if row.kind == "gun"
        else []
    )


def _campaign(session: Session, row: Campaign) -> dict[str, Any]:
    return {
        "name": row.name,
        "kind": row.kind,
        "date": stated_day(row.date),
        "operator": row.operator,
        "description": row.description,
        "bench": _bench(session, row),
        "known": row.known_facts or {},
    }


def _bench(session: Session, row: Campaign) -> dict[str, Any]:
    """The parts that there are, each as its figures."""
    parts: dict[str, Any] = {}
    if row.gun is not None:
        hidden = ("id", "fingerprint", "written_by_id", ROW_SHA256)
        parts["gun"] = {
            c.key: getattr(row.gun, c.key) for c in row.gun.__table__.columns if c.key not in hidden
        }
    if row.hammer is not None:
        parts["hammer"] = {"mass_kg": row.hammer.mass_kg}
    if (plate := row.plate) is not None:
        material = (
            None if plate.material_id is None else session.get_one(Material, plate.material_id).name
        )
        parts["plate"] = {
            "material": material,
            "thickness_m": plate.thickness_m,
            "outline_m": plate.outline_m,
            "measured_modes": plate.modal_table_id is not None,
        }
    return parts


def _overview_counts(session: Session, key: int) -> dict[str, int]:
    impacts, shots = hit_counts(session, [key])[key]
    statuses: dict[str, int] = dict(
        iter(
            session.execute(
                select(Recording.status, func.count())
                .where(Recording.campaign_id == key)
                .group_by(Recording.status)
            )
        )
    )
    return {
        "impacts": impacts,
        "shots": shots,
        "recordings": statuses.get("stored", 0),
        "recordings_set_aside": statuses.get(SET_ASIDE, 0),
    }


def _set_aside(session: Session, key: int) -> list[dict[str, Any]]:
    query = select(Recording.path, Recording.reason).where(
        Recording.campaign_id == key, Recording.status == SET_ASIDE
    )
    return [
        {"recording": path, "reason": reason}
        for path, reason in session.execute(query.order_by(Recording.id).limit(FIRST_ROWS))
    ]


def count_findings(session: Session, campaign_key: int) -> list[dict[str, Any]]:
    """Findings of a campaign by check and severity, the worst first; how many recordings and
    impacts they name, and which channels (a text; None where they are of none)."""
    rank = case(
        {severity: i for i, severity in enumerate(SEVERITIES)}, value=QualityFinding.severity
    )
    query = (
        select(
            QualityFinding.check,
            QualityFinding.severity,
            func.count().label("findings"),
            func.count(QualityFinding.recording_id.distinct()).label("recordings"),
            func.count(QualityFinding.impact_id.distinct()).label("impacts"),
        )
        .join(Recording, QualityFinding.recording_id == Recording.id)
        .where(Recording.campaign_id == campaign_key)
        .group_by(QualityFinding.check, QualityFinding.severity)
        .order_by(rank.cast(Integer).desc(), func.count().desc(), QualityFinding.check)
    )
    named = _channels_named(session, campaign_key)
    return [
        {**row, "channels": named.get((row["check"], row["severity"]))}
        for row in session.execute(query).mappings()
    ]


def _channels_named(session: Session, campaign_key: int) -> dict[tuple[str, str], str]:
    """(check, severity) -> the channels that its findings are of, as a text."""
    query = (
        select(QualityFinding.check, QualityFinding.severity, RecordedChannel.name)
        .join(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .join(Recording, QualityFinding.recording_id == Recording.id)
        .where(Recording.campaign_id == campaign_key)
        .distinct()
        .order_by(RecordedChannel.name)
    )
    names: dict[tuple[str, str], list[str]] = {}
    for check, severity, name in session.execute(query):
        names.setdefault((check, severity), []).append(name)
    return {key: enumerated(labels) for key, labels in names.items()}


KINDS = ("gun", "hammer")


def list_campaigns_page(
    session: Session,
    *,
    kind: str | None = None,
    text: str = "",
    tag: str | None = None,
    after: str | None = None,
    limit: int = 50,
) -> tuple[list[dict[str, Any]], str | None]:
    """At most `limit` campaigns beyond the one named `after`, and the name that the next page goes
    on from.

    Rows as `list_campaigns`; `kind`, a `text` within the name (letters' case does not count) and a
    `tag` narrow them. That name is None on the last page. Raises `ValueError` for another kind,
    `LookupError` for an unknown `after`.
    """
    if kind is not None and kind not in KINDS:
        raise ValueError(f"kind is {kind!r}; expected one of {', '.join(KINDS)}")
    query = select(Campaign.id, Campaign.name, Campaign.kind, Campaign.date)
    if kind is not None:
        query = query.where(Campaign.kind == kind)
    if text:
        query = query.where(func.lower(Campaign.name).contains(text.lower(), autoescape=True))
    if tag is not None:
        query = query.where(is_tagged(tag))
    if after is not None:
        query = query.where(_beyond_plan(session, after))
    campaigns = session.execute(
        query.order_by(Campaign.date.desc(), Campaign.name).limit(limit + 1)
    ).all()
    shown = campaigns[:limit]
    keys = [key for key, *_ in shown]
    hits = hit_counts(session, keys)
    plans = list_plan_counts(session, keys)
    rows = [
        {
            "name": name,
            "kind": of,
            "date": stated_day(date),
            "impacts": hits[key][0],
            "shots": hits[key][1],
            "planned": plans.get(key, (0, 0))[0],
            "done": plans.get(key, (0, 0))[1],
        }
        for key, name, of, date in shown
    ]
    return rows, shown[-1].name if len(campaigns) > limit else None


def _beyond_plan(session: Session, name: str) -> ColumnElement[bool]:
    date = session.scalar(select(Campaign.date).where(Campaign.name == name))
    if date is None:
        raise LookupError(f"no campaign {name!r} to go on from; begin at the first page")
    return or_(Campaign.date < date, and_(Campaign.date == date, Campaign.name > name))
