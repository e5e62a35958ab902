"""Pulses of a filter, thinned evenly in the database: what a picture of very many can show."""

from __future__ import annotations

from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from .conditions import IMPACT_COLUMNS, IN_USE, LARGEST, Condition, restricted
from .impacts import ChannelFigures, Impact, Pulse


def list_pulse_keys(
    session: Session, campaign: str | None, where: tuple[Condition, ...], most: int
) -> tuple[list[int], int]:
    """Keys of the pulses in use of the impacts that match, at most `most`, and how many match.

    Where there are more, the database takes them evenly over the order of impacts, the first one included. Raises as
    `iter_impacts`, and `ValueError` for fewer than one.
    """
    if most < 1:
        raise ValueError(f"most is {most!r}; expected 1 or more pulses")
    columns: tuple[Any, ...] = (Pulse.id, Impact.id.label("impact"))
    query = select(*columns).select_from(Impact)
    query = query.join(Pulse, IN_USE).outerjoin(ChannelFigures, LARGEST)
    query, span = restricted(session, query, Impact, IMPACT_COLUMNS, campaign, where)
    query = query.where(Impact.id.between(span.first, span.last))
    # No more than fit between the first key and the last: a small store need not count.
    fits = span.last - span.first < most
    total = 0 if fits else session.scalar(query.with_only_columns(func.count())) or 0
    if total <= most:
        keys = list(session.scalars(query.order_by(Impact.id)))
        return keys, len(keys)
    numbered = query.add_columns((func.row_number().over(order_by=Impact.id) - 1).label("place")).subquery()
    # Of `total` places these are as many as wanted: those where place * most / total has just passed a whole number.
    chosen = select(numbered.c.id).where(numbered.c.place * most % total < most)
    return list(session.scalars(chosen.order_by(numbered.c.impact).limit(most))), total
