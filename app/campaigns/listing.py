"""Campaigns page by page, filtered and counted in the database: the newest first."""

from __future__ import annotations

from typing import Any

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.impacts import Impact, Shot
from ...schema.listings import list_plan_counts

KINDS = ("gun", "hammer")


def list_campaigns_page(
    session: Session, *, kind: str | None = None, text: str = "", after: str | None = None, limit: int = 50
) -> tuple[list[dict[str, Any]], str | None]:
    """At most `limit` campaigns beyond the one named `after`, and the name that the next page goes on from.

    Rows as `list_campaigns`; `kind` and a `text` within the name (letters' case does not count) narrow them. That name
    is None on the last page. Raises `ValueError` for another kind, `LookupError` for an unknown `after`.
    """
    if kind is not None and kind not in KINDS:
        raise ValueError(f"kind is {kind!r}; expected one of {', '.join(KINDS)}")
    query = select(Campaign.id, Campaign.name, Campaign.kind, Campaign.date)
    if kind is not None:
        query = query.where(Campaign.kind == kind)
    if text:
        query = query.where(func.lower(Campaign.name).contains(text.lower(), autoescape=True))
    if after is not None:
        query = query.where(_beyond(session, after))
    campaigns = session.execute(query.order_by(Campaign.date.desc(), Campaign.name).limit(limit + 1)).all()
    shown = campaigns[:limit]
    keys = [key for key, *_ in shown]
    impacts, shots = (_counts(session, table, keys) for table in (Impact, Shot))
    plans = list_plan_counts(session, keys)
    rows = [
        {
            "name": name,
            "kind": of,
            "date": date.isoformat(),
            "impacts": impacts.get(key, 0),
            "shots": shots.get(key, 0),
            "planned": plans.get(key, (0, 0))[0],
            "done": plans.get(key, (0, 0))[1],
        }
        for key, name, of, date in shown
    ]
    return rows, shown[-1].name if len(campaigns) > limit else None


def _beyond(session: Session, name: str) -> ColumnElement[bool]:
    date = session.scalar(select(Campaign.date).where(Campaign.name == name))
    if date is None:
        raise LookupError(f"no campaign {name!r} to go on from; begin at the first page")
    return or_(Campaign.date < date, and_(Campaign.date == date, Campaign.name > name))


def _counts(session: Session, table: type[Impact] | type[Shot], keys: list[int]) -> dict[int, int]:
    query = select(table.campaign_id, func.count()).where(table.campaign_id.in_(keys)).group_by(table.campaign_id)
    return dict(iter(session.execute(query)))
