"""What the store knows of a campaign before an ingest, beside what its folder says now: of
recordings, of kind, date and bench, and of each row of `runs.csv` every value that differs, with
both."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ..schema.benches import Material, ModalTable, Mode, Plate
from ..schema.campaigns import Campaign, Configuration, ConfigurationLevel, Factor, FactorLevel
from ..schema.configurations import configuration_fingerprint
from ..schema.impacts import Impact, Shot
from ..schema.known_facts import KnownFact, facts_from_json
from ..schema.recordings import STORED, RecordedChannel, Recording
from .errors import IngestError, difference, printable
from .folder import CampaignFile, GunPart, HammerPart, PlatePart
from .modes import ModalTableFile
from .runs import RunRow
from .velocity import muzzle_velocity_uncertainty


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


@dataclass(frozen=True)
class KnownRecording:
    """A row of the store's recordings."""

    sha256: str
    status: str
    reason: str | None


@dataclass(frozen=True)
class KnownRow:
    """A row of `runs.csv` that is in the store: its recording's path, the fingerprint of its
    factors, and the values that it reported, by column."""

    recording: str | None
    factors: str
    values: Mapping[str, float | None]


def known_recordings(session: Session, campaign: Campaign | None) -> dict[str, KnownRecording]:
    """By path."""
    if campaign is None:
        return {}
    columns = (Recording.path, Recording.sha256, Recording.status, Recording.reason)
    rows = session.execute(select(*columns).where(Recording.campaign_id == campaign.id))
    return {path: KnownRecording(sha256, status, reason) for path, sha256, status, reason in rows}


def known_rows(session: Session, campaign: Campaign | None) -> dict[tuple[int, int], KnownRow]:
    """(run, repetition) -> what the table said of it."""
    if campaign is None:
        return {}
    # a gun's hit is impact and shot, and the shot has the say
    if campaign.kind == "gun":
        return dict(_known_shots(session, campaign))
    return dict(_known_impacts(session, campaign))


def _known_impacts(
    session: Session, campaign: Campaign
) -> Iterator[tuple[tuple[int, int], KnownRow]]:
    columns = (
        Impact.run,
        Impact.repetition,
        Recording.path,
        Configuration.fingerprint,
        *_IMPACT_VELOCITY,
    )
    query = select(*columns).join(Configuration, Impact.configuration_id == Configuration.id)
    query = query.outerjoin(Recording, Impact.recording_id == Recording.id)
    rows = session.execute(query.where(Impact.campaign_id == campaign.id))
    for run, repetition, path, factors, source, speed, speed_u in rows:
        yield (
            (run, repetition),
            KnownRow(path, factors, reported_velocity("impact", source, speed, speed_u)),
        )


def _known_shots(
    session: Session, campaign: Campaign
) -> Iterator[tuple[tuple[int, int], KnownRow]]:
    measured = (Shot.velocity_source, Shot.measured_velocity_m_s, Shot.measured_velocity_u_m_s)
    columns = (
        Shot.run,
        Shot.repetition,
        Recording.path,
        Configuration.fingerprint,
        Shot.bullet_length_m,
        *measured,
    )
    query = select(*columns, *_IMPACT_VELOCITY).join(
        Configuration, Shot.configuration_id == Configuration.id
    )
    query = query.outerjoin(Recording, Shot.recording_id == Recording.id).outerjoin(
        Impact, Shot.impact_id == Impact.id
    )
    for run, repetition, path, factors, length, *speeds in session.execute(
        query.where(Shot.campaign_id == campaign.id)
    ):
        values = (
            reported_velocity("measured", *speeds[:3])
            | reported_velocity("impact", *speeds[3:])
            | {"bullet_length_m": length}
        )
        yield (run, repetition), KnownRow(path, factors, values)


_IMPACT_VELOCITY = (
    Impact.velocity_source,
    Impact.impact_velocity_m_s,
    Impact.impact_velocity_u_m_s,
)


def reported_velocity(
    what: str, source: str | None, speed: float | None, speed_u: float | None
) -> dict[str, float | None]:
    """A velocity and its uncertainty where the laboratory reported them; what a record gave is no
    word of a row."""
    names = (f"{what}_velocity_m_s", f"{what}_velocity_u_m_s")
    return dict(zip(names, (speed, speed_u) if source == "reported" else (None, None), strict=True))


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


def reported_uncertainty(row: RunRow) -> float | None:
    """The lab's own standard uncertainty; else eq. 5.2 where bullet length and laser sampling rate
    are given."""
    if row.measured_velocity_u_m_s is not None or not row.measured_velocity_m_s:
        return row.measured_velocity_u_m_s
    if row.bullet_length_m is None or row.laser_sampling_rate_hz is None:
        return None
    transit = row.bullet_length_m / row.measured_velocity_m_s
    length_u = {} if row.bullet_length_u_m is None else {"length_u_m": row.bullet_length_u_m}
    period = 1.0 / row.laser_sampling_rate_hz
    return float(
        muzzle_velocity_uncertainty(row.bullet_length_m, transit, time_u_s=period, **length_u)
    )


def recordings_alike(session: Session, recording: Recording) -> list[str]:
    """Other recordings of the same campaign with the same samples on every channel, by path."""
    own = select(RecordedChannel.sha256).where(RecordedChannel.recording_id == recording.id)
    number = select(func.count(RecordedChannel.id)).where(
        RecordedChannel.recording_id == recording.id
    )
    query = (
        select(Recording.path)
        .join(RecordedChannel, RecordedChannel.recording_id == Recording.id)
        .where(RecordedChannel.sha256.in_(own))
        .where(Recording.campaign_id == recording.campaign_id, Recording.id != recording.id)
        .group_by(Recording.path)
        .having(func.count(RecordedChannel.id) >= number.scalar_subquery())
        .order_by(Recording.path)
    )
    return list(session.scalars(query))


def stored_elsewhere(session: Session, recording: Recording) -> list[tuple[str, str]]:
    """(campaign, path) of stored recordings of other campaigns that are the same file."""
    query = (
        select(Campaign.name, Recording.path)
        .join(Campaign, Recording.campaign_id == Campaign.id)
        .where(
            Recording.sha256 == recording.sha256,
            Recording.campaign_id != recording.campaign_id,
            Recording.status == STORED,
        )
        .order_by(Campaign.name, Recording.path)
    )
    return [(name, path) for name, path in session.execute(query)]


def row_values(row: RunRow, kind: str) -> dict[str, float | None]:
    """What `known_rows` has as the values of this very row."""
    speed, speed_u = row.impact_velocity_m_s, row.impact_velocity_u_m_s
    values = reported_velocity("impact", None if speed is None else "reported", speed, speed_u)
    if kind != "gun":
        return values
    measured = row.measured_velocity_m_s
    reported = reported_velocity(
        "measured", None if measured is None else "reported", measured, reported_uncertainty(row)
    )
    return reported | values | {"bullet_length_m": row.bullet_length_m}


class RowDifferences:
    """Rows of `runs.csv` beside the stored ones of their numbers; each stored combination of
    factors is read once."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._factors: dict[str, dict[str, str]] = {}

    def changes(self, session: Session, row: RunRow, stored: KnownRow) -> list[str]:
        """What a row says otherwise than the stored one: "tip_radius is 0.02 m, 0.01 m in the
        store"; none where equal.

        A factor that the stored row lacks is an addition, and no change.
        """
        factors = [
            difference(*factor)
            for factor in self._of_factors(session, row, stored)
            if factor[2] is not None
        ]
        values = row_values(row, self._kind)
        return factors + [
            difference(key, _text(value), _text(stored.values[key]))
            for key, value in values.items()
            if value != stored.values[key]
        ]

    def added_factors(self, session: Session, row: RunRow, stored: KnownRow) -> tuple[str, ...]:
        """Names of the factors that the row has and the stored one lacks."""
        return tuple(
            name for name, _, there in self._of_factors(session, row, stored) if there is None
        )

    def _of_factors(
        self, session: Session, row: RunRow, stored: KnownRow
    ) -> list[tuple[str, str | None, str | None]]:
        if configuration_fingerprint(row.levels) == stored.factors:
            return []
        if stored.factors not in self._factors:
            self._factors[stored.factors] = _stored_factors(session, stored.factors)
        there = self._factors[stored.factors]
        given = {level.factor: _level(level.label, level.si_unit) for level in row.levels}
        names = sorted({*given, *there})
        return [(n, given.get(n), there.get(n)) for n in names if given.get(n) != there.get(n)]


def refuse_changed_rows(
    session: Session,
    file: CampaignFile,
    rows: Iterable[RunRow],
    known_rows: Mapping[tuple[int, int], KnownRow],
    recordings: Mapping[str, KnownRecording],
    differences: RowDifferences,
) -> None:
    """Raise `IngestError` for a row that is in the store with other values, or from another
    recording."""
    for row in rows:
        where = f"{row.place}: run {row.run}, repetition {row.repetition}"
        stored = known_rows.get((row.run, row.repetition))
        if stored is None:
            path = row.recording or ""
            if path in recordings and recordings[path].status == STORED:
                raise IngestError(
                    f"{where}: {path} is in the store already, without this row; give it back its "
                    f"rows, {way_out(file.name, path)}"
                )
        elif stored.recording != row.recording:
            source = stored.recording or "a row without recording"
            replace = (
                ""
                if None in (stored.recording, row.recording)
                else f", {way_out(file.name, source, row.recording)}"
            )
            raise IngestError(
                f"{where} is in the store from {source}; give this one a number of its own{replace}"
            )
        elif changes := differences.changes(session, row, stored):
            replace = (
                "" if stored.recording is None else f", {way_out(file.name, stored.recording)}"
            )
            raise IngestError(
                f"{where} is in the store with other factors, velocity or "
                f"bullet: {'; '.join(changes)}; "
                f"restore the stored values, or give the corrected run a number of its own{replace}"
            )


def way_out(campaign: str, recording: str, other: str | None = None) -> str:
    """The command that puts what the folder holds, or its `other` file, in the place of a stored
    recording."""
    source = "--from FOLDER" if other is None else f"FOLDER/{other}"
    return f"or replace it: pyroshock runs replace {campaign} {recording} {source} --reason TEXT"


def _stored_factors(session: Session, fingerprint: str) -> dict[str, str]:
    query = select(Factor.name, FactorLevel.label, Factor.si_unit).join(
        FactorLevel, FactorLevel.factor_id == Factor.id
    )
    query = query.join(ConfigurationLevel, ConfigurationLevel.level_id == FactorLevel.id)
    query = query.join(Configuration, ConfigurationLevel.configuration_id == Configuration.id)
    return {
        name: _level(label, unit)
        for name, label, unit in session.execute(
            query.where(Configuration.fingerprint == fingerprint)
        )
    }


def _level(label: str, unit: str | None) -> str:
    return f"{label} {unit}" if unit else label


def _text(value: float | None) -> str | None:
    return None if value is None else repr(value)
