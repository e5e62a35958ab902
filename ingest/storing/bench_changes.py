"""What `campaign.toml` says otherwise than the stored campaign: kind, date, bench, modal table,
known facts and channels. What the store lacks is an addition; what differs is refused."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.benches import Material, ModalTable, Mode, Plate
from ...schema.campaigns import Campaign
from ...schema.corrected_facts import StoredCorrection, list_corrections
from ...schema.known_facts import KnownFact, facts_from_json
from ...schema.recordings import RecordedChannel, Recording
from ...signals.calibration import Calibration
from ...signals.channel import Sensor
from ..errors import IngestError, difference, printable
from ..folder.campaign_file import FILE, CampaignFile, GunPart, HammerPart, PlatePart
from ..folder.modal_table import ModalTableFile
from .stored_channels import calibration_of


def refuse_other_campaign(session: Session, row: Campaign, file: CampaignFile) -> None:
    """Raise `IngestError`, with both values, when a stored campaign of this name has another kind,
    date, bench or known fact."""
    if row.fingerprint == file.fingerprint:
        return
    differences = bench_differences(session, row, file)
    corrections = list_corrections(session, [row.name])
    if corrections and not differences:
        return  # its fingerprint was made anew, without the name of the modal table's file
    changes = [fact for fact in differences if fact[2] is not None] or differences
    words = (
        "; ".join(difference(*fact) for fact in changes)
        or "the name of the modal table's file is another"
    )
    raise IngestError(
        f"campaign.toml: campaign {file.name!r} is in the store with another kind, date, bench or "
        f"known fact: {words}{corrected_words(corrections, [name for name, _, _ in changes])}; "
        "restore the stored values, or give this campaign another name"
    )


def corrected_words(corrections: Sequence[StoredCorrection], names: Sequence[str]) -> str:
    """Why the store says otherwise than a folder, where it was corrected: behind what differs.

    Parameters:
        corrections: Those of the campaign, the newest first.
        names: Names of the facts that differ.
    """
    by_fact = {item.fact: item for item in reversed(corrections)}
    words = [
        f"{name} was corrected in the store on {by_fact[name].corrected_at:%Y-%m-%d} "
        f"({by_fact[name].reason})"
        for name in names
        if name in by_fact
    ]
    return f"; {', '.join(words)}" if words else ""


def bench_additions(session: Session, row: Campaign, file: CampaignFile) -> list[str]:
    """Facts of the bench that `campaign.toml` has and the stored campaign lacks, of `[known]` too:
    "bench.hammer.mass_kg = 0.32".

    Raises `IngestError` as `refuse_other_campaign` where anything that is stored differs.
    """
    if row.fingerprint == file.fingerprint:
        return []
    differences = bench_differences(session, row, file)
    if not differences and list_corrections(session, [row.name]):
        return []
    if not differences or any(stored is not None for _, _, stored in differences):
        refuse_other_campaign(session, row, file)
    return [f"{name} = {given}" for name, given, _ in differences]


def bench_differences(
    session: Session, row: Campaign, file: CampaignFile
) -> list[tuple[str, str | None, str | None]]:
    """What of `campaign.toml` differs from the stored campaign: ("campaign.date", given, stored);
    None: not given."""
    values: list[tuple[str, object, object]] = [
        ("campaign.kind", file.kind, row.kind),
        ("campaign.date", file.date, row.date),
    ]
    for stage, part, kind, stored in (
        ("gun", file.gun, GunPart, row.gun),
        ("hammer", file.hammer, HammerPart, row.hammer),
    ):
        names = [item.name for item in fields(kind)]
        values += [
            (f"bench.{stage}.{key}", getattr(part, key, None), getattr(stored, key, None))
            for key in names
        ]
    values += _plate(session, file.plate, row.plate)
    values += _known_facts(file, row)
    return [
        (key, _cell_text(given), _cell_text(stored))
        for key, given, stored in values
        if given != stored
    ]


def mode_changes(session: Session, table: int, modes: ModalTableFile) -> list[str]:
    """What of a modal table differs from the stored one with key `table`: the first mode that does,
    value by value."""
    stored = {
        mode.number: mode for mode in session.scalars(select(Mode).where(Mode.table_id == table))
    }
    given = {mode.mode: mode for mode in modes.modes}
    for number in sorted({*stored, *given}):
        if number not in stored or number not in given:
            there = (
                ("in the folder", "not in the store")
                if number in given
                else ("not in the folder", "in the store")
            )
            return [f"mode {number} is {there[0]}, {there[1]}"]
        given_value, other = given[number], stored[number]
        pairs: list[tuple[str, float | None, float | None]] = [
            ("frequency_hz", given_value.frequency_hz, other.frequency_hz),
            ("damping_ratio", given_value.damping_ratio, other.damping_ratio),
            ("shape_impact", given_value.shape_impact, other.shape_impact_per_sqrt_kg),
        ]
        shapes = {shape.channel: shape.shape_per_sqrt_kg for shape in other.shapes}
        names = sorted({*given_value.shapes, *shapes})
        pairs += [
            (f"shape_{name}", given_value.shapes.get(name), shapes.get(name)) for name in names
        ]
        changes = [
            difference(f"mode {number}: {key}", _cell_text(a), _cell_text(b))
            for key, a, b in pairs
            if a != b
        ]
        if changes:
            return changes
    return ["its modes stand in another order"]


def _plate(
    session: Session, part: PlatePart | None, row: Plate | None
) -> list[tuple[str, object, object]]:
    material = (
        session.scalar(select(Material.name).where(Material.id == row.material_id)) if row else None
    )
    outline = [list(corner) for corner in part.outline_m] if part and part.outline_m else None
    modes = part.modes if part else None
    stored_modes = None if row is None or row.modal_table_id is None else modes or "a modal table"
    return [
        ("bench.plate.material", part and part.material, material),
        ("bench.plate.thickness_m", part and part.thickness_m, row and row.thickness_m),
        ("bench.plate.outline_m", outline, row and row.outline_m),
        (
            "bench.plate.modes",
            modes,
            stored_modes,
        ),  # not its file's name, but that there is one is stored
    ]


def _known_facts(file: CampaignFile, row: Campaign) -> list[tuple[str, object, object]]:
    stated_facts = {fact.name: fact for fact in file.known_facts}
    stored = {fact.name: fact for fact in facts_from_json(row.known_facts)}
    return [
        (f"known.{name}", stated_facts.get(name), stored.get(name))
        for name in sorted({*stated_facts, *stored})
    ]


def _cell_text(value: object) -> str | None:
    if value is None:
        return None
    if isinstance(value, KnownFact):
        return value.words
    return printable(value) if isinstance(value, str | float | list) else str(value)


def refuse_other_modes(session: Session, campaign: Campaign, modes: ModalTableFile | None) -> None:
    """Raise `IngestError`, with both values, when the stored plate of the campaign has another
    modal table."""
    query = select(ModalTable.id, ModalTable.fingerprint).join(
        Plate, Plate.modal_table_id == ModalTable.id
    )
    plate_row = session.execute(query.where(Plate.id == campaign.plate_id)).one_or_none()
    if modes is not None and plate_row is not None and plate_row.fingerprint != modes.fingerprint:
        changes = "; ".join(mode_changes(session, plate_row.id, modes))
        raise IngestError(
            f"campaign.toml: campaign {campaign.name!r} is in the store with another modal table: "
            f"{changes}; restore the stored values, or give this campaign another name"
        )


@dataclass(frozen=True)
class StoredCalibration:
    """A channel's calibration as the store has it; `full_scale` in `unit`."""

    name: str
    quantity: str
    unit: str
    sensitivity: float | None
    offset_v: float | None
    position: str | None
    axis: str | None
    full_scale: float | None
    si_gain: float
    si_offset: float


def refuse_changed_channels(session: Session, campaign: Campaign, file: CampaignFile) -> None:
    """Raise `IngestError` where `[channels]` gives a stored channel another meaning, with both
    values of each change.

    Another meaning is another quantity, conversion to SI, full scale, position or axis; the same
    meaning may be written otherwise (10 kN for 10,000 N). Force channels are summed, so that one
    more or less is a change too.
    """
    columns = (getattr(RecordedChannel, item.name) for item in fields(StoredCalibration))
    query = select(*columns).join(Recording).where(Recording.campaign_id == campaign.id).distinct()
    stored = [StoredCalibration(*row) for row in session.execute(query)]
    changes = [
        change
        for row in sorted(stored, key=lambda row: row.name)
        if row.name in file.sensors
        for change in _changes(file.sensors[row.name], row)
    ]
    changes += _other_forces(file, stored)
    changes += _other_calibrations(session, campaign, file)
    if changes:
        listed = "; ".join(dict.fromkeys(changes))
        raise IngestError(
            f"{FILE}: {listed}: later figures of campaign {campaign.name!r} would not mean what "
            "the stored ones do; restore the stored values, or give this campaign another name"
        )


def _changes(sensor: Sensor, row: StoredCalibration) -> list[str]:
    pairs: list[tuple[str, object, object]] = []
    if sensor.quantity != row.quantity:
        pairs.append(("quantity", sensor.quantity, row.quantity))
    if not _close(sensor.conversion, (row.si_gain, row.si_offset)):
        offset = sensor.offset_v if sensor.sensitivity is not None else None
        pairs += [
            ("unit", sensor.unit, row.unit),
            ("sensitivity", sensor.sensitivity, row.sensitivity),
            ("offset_v", offset or None, row.offset_v or None),
        ]
    if not _close((sensor.range_si or 0.0,), (_full_scale_si(row),)):
        pairs.append(("range", sensor.range, row.full_scale))
    pairs += [
        (key, getattr(sensor, key), getattr(row, key))
        for key in ("position", "axis")
        if _other(sensor, row, key)
    ]
    return [
        difference(f"channels.{row.name}.{key}", _text(given), _text(stored))
        for key, given, stored in pairs
        if given != stored
    ]


def _other_calibrations(session: Session, campaign: Campaign, file: CampaignFile) -> list[str]:
    """Where points, date or uncertainty of a calibration are others, or it came or went."""
    query = select(RecordedChannel.name, RecordedChannel.header).join(Recording)
    volts = query.where(
        Recording.campaign_id == campaign.id, RecordedChannel.sensitivity.is_not(None)
    )
    changes = []
    for name, header in session.execute(volts):
        if name not in file.sensors:
            continue
        given, there = (
            _calibration(file.sensors[name].calibration),
            _calibration(calibration_of(header)),
        )
        if given != there:
            changes.append(difference(f"channels.{name}.calibration", given, there))
    return changes


def _calibration(calibration: Calibration | None) -> str | None:
    if calibration is None:
        return None
    line = calibration.line
    return (
        f"{calibration.points} points of {calibration.date} (sensitivity {line.sensitivity:.6g} "
        f"with u {line.sensitivity_u:.2g}, offset {line.offset:.6g} V with u {line.offset_u:.2g}, "
        f"common u {calibration.common_u:g})"
    )


def _other(sensor: Sensor, row: StoredCalibration, key: str) -> bool:
    given, stored = getattr(sensor, key) or "", getattr(row, key) or ""
    return bool(given.strip().casefold() != stored.strip().casefold())


def _full_scale_si(row: StoredCalibration) -> float:
    """Magnitude in SI; 0 where none is stored."""
    gain = row.si_gain * (1.0 if row.sensitivity is None else row.sensitivity)
    return abs((row.full_scale or 0.0) * gain)


def _close(first: tuple[float, ...], second: tuple[float, ...]) -> bool:
    return all(
        math.isclose(a, b, rel_tol=1e-9, abs_tol=0.0) for a, b in zip(first, second, strict=True)
    )


def _text(value: object) -> str | None:
    return None if value is None else printable(value)


def _other_forces(file: CampaignFile, stored: Sequence[StoredCalibration]) -> list[str]:
    given = sorted(sensor.name for sensor in file.sensors.values() if sensor.quantity == "force")
    there = sorted({row.name for row in stored if row.quantity == "force"})
    if not stored or given == there or not set(given) ^ set(there) - {row.name for row in stored}:
        return []
    return [f"force channels are {_names(given)} in {FILE}, {_names(there)} in the store"]


def _names(names: list[str]) -> str:
    return ", ".join(names) or "none"
