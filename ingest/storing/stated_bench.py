"""The bench of a stored campaign as `[bench]` of campaign.toml states it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from sqlalchemy.orm import Session

from ...schema.benches import Material
from ...schema.campaigns import Campaign
from ..folder.campaign_file import GunPart


def stated_bench(session: Session, row: Campaign) -> dict[str, dict[str, Any]]:
    """The tables gun, hammer and plate with what is stated; a modal table, which is a file, is left
    out.

    Parameters:
        session: A session of the store.
        row: The campaign.
    """
    bench: dict[str, dict[str, Any]] = {}
    if row.gun is not None:
        bench["gun"] = {part.name: getattr(row.gun, part.name) for part in fields(GunPart)}
    if row.hammer is not None:
        bench["hammer"] = {"mass_kg": row.hammer.mass_kg}
    if row.plate is not None:
        key = row.plate.material_id
        plate = {
            "material": None if key is None else session.get_one(Material, key).name,
            "thickness_m": row.plate.thickness_m,
            "outline_m": row.plate.outline_m,
        }
        bench["plate"] = {name: value for name, value in plate.items() if value is not None}
    return bench
