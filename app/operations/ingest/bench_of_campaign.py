"""The bench and the channels of a stored campaign, for another campaign on the same bench."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from ....ingest.folder.description import CampaignDescription
from ....ingest.storing.stated_bench import stated_bench
from ....schema.campaigns import Campaign
from ....schema.conditions import get_campaign_id
from ....schema.recordings import RecordedChannel, Recording

_CHANNEL = ("quantity", "unit", "sensitivity", "offset_v", "position", "axis")


def bench_of_campaign(session: Session, name: str) -> CampaignDescription:
    """What campaign.toml would state of the bench and the channels of a stored campaign. A modal
    table and the points of a calibration are files of that campaign, and are left out.

    Parameters:
        session: A session of the store.
        name: The name of the campaign.

    Raises:
        LookupError: Where there is no such campaign.
    """
    row = session.get_one(Campaign, get_campaign_id(session, name))
    bench = stated_bench(session, row)
    if "material" not in bench.get("plate", {}):  # of a modal table, which is a file
        bench.pop("plate", None)
    columns = [getattr(RecordedChannel, key) for key in _CHANNEL]
    query = (
        select(RecordedChannel.name, RecordedChannel.full_scale, *columns)
        .join(Recording)
        .where(Recording.campaign_id == row.id)
        .order_by(RecordedChannel.id)
    )
    channels: dict[str, dict[str, Any]] = {}
    for channel, full_scale, *values in session.execute(query.limit(1000)):
        facts = dict(zip(_CHANNEL, values, strict=True)) | {"range": full_scale}
        channels.setdefault(
            channel, {key: value for key, value in facts.items() if value not in (None, 0.0)}
        )
    return CampaignDescription({"bench": bench, "channels": channels})


def with_bench(
    description: CampaignDescription, other: CampaignDescription, kind: str
) -> CampaignDescription:
    """A description with the parts of another bench in the place of what it lacks; what it states
    stays.

    Parameters:
        description: The description that is filled in.
        other: The bench and the channels of another campaign.
        kind: The kind of the campaign, which has a gun or a hammer or neither.
    """
    of_kind = {"gun": ("gun", "plate"), "hammer": ("hammer", "plate")}.get(kind, ("plate",))
    taken = {k: part for k, part in (other.value("bench") or {}).items() if k in of_kind}
    bench = _filled(taken, description.value("bench") or {})
    own_channels = description.value("channels") or {}
    channels = {
        name: _filled((other.value("channels") or {}).get(name, {}), facts)
        if _same_quantity(facts, (other.value("channels") or {}).get(name, {}))
        else facts
        for name, facts in own_channels.items()
    }
    tables = {**description.tables, "bench": bench, "channels": channels}
    return CampaignDescription(
        {key: value for key, value in tables.items() if value},
        description.columns,
        description.rows,
    )


def _same_quantity(facts: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return facts.get("quantity") in (None, other.get("quantity"))


def _filled(usual: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Values of `own`, and of `usual` where it has none; tables within likewise."""
    filled = dict(usual)
    for key, value in own.items():
        nested = isinstance(value, Mapping) and isinstance(filled.get(key), Mapping)
        filled[key] = _filled(filled[key], value) if nested else value
    return filled
