"""Kind, date and bench of a stored campaign beside those of a folder: every fact that differs, with both values."""

from __future__ import annotations

from dataclasses import fields

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.benches import Mode, Plate
from ..schema.campaigns import Campaign
from ..schema.materials import Material
from .folder import CampaignFile, GunPart, HammerPart, PlatePart
from .modes import ModalTableFile
from .printable import difference, shown


def bench_differences(session: Session, row: Campaign, file: CampaignFile) -> list[tuple[str, str | None, str | None]]:
    """What of `campaign.toml` differs from the stored campaign: ("campaign.date", given, stored); None: not given."""
    values: list[tuple[str, object, object]] = [
        ("campaign.kind", file.kind, row.kind),
        ("campaign.date", file.date, row.date),
    ]
    for stage, part, kind, stored in (
        ("gun", file.gun, GunPart, row.gun),
        ("hammer", file.hammer, HammerPart, row.hammer),
    ):
        names = [item.name for item in fields(kind)]
        values += [(f"bench.{stage}.{key}", getattr(part, key, None), getattr(stored, key, None)) for key in names]
    values += _plate(session, file.plate, row.plate)
    return [(key, _text(given), _text(stored)) for key, given, stored in values if given != stored]


def mode_changes(session: Session, table: int, modes: ModalTableFile) -> list[str]:
    """What of a modal table differs from the stored one with key `table`: the first mode that does, value by value."""
    stored = {mode.number: mode for mode in session.scalars(select(Mode).where(Mode.table_id == table))}
    given = {mode.mode: mode for mode in modes.modes}
    for number in sorted({*stored, *given}):
        if number not in stored or number not in given:
            there = ("in the folder", "not in the store") if number in given else ("not in the folder", "in the store")
            return [f"mode {number} is {there[0]}, {there[1]}"]
        given_value, other = given[number], stored[number]
        pairs: list[tuple[str, float | None, float | None]] = [
            ("frequency_hz", given_value.frequency_hz, other.frequency_hz),
            ("damping_ratio", given_value.damping_ratio, other.damping_ratio),
            ("shape_impact", given_value.shape_impact, other.shape_impact_per_sqrt_kg),
        ]
        shapes = {shape.channel: shape.shape_per_sqrt_kg for shape in other.shapes}
        names = sorted({*given_value.shapes, *shapes})
        pairs += [(f"shape_{name}", given_value.shapes.get(name), shapes.get(name)) for name in names]
        changes = [difference(f"mode {number}: {key}", _text(a), _text(b)) for key, a, b in pairs if a != b]
        if changes:
            return changes
    return ["its modes stand in another order"]


def _plate(session: Session, part: PlatePart | None, row: Plate | None) -> list[tuple[str, object, object]]:
    material = session.scalar(select(Material.name).where(Material.id == row.material_id)) if row else None
    outline = [list(corner) for corner in part.outline_m] if part and part.outline_m else None
    modes = part.modes if part else None
    stored_modes = None if row is None or row.modal_table_id is None else modes or "a modal table"
    return [
        ("bench.plate.material", part and part.material, material),
        ("bench.plate.thickness_m", part and part.thickness_m, row and row.thickness_m),
        ("bench.plate.outline_m", outline, row and row.outline_m),
        ("bench.plate.modes", modes, stored_modes),  # not its file's name, but that there is one is stored
    ]


def _text(value: object) -> str | None:
    if value is None:
        return None
    return shown(value) if isinstance(value, str | float | list) else str(value)
