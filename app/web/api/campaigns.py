"""Campaigns: listed page by page, and one with all that its page shows."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Query

from ...campaigns.listing import list_campaigns_page
from ...campaigns.overview import campaign_overview
from ...finite import finite
from ..dependencies import Name, OpenStore

router = APIRouter(tags=["campaigns"])


@router.get("/campaigns")
def campaigns(
    store: OpenStore,
    kind: Literal["gun", "hammer"] | None = None,
    name: str = "",
    after: str | None = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 100,
) -> list[dict[str, Any]]:
    """Campaigns, the newest first; the next page begins `after` the last name of this one."""
    with store.reading() as session:
        return list_campaigns_page(session, kind=kind, text=name, after=after, limit=limit)[0]


@router.get("/campaigns/{name}")
def campaign(name: Name, store: OpenStore) -> Any:
    """Design coverage, achieved against planned settings, findings, first impacts and shots."""
    with store.reading() as session:
        return finite(campaign_overview(session, name))
