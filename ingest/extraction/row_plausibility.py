"""A recording held against its rows of `runs.csv`: whether mass, velocity and tip of the rows can
be true of the pulses, and what the rows of a gun say otherwise than the laser and the tank."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from ...schema.known_factors import NONE
from ...signals.channel import on_impactor
from ...signals.checks.base import Finding
from ..folder.campaign_file import CampaignFile
from ..folder.campaign_tables import CampaignTables
from ..folder.runs_table import RunRow
from .gunshot import laser_channel
from .impact_speed import StruckPlate, TargetMotion
from .impulse_plausibility import MomentumRatio, check_impulse, check_tip
from .recording import ExtractedRecording
from .row_matching import MatchedImpact
from .shot_plausibility import check_shot


def compare_with_rows(
    tables: CampaignTables, recording: ExtractedRecording, target_motion: TargetMotion | None = None
) -> ExtractedRecording:
    """The recording with `target_motion` in its integrated velocities, and with what speaks against
    its rows."""
    if target_motion is not None:
        recording = _with_target_motion(tables, recording, target_motion)
    return replace(recording, row_findings=tuple(_findings(tables, recording)))


def _findings(tables: CampaignTables, recording: ExtractedRecording) -> Iterator[Finding]:
    file, name = tables.file, recording.main_channel
    plate_mass_kg = tables.plate_mass_kg
    for hit in recording.hits:
        if hit.pulse is None:
            continue
        if tip := check_tip(hit.row.number("tip_radius"), hit.pulse, name):
            yield tip
        mass_kg, velocity = _mass_kg(file, hit.row), _velocity(recording, hit)
        if mass_kg is None or velocity is None:
            continue
        impulse = check_impulse(
            recording.pulses[hit.pulse],
            mass_kg,
            velocity,
            hit.pulse,
            name,
            held=file.hammer is not None,
            integrated=_is_integrated(recording, hit),
            behind_anvil=_is_behind_anvil(file, recording, hit.row),
            plate_mass_kg=plate_mass_kg,
        )
        if impulse:
            yield impulse
    if file.kind == "gun" and len(recording.hits) == 1:  # of several shots the measurement is one's
        channels = [series.channel for series in recording.series]
        laser = laser_channel(channels)
        tank = next((channel.name for channel in channels if channel.quantity == "pressure"), None)
        row = recording.hits[0].row
        yield from check_shot(row, recording.shot, laser.name if laser else None, tank)


def momentum_ratios(
    tables: CampaignTables, recording: ExtractedRecording
) -> Iterator[MomentumRatio]:
    """Impulse over mass times velocity of the hits whose mass and velocity are known."""
    file, plate_kg = tables.file, tables.plate_mass_kg
    for hit in recording.hits:
        mass_kg, velocity = _mass_kg(file, hit.row), _velocity(recording, hit)
        if hit.pulse is None or mass_kg is None or velocity is None or mass_kg * velocity <= 0.0:
            continue
        yield MomentumRatio(
            recording.pulses[hit.pulse].impulse_n_s / (mass_kg * velocity),
            _is_integrated(recording, hit),
            1.0 if plate_kg is None else plate_kg / (plate_kg + mass_kg),
            _is_behind_anvil(file, recording, hit.row),
            _is_by_laser(recording, hit),
        )


def _with_target_motion(
    tables: CampaignTables, recording: ExtractedRecording, add: TargetMotion
) -> ExtractedRecording:
    """The target's motion is added where the plates of the hits are known."""
    speeds = list(recording.speeds)
    for hit in recording.hits:
        speed, plate = recording.speed_of(hit), _struck_plate(tables, hit.row)
        if speed is not None and plate is not None and hit.pulse is not None:
            speeds[hit.pulse] = add(speed, recording.pulses[hit.pulse].force_points_n, plate)
    return replace(recording, speeds=tuple(speeds))


def _struck_plate(tables: CampaignTables, row: RunRow) -> StruckPlate | None:
    """The plate that a row was struck on, of the row's own material or the bench's; None where it
    is not known."""
    part, levels = tables.file.plate, row.levels_by_factor
    stated_plate, anvil = levels.get("plate_material"), levels.get("anvil_material")
    name = stated_plate.label if stated_plate is not None else (part.material if part else None)
    if part is None or name is None or part.thickness_m is None or name not in tables.materials:
        return None
    material = tables.materials[name]
    return StruckPlate(
        material.youngs_modulus_pa,
        material.poisson_ratio,
        material.density_kg_m3,
        part.thickness_m,
        anvil=anvil is not None and anvil.label != NONE,
    )


def _mass_kg(file: CampaignFile, row: RunRow) -> float | None:
    return file.hammer.mass_kg if file.hammer else row.number("bullet_mass")


def _velocity(recording: ExtractedRecording, hit: MatchedImpact) -> float | None:
    """The impact velocity by whatever tells it first: the row, the impactor's acceleration, the
    shot (m/s)."""
    if hit.row.impact_velocity_m_s is not None:
        return hit.row.impact_velocity_m_s
    speed = recording.speed_of(hit)
    if speed is not None:
        return speed.velocity_m_s
    by_laser = recording.shot.velocity_m_s if recording.shot else None
    return hit.row.measured_velocity_m_s or by_laser


def _is_integrated(recording: ExtractedRecording, hit: MatchedImpact) -> bool:
    """Whether a hit's velocity is that of the impactor's own acceleration."""
    return hit.row.impact_velocity_m_s is None and recording.speed_of(hit) is not None


def _is_by_laser(recording: ExtractedRecording, hit: MatchedImpact) -> bool:
    """Whether a hit's velocity is the muzzle velocity by the laser."""
    reported = hit.row.impact_velocity_m_s is not None or hit.row.measured_velocity_m_s is not None
    return not reported and not _is_integrated(recording, hit) and recording.shot is not None


def _is_behind_anvil(file: CampaignFile, recording: ExtractedRecording, row: RunRow) -> bool:
    """Whether the force of a row is measured on the target's side of an anvil: no sensor of it
    rides on the impactor."""
    anvil = row.levels_by_factor.get("anvil_material")
    if file.hammer is not None or anvil is None or anvil.label == NONE:
        return False
    forces = [s.channel for s in recording.series if s.channel.quantity == "force"]
    return not any(on_impactor(channel.sensor.position) for channel in forces)
