"""What the store holds of impacts and their pulses, in a handful of queries however many there are.

Parts of a bench as the store holds them, as the twin takes them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any

from sqlalchemy import ColumnElement, RowMapping, Select, and_, func, select
from sqlalchemy.orm import Session, selectinload

from ..schema.benches import Gun, Hammer, Material, ModalTable, Plate
from ..schema.campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from ..schema.impacts import ExtractionSettingsRow, Impact, Pulse, Shot, SnapshotPulse
from ..schema.recordings import RecordedChannel, Recording
from ..twin.gun.bench import GunBench
from ..twin.setting import ElasticMaterial
from .sources import PROPERTIES, ImpactSource, Materials

if TYPE_CHECKING:
    from ..twin.plate.modal import ModalPlate


#: One impact: the labels of `_COLUMNS`.
Row = RowMapping
#: What impacts have in common: the labels of `facts_of_campaigns`.
Facts = dict[str, Any]
#: Factors of a configuration: words (labels) and numbers (SI).
Levels = tuple[dict[str, str], dict[str, float]]

_CHUNK = 500  # SQLite allows a limited number of variables

#: Of a campaign and its bench.
_BENCH_COLUMNS = (
    Campaign.name.label("campaign"),
    Campaign.kind.label("kind"),
    Hammer.mass_kg.label("hammer_mass_kg"),
    Plate.thickness_m.label("plate_thickness_m"),
    Plate.outline_m.label("plate_outline_m"),
    Material.name.label("bench_plate_material"),
)
_COLUMNS = (
    *_BENCH_COLUMNS,
    Impact.id.label("impact_id"),
    Impact.run,
    Impact.repetition,
    Impact.configuration_id,
    Impact.recording_id,
    Impact.impact_velocity_m_s,
    Impact.impact_velocity_u_m_s,
    Impact.velocity_source,
    Shot.measured_velocity_m_s,
    Shot.bullet_mass_kg,
    Recording.sha256.label("recording_sha256"),
    ExtractionSettingsRow.fingerprint.label("extraction"),
    ExtractionSettingsRow.settings.label("extraction_settings"),
    Pulse.id.label("pulse_id"),
    Pulse.start_s,
    Pulse.contact_time_s,
    Pulse.compression_time_s,
    Pulse.spline_peak_force_n,
    Pulse.impulse_n_s,
    Pulse.compression_impulse_n_s,
    Pulse.force_points_n,
    Pulse.fine_period_s,
)


def rows_of_campaigns(
    session: Session, campaigns: Sequence[int], extraction: int | None
) -> list[Row]:
    """Every impact of campaigns with its pulse; where it has none, the columns of the pulse are
    None.

    Parameters:
        session: A session of the store.
        campaigns: The keys of the campaigns.
        extraction: The key of the extraction whose pulses are taken; None for the pulses in use.
    """
    version = (
        and_(Pulse.settings_id == extraction) if extraction is not None else and_(Pulse.current)
    )
    query = _joined(and_(Pulse.impact_id == Impact.id, version)).where(
        Impact.campaign_id.in_(campaigns)
    )
    return _in_order(session, query)


def facts_of_campaigns(session: Session, campaigns: Sequence[int]) -> list[tuple[Facts, int]]:
    """What `case_of` asks of impacts with a pulse in use, of those alike together: one row for the
    impacts of a configuration that have the same facts, and how many they are.

    Of a number that differs from impact to impact the largest stands for all.

    Parameters:
        session: A session of the store.
        campaigns: The keys of the campaigns.
    """
    numbers = (Impact.impact_velocity_m_s, Shot.measured_velocity_m_s, Shot.bullet_mass_kg)
    benches = select(Campaign.id, *_BENCH_COLUMNS).where(Campaign.id.in_(campaigns))
    bench_by_campaign = {row["id"]: row for row in session.execute(_with_bench(benches)).mappings()}
    groups = (
        select(
            Impact.campaign_id,
            Impact.configuration_id,
            *(func.max(number).label(number.key) for number in numbers),
            func.count(),
        )
        .join(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
        .outerjoin(Shot, _SHOT_OF_IMPACT)
        .where(Impact.campaign_id.in_(campaigns))
        .group_by(
            Impact.campaign_id, Impact.configuration_id, *(number.is_(None) for number in numbers)
        )
    )
    names = ("configuration_id", *(number.key for number in numbers))
    return [
        ({**bench_by_campaign[campaign], **dict(zip(names, facts, strict=True))}, count)
        for campaign, *facts, count in session.execute(groups)
    ]


def rows_of_snapshot(session: Session, snapshot: int) -> list[Row]:
    """The impacts of a snapshot with the pulses that it was frozen with, in use or not.

    Parameters:
        session: A session of the store.
        snapshot: The key of the snapshot.
    """
    frozen = _joined(Pulse.impact_id == Impact.id).join(
        SnapshotPulse, SnapshotPulse.pulse_id == Pulse.id
    )
    return _in_order(session, frozen.where(SnapshotPulse.snapshot_id == snapshot))


#: By the unique key, which has an index.
_SHOT_OF_IMPACT = and_(
    Shot.campaign_id == Impact.campaign_id,
    Shot.run == Impact.run,
    Shot.repetition == Impact.repetition,
)


def _joined(pulse: ColumnElement[bool]) -> Select[Any]:
    return _with_bench(
        select(*_COLUMNS)
        .select_from(Impact)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .outerjoin(Pulse, pulse)
        .outerjoin(ExtractionSettingsRow, Pulse.settings_id == ExtractionSettingsRow.id)
        .outerjoin(Recording, Impact.recording_id == Recording.id)
        .outerjoin(Shot, _SHOT_OF_IMPACT)
    )


def _with_bench(query: Select[Any]) -> Select[Any]:
    return (
        query.outerjoin(Hammer, Campaign.hammer_id == Hammer.id)
        .outerjoin(Plate, Campaign.plate_id == Plate.id)
        .outerjoin(Material, Plate.material_id == Material.id)
    )


def _in_order(session: Session, query: Select[Any]) -> list[Row]:
    """By campaign, run and repetition: sorted here, for databases differ in how they order text."""
    return sorted(
        session.execute(query).mappings(),
        key=lambda row: (row["campaign"], row["run"], row["repetition"]),
    )


def levels_of(session: Session, configurations: Iterable[int]) -> dict[int, Levels]:
    """Factors of configurations, by key: words and numbers (SI).

    Parameters:
        session: A session of the store.
        configurations: The keys of the configurations, in any order.
    """
    levels_by_configuration: defaultdict[int, Levels] = defaultdict(lambda: ({}, {}))
    keys = sorted(set(configurations))
    query = (
        select(
            ConfigurationLevel.configuration_id, Factor.name, FactorLevel.label, FactorLevel.number
        )
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .join(Factor, FactorLevel.factor_id == Factor.id)
    )
    for i in range(0, len(keys), _CHUNK):
        chunk = query.where(ConfigurationLevel.configuration_id.in_(keys[i : i + _CHUNK]))
        for key, factor, label, number in session.execute(chunk):
            words, numbers = levels_by_configuration[key]
            words[factor] = label
            if number is not None:
                numbers[factor] = number
    return levels_by_configuration


def force_hashes(session: Session, campaigns: Sequence[int]) -> dict[int, str]:
    """Hash of the force samples of every recording, by the recording's key: the same whatever the
    file's format, name and header.

    Parameters:
        session: A session of the store.
        campaigns: The keys of the campaigns.
    """
    query = (
        select(Recording.id, func.min(RecordedChannel.sha256))
        .join(RecordedChannel, RecordedChannel.recording_id == Recording.id)
        .where(Recording.campaign_id.in_(campaigns), RecordedChannel.quantity == "force")
        .group_by(Recording.id)
    )
    return dict(iter(session.execute(query)))


def materials_of(session: Session) -> Materials:
    """Properties of every material of the store, SI.

    Parameters:
        session: A session of the store.
    """
    columns = [column for column, _ in PROPERTIES.values()]
    query = select(Material.name, *(getattr(Material, column) for column in columns))
    return {
        name: dict(zip(columns, map(float, values), strict=True))
        for name, *values in session.execute(query)
    }


def case_of(row: Row | Facts, levels: Levels) -> ImpactSource:
    """What an impact was made with. A bullet's speed is the laser's where the impact has none of
    its own.

    Parameters:
        row: The impact, as `rows_of_campaigns` or `facts_of_campaigns` gives it.
        levels: The factors of its configuration, from `levels_of`.
    """
    words, numbers = levels
    own, laser = row["impact_velocity_m_s"], row["measured_velocity_m_s"]
    return ImpactSource(
        words=words,
        numbers=numbers,
        velocity_m_s=laser if own is None else own,
        impactor_mass_kg=row["bullet_mass_kg"] if row["kind"] == "gun" else row["hammer_mass_kg"],
        bench_plate_material=row["bench_plate_material"],
        plate_thickness_m=row["plate_thickness_m"],
        plate_area_m2=polygon_area(row["plate_outline_m"]),
    )


def polygon_area(corners: Sequence[Sequence[float]] | None) -> float | None:
    """The area of a polygon in m2, by the shoelace rule; None without corners.

    Parameters:
        corners: The corners in order, each with two coordinates in m.
    """
    if not corners:
        return None
    pairs = zip(corners, [*corners[1:], corners[0]], strict=True)
    return abs(sum(ax * by - bx * ay for (ax, ay), (bx, by) in pairs)) / 2


def gun_bench(row: Gun) -> GunBench:
    """A gun as the twin takes it.

    Parameters:
        row: The gun as the store holds it.
    """
    return GunBench(**{item.name: getattr(row, item.name) for item in fields(GunBench)})


def modal_plate(table: ModalTable) -> ModalPlate:
    """A plate by its modes as the twin takes it; its impact point is "#1", its sensors are the
    channels.

    Parameters:
        table: The modal table as the store holds it.
    """
    from ..twin.plate.table import modal_plate_from_table

    columns: dict[str, list[float]] = {"frequency_hz": [], "damping_ratio": [], "shape_impact": []}
    for mode in table.modes:
        columns["frequency_hz"].append(mode.frequency_hz)
        columns["damping_ratio"].append(mode.damping_ratio)
        columns["shape_impact"].append(mode.shape_impact_per_sqrt_kg)
        for shape in mode.shapes:
            columns.setdefault(f"shape_{shape.channel}", []).append(shape.shape_per_sqrt_kg)
    return modal_plate_from_table(columns)


def stored_materials(session: Session) -> dict[str, ElasticMaterial]:
    """The store's materials by name and alias in lower case.

    Parameters:
        session: A session of the store.
    """
    rows = session.scalars(select(Material).options(selectinload(Material.aliases))).all()
    aliases = {alias.alias: row.name for row in rows for alias in row.aliases}
    properties = [item.name for item in fields(ElasticMaterial)]
    return by_name(
        [ElasticMaterial(*(getattr(row, name) for name in properties)) for row in rows], aliases
    )


def material_named(materials: Mapping[str, ElasticMaterial], name: str) -> ElasticMaterial:
    """A material by name or alias, in any case.

    Parameters:
        materials: The materials by name and alias in lower case.
        name: The name or alias.

    Raises:
        LookupError: For a name there is none of; the message names those there are.
    """
    if name.lower() not in materials:
        material_names = ", ".join(dict.fromkeys(material.name for material in materials.values()))
        raise LookupError(
            f"no material {name!r}; there are: {material_names} (pyroshock materials)"
        )
    return materials[name.lower()]


def by_name(
    materials: Iterable[ElasticMaterial], aliases: Mapping[str, str]
) -> dict[str, ElasticMaterial]:
    """Materials by name and alias in lower case; a name goes before another's alias.

    Parameters:
        materials: What the twin knows of each material, its name included.
        aliases: The name of a material by alias.
    """
    named = {material.name: material for material in materials}
    return {alias.lower(): named[name] for alias, name in aliases.items()} | {
        k.lower(): m for k, m in named.items()
    }
