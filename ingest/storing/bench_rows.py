"""The rows of a campaign and of the parts of its bench, added where the store lacks them, within a
transaction that the caller holds."""

from __future__ import annotations

from typing import Any, TypeVar

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from ...schema.benches import Gun, Hammer, ModalTable, Mode, ModeShape, Plate, material_id
from ...schema.campaigns import Campaign
from ...schema.known_facts import facts_to_json
from ...schema.transactions import add_or_get, fingerprint_of, get_or_add
from ..folder.campaign_file import BenchParts, CampaignFile, PlatePart
from ..folder.modal_table import ModalTableFile
from .bench_changes import refuse_other_campaign

Part = TypeVar("Part", Gun, Hammer)


_BY_NAME = select(Campaign).where(Campaign.name == bindparam("name"))


def campaign_row(session: Session, file: CampaignFile, modes: ModalTableFile | None) -> Campaign:
    """The campaign and its bench, added on first sight. Raises `IngestError` when another folder
    has the name."""
    campaign = session.scalars(_BY_NAME, {"name": file.name}).one_or_none()
    row = campaign or add_or_get(
        session, Campaign, {"name": file.name}, campaign_values(session, file, modes)
    )
    refuse_other_campaign(session, row, file)
    return row


def campaign_values(
    session: Session, file: CampaignFile, modes: ModalTableFile | None
) -> dict[str, Any]:
    """The campaign's row, with the parts of its bench, which are added on first sight."""
    return {
        "kind": file.kind,
        "date": file.date,
        "description": file.description,
        "operator": file.operator,
        "fingerprint": file.fingerprint,
        "gun_id": _part(session, Gun, vars(file.gun)).id if file.gun else None,
        "hammer_id": _part(session, Hammer, vars(file.hammer)).id if file.hammer else None,
        "plate_id": _plate(session, file.plate, modes).id if file.plate else None,
        "known_facts": facts_to_json(file.known_facts) if file.known_facts else None,
    }


def bench_keys(
    session: Session, bench: BenchParts, modal_table: tuple[int, str] | None
) -> dict[str, int | None]:
    """Keys of the parts of a bench, which are added on first sight.

    Parameters:
        session: A session that writes to the store.
        bench: The parts.
        modal_table: Key and fingerprint of the modal table that a stored plate has; None of a plate
            without one.
    """
    gun, hammer, plate = bench["gun"], bench["hammer"], bench["plate"]
    assert plate is None or isinstance(plate, PlatePart)
    return {
        "gun_id": _part(session, Gun, vars(gun)).id if gun else None,
        "hammer_id": _part(session, Hammer, vars(hammer)).id if hammer else None,
        "plate_id": _plate_row(session, plate, modal_table).id if plate else None,
    }


def _part(session: Session, model: type[Part], content: dict[str, float]) -> Part:
    return get_or_add(session, model, {"fingerprint": fingerprint_of(content)}, content)


def _plate(session: Session, part: PlatePart, modes: ModalTableFile | None) -> Plate:
    table = _modal_table(session, modes) if modes else None
    return _plate_row(session, part, (table.id, table.fingerprint) if table else None)


def _plate_row(session: Session, part: PlatePart, modal_table: tuple[int, str] | None) -> Plate:
    table_id, table_fingerprint = modal_table or (None, None)
    outline = [list(corner) for corner in part.outline_m] if part.outline_m else None
    values: dict[str, Any] = {
        "modal_table_id": table_id,
        "material_id": material_id(session, part.material) if part.material else None,
        "thickness_m": part.thickness_m,
        "outline_m": outline,
    }
    content = [table_fingerprint, part.material, part.thickness_m, outline]
    return get_or_add(session, Plate, {"fingerprint": fingerprint_of(content)}, values)


def _modal_table(session: Session, file: ModalTableFile) -> ModalTable:
    modes = [
        Mode(
            number=mode.mode,
            frequency_hz=mode.frequency_hz,
            damping_ratio=mode.damping_ratio,
            shape_impact_per_sqrt_kg=mode.shape_impact,
            shapes=[
                ModeShape(channel=name, shape_per_sqrt_kg=value)
                for name, value in mode.shapes.items()
            ],
        )
        for mode in file.modes
    ]
    return get_or_add(session, ModalTable, {"fingerprint": file.fingerprint}, {"modes": modes})
