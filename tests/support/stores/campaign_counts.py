"""The kept numbers of impacts and shots against a count of the rows."""

from __future__ import annotations

from pyroshock.schema.campaign_counts import CampaignCounts
from pyroshock.schema.impacts import Impact, Shot
from sqlalchemy import func, select
from sqlalchemy.orm import Session


def assert_counts_kept(session: Session) -> None:
    """Every campaign with impacts or shots has a row of its own numbers, and none other is kept
    wrongly."""
    impacts, shots = (
        dict(
            iter(
                session.execute(select(table.campaign_id, func.count()).group_by(table.campaign_id))
            )
        )
        for table in (Impact, Shot)
    )
    columns = (CampaignCounts.campaign_id, CampaignCounts.impacts, CampaignCounts.shots)
    kept_hits = {key: (i, s) for key, i, s in session.execute(select(*columns))}
    assert kept_hits == {key: (impacts.get(key, 0), shots.get(key, 0)) for key in kept_hits}
    assert set(kept_hits) >= {*impacts, *shots}
