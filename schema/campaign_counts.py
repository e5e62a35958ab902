"""How many impacts and shots each campaign has, kept beside them: counting a million of them anew
reads an entry of an index for each.

Whoever adds or removes impacts or shots tells it here in the same transaction (`count_added`). A
campaign without a row, as in an exported file, is counted when its numbers are asked for. `db
check` compares what is kept with a count, and `db upgrade` counts anew (`recount`).
"""

from __future__ import annotations

from collections.abc import Collection
from typing import cast

from sqlalchemy import Connection, ForeignKey, Table, bindparam, func, insert, select, update
from sqlalchemy.orm import Mapped, Session, mapped_column

from .base import Base, in_batches
from .campaigns import Campaign
from .impacts import Impact, Shot
from .row_hashes import ROW_SHA256, row_hash

#: Impacts and shots.
Hits = tuple[int, int]


class CampaignCounts(Base):
    """The numbers of impacts and shots of a campaign, as the last transaction that changed them
    left them."""

    __tablename__ = "campaign_counts"

    campaign_id: Mapped[int] = mapped_column(
        ForeignKey("campaigns.id", ondelete="CASCADE"), primary_key=True, autoincrement=False
    )
    impacts: Mapped[int]
    shots: Mapped[int]


_COUNTS, _campaigns = (cast("Table", of.__table__) for of in (CampaignCounts, Campaign))
_KEPT = select(_COUNTS.c.campaign_id, _COUNTS.c.impacts, _COUNTS.c.shots)
_KEPT_OF_ONE = _KEPT.where(_COUNTS.c.campaign_id == bindparam("campaign")).with_for_update()
_CHANGED = update(_COUNTS).where(_COUNTS.c.campaign_id == bindparam("campaign"))
#: Of every campaign; NULL where nothing is kept.
_KEPT_OF_ALL = select(_campaigns.c.id, _COUNTS.c.impacts, _COUNTS.c.shots).select_from(
    _campaigns.outerjoin(_COUNTS)
)


def hit_counts(session: Session, campaigns: Collection[int] | None = None) -> dict[int, Hits]:
    """Impacts and shots of campaigns.

    Parameters:
        session: A session of the store.
        campaigns: The keys of the campaigns; by default (None) all.

    Returns:
        The numbers of impacts and of shots by the campaign's key.
    """
    connection, query = session.connection(), _KEPT_OF_ALL
    if campaigns is not None:
        query = query.where(_campaigns.c.id.in_(campaigns))
    rows = connection.execute(query).all()
    kept_hits = {key: (impacts, shots) for key, impacts, shots in rows}
    uncounted = [key for key, impacts, _ in rows if impacts is None]
    return kept_hits | _counted(connection, uncounted) if uncounted else kept_hits


def count_added(connection: Connection, campaign: int, impacts: int, shots: int) -> None:
    """Take up in a campaign's kept numbers what the open transaction has changed. Call it late: on
    a server, others who add to the campaign wait from here until the transaction ends.

    Parameters:
        connection: The connection of the transaction, which has written the rows.
        campaign: The key of the campaign.
        impacts: How many impacts were added; a negative number of them was removed.
        shots: How many shots were added, likewise.
    """
    if not impacts and not shots:
        return
    # The row is locked before it is read: two processes that add to the campaign count both.
    kept_row = connection.execute(_KEPT_OF_ONE, {"campaign": campaign}).one_or_none()
    if kept_row is None:
        _keep(connection, campaign, _counted(connection, [campaign])[campaign], is_new=True)
    else:
        _keep(
            connection, campaign, (kept_row.impacts + impacts, kept_row.shots + shots), is_new=False
        )


def recount(session: Session) -> None:
    """Count the impacts and shots of every campaign, and keep these numbers.

    Parameters:
        session: A session that writes to the store.
    """
    connection = session.connection()
    # Locked before anything is counted: what others add meanwhile, they add to these numbers.
    rows = connection.execute(_KEPT.order_by(_COUNTS.c.campaign_id).with_for_update()).all()
    kept_campaigns = {row.campaign_id for row in rows}
    campaigns = session.scalars(select(Campaign.id).order_by(Campaign.id)).all()
    for campaign, counts in _counted(connection, campaigns).items():
        _keep(connection, campaign, counts, is_new=campaign not in kept_campaigns)


def _keep(connection: Connection, campaign: int, counts: Hits, *, is_new: bool) -> None:
    row = {"campaign_id": campaign, "impacts": counts[0], "shots": counts[1]}
    row_values = {**row, ROW_SHA256: row_hash(_COUNTS, row)}
    if is_new:
        connection.execute(insert(_COUNTS), row_values)
    else:
        connection.execute(_CHANGED, {**row_values, "campaign": campaign})


def _counted(connection: Connection, campaigns: Collection[int]) -> dict[int, Hits]:
    """Impacts and shots of these campaigns, of their rows."""
    counts: list[dict[int, int]] = []
    for table in (Impact, Shot):
        of_table: dict[int, int] = {}
        for keys in in_batches(list(campaigns)):
            query = select(table.campaign_id, func.count()).where(table.campaign_id.in_(keys))
            of_table |= dict(iter(connection.execute(query.group_by(table.campaign_id))))
        counts.append(of_table)
    impacts, shots = counts
    return {key: (impacts.get(key, 0), shots.get(key, 0)) for key in campaigns}
