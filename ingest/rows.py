"""From what was read to rows of the store, within a transaction that the caller holds. The lab's
own word on a velocity or pressure goes before what the record gives."""

from __future__ import annotations

from dataclasses import fields
from datetime import UTC, datetime
from typing import Any, TypeVar

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.benches import Gun, Hammer, Material, ModalTable, Mode, ModeShape, Plate, material_id
from ..schema.campaigns import Campaign
from ..schema.impacts import ExtractionSettingsRow as SettingsRow
from ..schema.impacts import Pulse
from ..schema.known_factors import NONE
from ..schema.known_facts import facts_to_json
from ..schema.series import encode
from ..schema.transactions import fingerprint_of, get_or_add
from ..signals.checks.base import Finding
from .errors import IngestError, difference
from .folder import CampaignFile, PlatePart
from .impact_speed import StruckPlate
from .modes import ModalTableFile
from .processing import ProcessedRecording, StoredSeries
from .pulses import ExtractedPulse
from .runs import MatchedImpact, RunRow
from .settings import EXTRACTION_VERSION, ExtractionSettings
from .stored import with_calibration
from .stored_rows import bench_differences, reported_uncertainty

Part = TypeVar("Part", Gun, Hammer)


def campaign_row(session: Session, file: CampaignFile, modes: ModalTableFile | None) -> Campaign:
    """The campaign and its bench, added on first sight. Raises `IngestError` when another folder
    has the name."""
    campaign = session.scalars(select(Campaign).filter_by(name=file.name)).one_or_none()
    row = campaign or get_or_add(
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


def refuse_other_campaign(session: Session, row: Campaign, file: CampaignFile) -> None:
    """Raise `IngestError`, with both values, when a stored campaign of this name has another kind,
    date, bench or known fact."""
    if row.fingerprint == file.fingerprint:
        return
    differences = bench_differences(session, row, file)
    changes = [fact for fact in differences if fact[2] is not None] or differences
    words = (
        "; ".join(difference(*fact) for fact in changes)
        or "the name of the modal table's file is another"
    )
    raise IngestError(
        f"campaign.toml: campaign {file.name!r} is in the store with another kind, date, bench or "
        f"known fact: {words}; restore the stored values, or give this campaign another name"
    )


def bench_additions(session: Session, row: Campaign, file: CampaignFile) -> list[str]:
    """Facts of the bench that `campaign.toml` has and the stored campaign lacks, of `[known]` too:
    "bench.hammer.mass_kg = 0.32".

    Raises `IngestError` as `refuse_other_campaign` where anything that is stored differs.
    """
    if row.fingerprint == file.fingerprint:
        return []
    differences = bench_differences(session, row, file)
    if not differences or any(stored is not None for _, _, stored in differences):
        refuse_other_campaign(session, row, file)
    return [f"{name} = {given}" for name, given, _ in differences]


def _part(session: Session, model: type[Part], content: dict[str, float]) -> Part:
    return get_or_add(session, model, {"fingerprint": fingerprint_of(content)}, content)


def _plate(session: Session, part: PlatePart, modes: ModalTableFile | None) -> Plate:
    table = _modal_table(session, modes) if modes else None
    outline = [list(corner) for corner in part.outline_m] if part.outline_m else None
    values: dict[str, Any] = {
        "modal_table_id": table.id if table else None,
        "material_id": material_id(session, part.material) if part.material else None,
        "thickness_m": part.thickness_m,
        "outline_m": outline,
    }
    content = [modes.fingerprint if modes else None, part.material, part.thickness_m, outline]
    return get_or_add(session, Plate, {"fingerprint": fingerprint_of(content)}, values)


def plate_mass(session: Session, part: PlatePart) -> float | None:
    """Mass in kg of a plate of known material, thickness and outline (by the shoelace formula);
    None otherwise."""
    if part.material is None or part.thickness_m is None or part.outline_m is None:
        return None
    x, y = np.array(part.outline_m).T
    area_m2 = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0
    density = session.scalars(
        select(Material.density_kg_m3).where(Material.name == part.material)
    ).one()
    return area_m2 * part.thickness_m * density


def struck_plate(session: Session, part: PlatePart | None, row: RunRow) -> StruckPlate | None:
    """The plate that a row was struck on, of the row's own material or the bench's; None where it
    is not known."""
    levels = row.levels_by_factor
    stated_plate = levels.get("plate_material")
    name = stated_plate.label if stated_plate is not None else (part.material if part else None)
    if part is None or name is None or part.thickness_m is None:
        return None
    stored = session.scalars(select(Material).where(Material.name == name)).one_or_none()
    anvil = levels.get("anvil_material")
    if stored is None:
        return None
    figures = (
        stored.youngs_modulus_pa,
        stored.poisson_ratio,
        stored.density_kg_m3,
        part.thickness_m,
    )
    return StruckPlate(*figures, anvil=anvil is not None and anvil.label != NONE)


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


def settings_id(session: Session, settings: ExtractionSettings) -> int:
    """Key of these extraction settings at this version of the code."""
    values = {"code_version": EXTRACTION_VERSION, "settings": settings.as_json()}
    return get_or_add(session, SettingsRow, {"fingerprint": settings.fingerprint}, values).id


def channel_values(series: StoredSeries) -> dict[str, Any]:
    """The row of a channel (its frames are written by `schema.series.write_series`), but for its
    recording."""
    channel = series.channel
    sensor = channel.sensor
    gain, offset = sensor.conversion
    return {
        "name": sensor.name,
        "quantity": sensor.quantity,
        "unit": sensor.unit,
        "sensitivity": sensor.sensitivity,
        "offset_v": sensor.offset_v if sensor.sensitivity is not None else None,
        "position": sensor.position,
        "axis": sensor.axis,
        "full_scale": sensor.range,
        "si_unit": channel.si_unit,
        "si_gain": gain,
        "si_offset": offset,
        "sampling_rate_hz": channel.sampling_rate_hz,
        "start_s": channel.start_s,
        "samples": series.encoded.samples,
        "dtype": series.encoded.layout.dtype,
        "chunk_samples": series.encoded.layout.chunk_samples,
        "step": series.encoded.layout.step,
        "sha256": series.encoded.sha256,
        "header": channel.header
        if sensor.calibration is None
        else with_calibration(channel.header, sensor),
    }


def pulse_values(pulse: ExtractedPulse, impact_id: int, settings: int) -> dict[str, Any]:
    """The row of a pulse in use."""
    measured = {column.name for column in Pulse.__table__.columns} & {
        field.name for field in fields(pulse)
    }
    return {
        "impact_id": impact_id,
        "settings_id": settings,
        "current": True,
        "extracted_at": datetime.now(UTC),
        **{name: getattr(pulse, name) for name in measured},
        "force_points_n": [float(x) for x in pulse.force_points_n],
        "fine_force_n": encode(pulse.fine_force_n),
    }


def impact_values(
    row: RunRow, hit: MatchedImpact, done: ProcessedRecording | None
) -> dict[str, object]:
    if row.impact_velocity_m_s is not None:
        return {
            "impact_velocity_m_s": row.impact_velocity_m_s,
            "impact_velocity_u_m_s": row.impact_velocity_u_m_s,
            "velocity_source": "reported",
        }
    speed = done.speeds[hit.pulse] if done and hit.pulse is not None and done.speeds else None
    if speed is None:
        return {}
    return {
        "impact_velocity_m_s": speed.velocity_m_s,
        "impact_velocity_u_m_s": speed.velocity_u_m_s,
        "velocity_source": speed.source,
    }


def hit_velocity(row: RunRow, hit: MatchedImpact, done: ProcessedRecording) -> float | None:
    """The impact velocity by whatever tells it first: the row, the impactor's acceleration, the
    shot (m/s)."""
    velocity = impact_values(row, hit, done).get("impact_velocity_m_s")
    shot = done.shot.velocity_m_s if done.shot else None
    best = velocity if isinstance(velocity, float) else row.measured_velocity_m_s or shot
    return None if best is None else float(best)


def shot_values(row: RunRow, done: ProcessedRecording | None) -> dict[str, object]:
    values: dict[str, object] = {
        "tank_pressure_pa": row.number("tank_pressure"),
        "bullet_mass_kg": row.number("bullet_mass"),
        "bullet_length_m": row.bullet_length_m,
    }
    shot = done.shot if done else None
    if shot and shot.tank_pressure_pa is not None:
        values |= {
            "recorded_pressure_pa": shot.tank_pressure_pa,
            "recorded_pressure_u_pa": shot.tank_pressure_u_pa,
        }
    if row.measured_velocity_m_s is not None:
        values |= {
            "measured_velocity_m_s": row.measured_velocity_m_s,
            "measured_velocity_u_m_s": reported_uncertainty(row),
            "velocity_source": "reported",
        }
    elif shot and shot.velocity_m_s is not None:
        values |= {
            "measured_velocity_m_s": shot.velocity_m_s,
            "measured_velocity_u_m_s": shot.velocity_u_m_s,
            "velocity_source": "laser",
        }
    return values


def finding_values(
    finding: Finding, recording_id: int, channels: dict[str, int], impacts: dict[int, int]
) -> dict[str, object]:
    return {
        "recording_id": recording_id,
        "channel_id": channels.get(finding.channel),
        "impact_id": impacts.get(finding.contact) if finding.contact is not None else None,
        "check": finding.check,
        "severity": finding.severity,
        "message": finding.message,
        "evidence": finding.evidence,
    }
