"""Shots and hammer impacts of a campaign, read from the store as a twin learns from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from sqlalchemy import and_, select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...dataset.rows import rows_of_campaigns
from ...dataset.selection import verdicts
from ...ingest.storing.stored_channels import list_channels, read_channel
from ...schema.benches import Hammer
from ...schema.campaigns import Campaign
from ...schema.configurations import configuration_factors
from ...schema.impacts import INTEGRATED, Impact, Pulse, Shot, velocity_kind
from ...schema.listings import get_campaign_id
from ...schema.recordings import QualityFinding, RecordedChannel
from ...schema.series import as_floats
from ...twin.contact.hertz import impactor_of_pulse
from ...twin.contact.impacts import bodies_of, plate_impedance
from ...twin.contact.target_motion import PulseMoments, TargetMotion, velocity_before_contact
from ...twin.contact_interface import ImpactBatch
from ...twin.measured_shots import MeasuredShots
from ...twin.setting import ElasticMaterial, Setting
from .benches import Bench

NONE = "none"
#: So much of a record, from the beginning of contact on, is the shock: as long as the records of a
#: twin.
SHOCK_S = 0.1
#: Of a hit among others in a recording: rest before its contact, and what is kept clear of the next
#: one.
_REST_S, _CLEAR_S = 1e-3, 1e-3
#: Where no contact is known, the share of a record at its begin that is rest.
_QUIET = 0.1
#: From this share of the sensor's range on, a record is taken for clipped.
_CLIPPED = 0.99
#: A peak below so many standard deviations of what the sensor shows before the shock is no shock.
_SILENT = 10.0
#: Relative standard uncertainty of a velocity that was stored without any.
_UNSTATED_U = 0.01
#: The tip of a shot of which nothing but the velocity was measured: the velocity does not depend on
#: it.
_UNSTATED_TIP: Mapping[str, str | float] = {"tip_material": "steel", "tip_radius": 0.045}
#: Equal phases of a force that is given to the twin.
_PHASES = 201
#: Factors that a setting has fields for; others are a laboratory's own.
_FIELDS = frozenset(field.name.removesuffix("_m") for field in fields(Setting)) | {
    "tip_material",
    "plate_material",
    "anvil_material",
    "bullet_mass",
    "tank_pressure",
}


@dataclass(frozen=True)
class CampaignPlate:
    """The campaign's plate as its settings name it: `material` is that of shots that do not say
    theirs."""

    material: str
    thickness_m: float
    area_m2: float


@dataclass(frozen=True, eq=False)
class _Hit:
    """A row of the store: a shot with the impact that belongs to it, or a hammer's impact."""

    run: int
    repetition: int
    configuration: int
    recording: int | None
    impact: int | None
    pressure_pa: float | None
    mass_kg: float | None
    velocity_m_s: float | None
    velocity_u_m_s: float | None
    velocity_source: str | None
    start_s: float | None
    contact_time_s: float | None
    peak_force_n: float | None
    impulse_n_s: float | None
    force_points_n: list[float] | None


@dataclass(frozen=True, eq=False)
class _Shot:
    """A hit as a twin takes it: the velocity before contact (NaN: not known), the force (phases,)
    where that is given to the twin, peak and spectrum of each sensor (sensors, 1 + lines)."""

    hit: _Hit
    setting: Setting
    velocity_m_s: float
    velocity_u_m_s: float
    given_force_n: Floats | None
    figures: Floats


def read_measured_shots(
    session: Session,
    campaign: str,
    *,
    frequency_hz: Floats,
    q: float,
    sensors: Sequence[str],
    material: Callable[[str], ElasticMaterial],
    plate: CampaignPlate,
    most: int | None = None,
) -> tuple[MeasuredShots, tuple[str, ...]]:
    """The campaign's shots, and why some are left out (a sentence for each, with run and
    repetition).

    `material` knows materials by name and raises `LookupError` for others. Spectra are maximax
    (m/s2) of 0.1 s of each record from its contact on, or until the next hit, less the rest before
    it; `sensors` that have no usable record of a shot have NaN there. A hammer's impact is left out
    where a check rejects it; a gun's shot then has NaN for its force, and keeps velocity and
    accelerations. Shots without mass or velocity are predicted from their measured force
    (`MeasuredShots.given_force`); those that have no force either, or whose setting is not known,
    are left out. Of more than `most`, evenly picked ones are read. Raises `LookupError` for an
    unknown campaign.
    """
    key = get_campaign_id(session, campaign)
    hits, rejected = _hits(session, key), _rejected(session, key)
    if most is not None and len(hits) > most:
        hits = [hits[row] for row in np.linspace(0, len(hits) - 1, most).round().astype(np.intp)]
    words = configuration_factors(session, list({hit.configuration for hit in hits}))
    records = _Records(session, tuple(sensors), frequency_hz, q, _starts(session, key))
    kept: list[_Shot] = []
    left_out: list[str] = []
    for hit in hits:
        where = f"run {hit.run}, repetition {hit.repetition}"
        try:
            if hit.impact in rejected:
                hit = _without_force(hit, rejected[hit.impact])
                left_out.append(f"{where}: the check {rejected[hit.impact]} rejects its force")
            velocity, velocity_u = _velocity(hit, words[hit.configuration], material, plate)
            force = _given_force(session, hit, velocity)
            if force is not None:
                hit, velocity = (
                    replace(hit, mass_kg=1.0, pressure_pa=None),
                    1.0,
                )  # until the bodies are known
            setting = _setting(hit, words[hit.configuration], velocity, material, plate)
            if force is not None:
                setting, velocity, velocity_u = _of_pulse(setting, hit), math.nan, math.nan
        except (ValueError, LookupError) as error:
            left_out.append(f"{where}: {error}")
            continue
        figures, reasons = records.figures(hit)
        left_out += [f"{where}: {reason}" for reason in reasons]
        kept.append(_Shot(hit, setting, velocity, velocity_u, force, figures))
    return _shots(kept, tuple(sensors), frequency_hz, q), tuple(left_out)


def no_shots(sensors: Sequence[str], frequency_hz: Floats, q: float) -> MeasuredShots:
    """Of a campaign that nothing was measured of."""
    return _shots([], tuple(sensors), frequency_hz, q)


def struck_plate(bench: Bench) -> CampaignPlate:
    """Of a campaign's bench."""
    return CampaignPlate(bench.plate_material, bench.drawing.thickness_m, bench.drawing.area_m2)


def _shots(
    kept: Sequence[_Shot], sensors: tuple[str, ...], lines: Floats, q: float
) -> MeasuredShots:
    figures = np.array([shot.figures for shot in kept]).reshape(
        len(kept), len(sensors), lines.size + 1
    )
    hits = [shot.hit for shot in kept]
    forces = np.full((len(kept), _PHASES), np.nan)
    for row, shot in enumerate(kept):
        if shot.given_force_n is not None:
            forces[row] = shot.given_force_n
    return MeasuredShots(
        settings=tuple(shot.setting for shot in kept),
        configuration=np.array([hit.configuration for hit in hits], dtype=np.intp),
        impact_velocity_m_s=np.array([shot.velocity_m_s for shot in kept], dtype=np.float64),
        impact_velocity_u_m_s=np.array([shot.velocity_u_m_s for shot in kept], dtype=np.float64),
        contact_time_s=_column([hit.contact_time_s for hit in hits]),
        peak_force_n=_column([hit.peak_force_n for hit in hits]),
        impulse_n_s=_column([hit.impulse_n_s for hit in hits]),
        sensors=sensors,
        peak_acceleration_m_s2=figures[..., 0],
        frequency_hz=lines,
        q=q,
        spectra_m_s2=figures[..., 1:],
        given_force_n=forces,
    )


def _without_force(hit: _Hit, check: str) -> _Hit:
    """Of a gun, whose laser has no part in the force. Raises `ValueError` for a hammer's impact."""
    if hit.pressure_pa is None:
        raise ValueError(f"the check {check} rejects it")
    return replace(hit, contact_time_s=None, peak_force_n=None, impulse_n_s=None)


def _column(values: Sequence[float | None]) -> Floats:
    return np.array([math.nan if value is None else value for value in values], dtype=np.float64)


# --- rows of the store ---


def _hits(session: Session, campaign: int) -> list[_Hit]:
    """In the order of runs: shots where the campaign has any, else the impacts of its hammer."""
    pulse = (
        Pulse.start_s,
        Pulse.contact_time_s,
        Pulse.spline_peak_force_n,
        Pulse.impulse_n_s,
        Pulse.force_points_n,
    )
    in_use = and_(Pulse.impact_id == Impact.id, Pulse.current)
    shots = (
        select(
            Shot.run, Shot.repetition, Shot.configuration_id, Shot.recording_id, Impact.id,
            Shot.tank_pressure_pa,
            Shot.bullet_mass_kg, Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s,
            Shot.velocity_source, *pulse,
        )
        .outerjoin(Impact, Shot.impact_id == Impact.id)
        .outerjoin(Pulse, in_use)
        .where(Shot.campaign_id == campaign)
        .order_by(Shot.run, Shot.repetition)
    )  # fmt: skip
    hits = [_Hit(*values) for values in _values(session, shots)]
    if hits:
        return hits
    mass = session.scalar(
        select(Hammer.mass_kg)
        .join(Campaign, Campaign.hammer_id == Hammer.id)
        .where(Campaign.id == campaign)
    )
    impacts = (
        select(
            Impact.run, Impact.repetition, Impact.configuration_id, Impact.recording_id, Impact.id,
            Impact.impact_velocity_m_s, Impact.impact_velocity_u_m_s, Impact.velocity_source,
            *pulse,
        )
        .outerjoin(Pulse, in_use)
        .where(Impact.campaign_id == campaign)
        .order_by(Impact.run, Impact.repetition)
    )  # fmt: skip
    return [_Hit(*(*values[:5], None, mass, *values[5:])) for values in _values(session, impacts)]


def _values(session: Session, query: Any) -> list[tuple[Any, ...]]:
    return [tuple(row) for row in session.execute(query)]


def _rejected(session: Session, campaign: int) -> Mapping[int | None, str]:
    """Impacts whose force or velocity a check rejects, and which check."""
    rejected: dict[int | None, str] = {}
    rejected.update(
        verdicts(
            session, [campaign], rows_of_campaigns(session, [campaign], None), "reject"
        ).items()
    )
    return rejected


def _starts(session: Session, campaign: int) -> dict[int, list[float]]:
    """When contacts begin in a recording, in order, by its key."""
    query = (
        select(Impact.recording_id, Pulse.start_s)
        .join(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
        .where(Impact.campaign_id == campaign, Impact.recording_id.is_not(None))
        .order_by(Impact.recording_id, Pulse.start_s)
    )
    starts: dict[int, list[float]] = {}
    for recording, start in _values(session, query):
        starts.setdefault(recording, []).append(start)
    return starts


def _velocity(
    hit: _Hit,
    words: dict[str, str | float],
    material: Callable[[str], ElasticMaterial],
    plate: CampaignPlate,
) -> tuple[float, float]:
    """Before contact, and its standard uncertainty, m/s; NaN where none was measured.

    One that was integrated to the peak of the force is converted by the motion of the plate under
    that force.
    """
    if not hit.velocity_m_s:
        return math.nan, math.nan
    velocity = hit.velocity_m_s
    stated = hit.velocity_u_m_s if hit.velocity_u_m_s is not None else _UNSTATED_U * velocity
    if velocity_kind(hit.velocity_source) != INTEGRATED or hit.force_points_n is None:
        return velocity, stated
    body = _plate_material(words, material, plate)
    values = (body.youngs_modulus_pa, body.poisson_ratio, body.density_kg_m3, plate.thickness_m)
    impedance = plate_impedance(*(np.array([value]) for value in values))
    motion = TargetMotion.of(impedance, np.array([words.get("anvil_material", NONE) != NONE]))
    moments = PulseMoments.of(np.array([hit.force_points_n], dtype=np.float64))
    before, uncertainty = velocity_before_contact(
        np.array([velocity]), moments, motion, np.array([stated])
    )
    return float(before[0]), float(uncertainty[0])


def _given_force(session: Session, hit: _Hit, velocity_m_s: float) -> Floats | None:
    """The measured force (N) at equal phases of the contact, of a hit without mass or velocity;
    else None."""
    by_setting = hit.mass_kg is not None and (hit.pressure_pa is not None or velocity_m_s > 0)
    if by_setting or hit.contact_time_s is None:
        return None
    query = select(Pulse.fine_force_n, Pulse.fine_period_s).where(
        Pulse.impact_id == hit.impact, Pulse.current
    )
    fine, period_s = session.execute(query).one()
    recorded = as_floats(fine, f"the force of run {hit.run}, repetition {hit.repetition}")
    time = np.linspace(0.0, hit.contact_time_s, _PHASES)
    force = np.interp(time, np.arange(recorded.size) * period_s, recorded)
    force[[0, -1]] = 0.0  # where contact begins and ends, at a threshold
    return np.asarray(force)


def _of_pulse(setting: Setting, hit: _Hit) -> Setting:
    """With the mass and the velocity that Hertz' law needs for contact time and impulse of the
    measured force."""
    stiffness = bodies_of(ImpactBatch([setting], np.ones(1))).hertz_stiffness_n_m15
    mass, velocity = impactor_of_pulse(
        _column([hit.contact_time_s]), _column([hit.impulse_n_s]), stiffness
    )
    return replace(setting, impactor_mass_kg=float(mass[0]), impact_velocity_m_s=float(velocity[0]))


def _plate_material(
    words: dict[str, str | float], material: Callable[[str], ElasticMaterial], plate: CampaignPlate
) -> ElasticMaterial:
    return material(str(words.get("plate_material", plate.material)))


def _setting(
    hit: _Hit,
    words: dict[str, str | float],
    velocity_m_s: float,
    material: Callable[[str], ElasticMaterial],
    plate: CampaignPlate,
) -> Setting:
    if hit.impact is None and hit.recording is None:
        words = {**_UNSTATED_TIP, **words}
    if "tip_material" not in words or "tip_radius" not in words:
        raise ValueError("no tip_material, or no tip_radius")
    if hit.mass_kg is None:
        raise ValueError("no mass of the impactor")
    if hit.pressure_pa is None and not velocity_m_s > 0:
        raise ValueError("no velocity of impact")
    body, anvil = _plate_material(words, material, plate), str(words.get("anvil_material", NONE))
    return Setting(
        impactor_mass_kg=hit.mass_kg,
        tip=material(str(words["tip_material"])),
        tip_radius_m=float(words["tip_radius"]),
        plate=body,
        plate_thickness_m=plate.thickness_m,
        plate_mass_kg=plate.thickness_m * plate.area_m2 * body.density_kg_m3,
        tank_pressure_pa=hit.pressure_pa,
        impact_velocity_m_s=None if hit.pressure_pa is not None else velocity_m_s,
        anvil=None if anvil == NONE else material(anvil),
        insulator=str(words.get("insulator", NONE)),
        impact_position=str(words.get("impact_position", "#1")),
        boundary_conditions=str(words.get("boundary_conditions", "free")),
        factors={name: value for name, value in words.items() if name not in _FIELDS},
    )


# --- accelerations ---


@dataclass(frozen=True, eq=False)
class _Records:
    """Reads what sensors recorded of a hit. `starts` are the beginnings of contacts in each
    recording."""

    session: Session
    sensors: tuple[str, ...]
    frequency_hz: Floats
    q: float
    starts: dict[int, list[float]]

    def figures(self, hit: _Hit) -> tuple[Floats, list[str]]:
        """Peak and spectrum (sensors, 1 + lines), NaN where there is none, and why there is
        none."""
        out = np.full((len(self.sensors), 1 + self.frequency_hz.size), np.nan)
        rows = list_channels(self.session, hit.recording) if hit.recording is not None else []
        by_name = {row.name: row for row in rows if row.quantity == "acceleration"}
        rejected = self._rejected(hit) if by_name else {}
        reasons = []
        for number, sensor in enumerate(self.sensors):
            try:
                if sensor not in by_name:
                    raise ValueError(f"no channel {sensor}" if rows else "no recording")
                if by_name[sensor].id in rejected:
                    raise ValueError(f"the check {rejected[by_name[sensor].id]} rejects {sensor}")
                out[number] = self._shock(by_name[sensor], hit)
            except ValueError as error:
                reasons.append(str(error))
        return out, reasons

    def _rejected(self, hit: _Hit) -> dict[int, str]:
        """Channels that a check rejects; what it found at one impact leaves that impact out."""
        query = select(QualityFinding.channel_id, QualityFinding.check).where(
            QualityFinding.recording_id == hit.recording,
            QualityFinding.severity == "reject",
            QualityFinding.channel_id.is_not(None),
        )
        return dict(_values(self.session, query))

    def _shock(self, row: RecordedChannel, hit: _Hit) -> Floats:
        """Largest acceleration and spectrum (1 + lines,). `ValueError` for a record that shows no
        whole shock."""
        from ...signals.record_rest import without_rest
        from ...signals.srs.spectrum import shock_response_spectrum

        first, stop, quiet = self._window(row, hit)
        if stop - first < quiet + 2:
            raise ValueError(f"{row.name} has no samples between this contact and the next")
        channel = read_channel(self.session, row, first, stop)
        record, full_scale = channel.readings, channel.sensor.range_si
        if full_scale is not None and np.abs(record).max() >= _CLIPPED * full_scale:
            raise ValueError(f"{row.name} reached its full scale")
        rest = record[:quiet]
        shock, removed = without_rest(record, row.sampling_rate_hz)
        if (
            not removed.level_m_s2
        ):  # the contact says what came before the shock where the record is too short to
            shock = record - np.median(rest)
        peak = float(np.abs(shock).max())
        if not peak >= _SILENT * float(rest.std()) or not peak > 0:
            raise ValueError(f"{row.name} shows no shock")
        spectrum = shock_response_spectrum(
            shock, row.sampling_rate_hz, self.frequency_hz, q=self.q, threads=1
        )
        return np.concatenate(([peak], spectrum.maximax))

    def _window(self, row: RecordedChannel, hit: _Hit) -> tuple[int, int, int]:
        """First sample, that after the last, and how many of the first are rest."""
        if hit.start_s is None or hit.recording is None:
            return 0, row.samples, max(1, int(_QUIET * row.samples))
        later = [start for start in self.starts.get(hit.recording, []) if start > hit.start_s]
        end_s = min(hit.start_s + SHOCK_S, min(later, default=math.inf) - _CLEAR_S)
        rate, quiet = row.sampling_rate_hz, max(1, round(_REST_S * row.sampling_rate_hz))
        begin = math.floor((hit.start_s - row.start_s) * rate)
        first = max(0, begin - quiet)
        stop = min(row.samples, math.floor((end_s - row.start_s) * rate) + 1)
        return first, stop, max(1, min(quiet, begin - first))
