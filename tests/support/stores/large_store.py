"""Stores of many impacts, filled in bulk: for listings, and for a laboratory of many years."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, islice, product
from pathlib import Path
from typing import Any

from pyroshock.ingest.extraction.settings import EXTRACTION_VERSION
from pyroshock.ingest.extraction.settings import ExtractionSettings as Settings
from pyroshock.schema.base import Base
from pyroshock.schema.benches import Hammer, Plate, material_id
from pyroshock.schema.campaign_counts import recount
from pyroshock.schema.campaigns import (
    Campaign,
    Configuration,
    ConfigurationLevel,
    Factor,
    FactorLevel,
)
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact, Pulse
from pyroshock.schema.recordings import QualityFinding, RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.row_hashes import ROW_SHA256
from pyroshock.schema.row_sealing import seal_table
from pyroshock.schema.session import Store, Writer, open_store
from pyroshock.schema.tables import metadata
from sqlalchemy import Connection, func, insert, select

Row = dict[str, Any]

WRITER = Writer("benchmark", "0")
HITS_PER_RECORDING = 10
_TIP_RADII_M = (0.005, 0.01, 0.02, 0.03, 0.04)
DESIGN: dict[str, tuple[str | float, ...]] = {
    "tip_material": ("aluminum", "steel", "delrin"),
    "tip_radius": _TIP_RADII_M,
    "anvil_material": ("none", "aluminum", "steel"),
    "hammer_speed": ("low", "high"),
    "boundary_conditions": ("free", "fixed"),
    "insulator": ("none",),
}
#: A level that one recording of the first campaign has, and no other.
RARE = ("tip_material", "polyurethane")
_WHEN = dt.datetime(2026, 11, 1, tzinfo=dt.UTC)
_BATCH = 20_000
_CURVE = ("force_points_n", "fine_period_s", "fine_force_n")


@dataclass(frozen=True)
class Sample:
    """Of ingested recordings: the curves of pulses, and the channels of one recording, a row
    without keys and hash and its frames each."""

    curves: list[Row]
    channels: list[tuple[Row, list[bytes]]]


def sample_of(store: Store) -> Sample:
    """The curves of every pulse of the store, and the channels of its first recording."""
    with store.reading() as session:
        curves = session.execute(
            select(*(getattr(Pulse, name) for name in _CURVE)).order_by(Pulse.id)
        ).mappings()
        others = ("recording_id", "sha256", "written_by_id", ROW_SHA256)
        columns = [c for c in RecordedChannel.__table__.c if c.name not in others]
        first = select(func.min(RecordedChannel.recording_id)).scalar_subquery()
        rows = (
            session.execute(select(*columns).where(RecordedChannel.recording_id == first))
            .mappings()
            .all()
        )
        frame = select(SeriesChunk.frame).order_by(SeriesChunk.number)
        frames = [
            list(session.scalars(frame.where(SeriesChunk.channel_id == row["id"]))) for row in rows
        ]
        return Sample(
            [dict(row) for row in curves],
            [(dict(row), f) for row, f in zip(rows, frames, strict=True)],
        )


@dataclass(frozen=True)
class StoreSize:
    """How many impacts, and what a store of them is like.

    `own_radii`: each campaign has configurations of its own, as campaigns do that were planned one
    by one; else all share those of one design. `sample`: curves, channels and series, the series
    with every `series_every`-th recording; without it pulses have empty curves, and recordings no
    channels.
    """

    impacts: int
    per_campaign: int = 1_800
    own_radii: bool = False
    sample: Sample | None = None
    series_every: int = 100

    @property
    def campaigns(self) -> int:
        return -(-self.impacts // self.per_campaign)

    @property
    def recordings(self) -> int:
        return self.impacts // HITS_PER_RECORDING

    def campaign_of(self, impact: int) -> int:
        return (impact - 1) // self.per_campaign + 1


def campaign_name(number: int) -> str:
    return f"campaign-{number:04d}"


def filled(folder: Path, impacts: int) -> str:
    """The address of a SQLite store in `folder` with so many impacts, made where it is not there
    yet."""
    path, unfinished = folder / f"impacts-{impacts}.db", folder / f"unfinished-{impacts}.db"
    if not path.exists():
        for old in folder.glob(f"{unfinished.name}*"):
            old.unlink()
        fill(f"sqlite:///{unfinished}", impacts)
        unfinished.rename(path)
    return f"sqlite:///{path}"


def fill(url: str, size: StoreSize | int) -> None:
    """A new store at `url` with so many impacts, their pulses, recordings and some findings."""
    size = StoreSize(size) if isinstance(size, int) else size
    with open_store(url, WRITER, create=True) as store:
        with store.writing() as session:
            signed = store.written_by(session)
            aluminum = material_id(session, "aluminum")
        with store.engine.begin() as connection:
            for model, rows in _bench(aluminum):
                _insert(connection, model, rows, signed)
            configurations, rare = _design(connection, size, signed)
            for model, more in (
                (Campaign, _campaigns(size)),
                (Recording, _recordings(size)),
                (RecordedChannel, _channels(size)),
                (SeriesChunk, _chunks(size)),
                (Impact, _impacts(size, configurations, rare)),
                (Pulse, _pulses(size)),
                (QualityFinding, _findings(size)),
            ):
                _insert(connection, model, more, signed)
        store.write(recount)
        _analyse(store)


def _bench(aluminum: int) -> Iterator[tuple[type[Base], list[Row]]]:
    """Hammer, plate, and the settings with which a campaign is ingested: pages read them, and an
    ingest finds them."""
    corners, settings = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.4], [0.0, 0.4]], Settings()
    yield Hammer, [{"id": 1, "fingerprint": "hammer", "mass_kg": 0.32}]
    plate = {
        "fingerprint": "plate",
        "material_id": aluminum,
        "thickness_m": 0.01,
        "outline_m": corners,
    }
    yield Plate, [{"id": 1, **plate}]
    row = {
        "fingerprint": settings.fingerprint,
        "code_version": EXTRACTION_VERSION,
        "settings": settings.as_json(),
    }
    yield ExtractionSettingsRow, [{"id": 1, **row}]


def _design(connection: Connection, size: StoreSize, signed: int) -> tuple[list[list[int]], int]:
    """Keys of the configurations of each campaign (of one where they share them), which are all
    combinations of its levels, and of the configuration with the rare level."""
    key_of: dict[tuple[int, str | float], int] = {}
    combinations: list[tuple[str | float, ...]] = []
    groups: list[list[int]] = []
    for campaign in range(size.campaigns if size.own_radii else 1):
        radii = tuple(round(value + 1e-6 * campaign, 6) for value in _TIP_RADII_M)
        own = [*product(*(DESIGN | {"tip_radius": radii}).values())]
        groups.append(list(range(len(combinations) + 1, len(combinations) + len(own) + 1)))
        combinations += own
    combinations.append((RARE[1], *combinations[0][1:]))
    for combination in combinations:
        for choice in enumerate(combination, 1):
            key_of.setdefault(choice, len(key_of) + 1)
    units = {"tip_radius": "m"}
    factors = [
        {"id": i, "name": name, "si_unit": units.get(name)} for i, name in enumerate(DESIGN, 1)
    ]
    levels = (
        {
            "id": key,
            "factor_id": factor,
            "label": str(value),
            "number": value if isinstance(value, float) else None,
        }
        for (factor, value), key in key_of.items()
    )
    keyed = list(enumerate(combinations, 1))
    rows = (
        {"configuration_id": key, "level_id": key_of[choice], "factor_id": choice[0]}
        for key, combination in keyed
        for choice in enumerate(combination, 1)
    )
    _insert(connection, Factor, factors, signed)
    _insert(connection, FactorLevel, levels, signed)
    _insert(
        connection,
        Configuration,
        ({"id": key, "fingerprint": f"{key:064d}"} for key, _ in keyed),
        signed,
    )
    _insert(connection, ConfigurationLevel, rows, signed)
    return groups, len(combinations)


def _campaigns(size: StoreSize) -> Iterator[Row]:
    common = {"kind": "hammer", "date": _WHEN.date(), "hammer_id": 1, "plate_id": 1}
    for key in range(1, size.campaigns + 1):
        yield {"id": key, "name": campaign_name(key), "fingerprint": str(key), **common}


def _recordings(size: StoreSize) -> Iterator[Row]:
    common = {"size_bytes": 4_096_000, "format": "mat", "status": "stored"}
    for key in range(1, size.recordings + 1):
        campaign, path = size.campaign_of(key * HITS_PER_RECORDING), f"recordings/{key:06d}.mat"
        yield {"id": key, "campaign_id": campaign, "path": path, "sha256": f"{key:064d}", **common}


def _channels(size: StoreSize) -> Iterator[Row]:
    channels = size.sample.channels if size.sample else []
    for recording in range(1, size.recordings + 1):
        for i, (row, _) in enumerate(channels):
            key = (recording - 1) * len(channels) + i + 1
            yield {**row, "id": key, "recording_id": recording, "sha256": f"{key:064x}"}


def _chunks(size: StoreSize) -> Iterator[Row]:
    channels = size.sample.channels if size.sample else []
    for recording in range(size.series_every, size.recordings + 1, size.series_every):
        for i, (_, frames) in enumerate(channels):
            key = (recording - 1) * len(channels) + i + 1
            yield from (
                {"channel_id": key, "number": number, "frame": frame}
                for number, frame in enumerate(frames)
            )


def _impacts(size: StoreSize, configurations: list[list[int]], rare: int) -> Iterator[Row]:
    per_campaign = size.per_campaign // HITS_PER_RECORDING
    for key in range(1, size.impacts + 1):
        recording, campaign = (key - 1) // HITS_PER_RECORDING, size.campaign_of(key)
        common = configurations[(campaign - 1) % len(configurations)]
        yield {
            "id": key,
            "campaign_id": campaign,
            "run": recording % per_campaign + 1,
            "repetition": (key - 1) % HITS_PER_RECORDING + 1,
            "configuration_id": rare if recording == 90 else common[recording % len(common)],
            "recording_id": recording + 1,
            "impact_velocity_m_s": 0.5 + key % 1000 / 1000,
            "impact_velocity_u_m_s": 0.001,
            "velocity_source": "integrated",
        }


def _pulses(size: StoreSize) -> Iterator[Row]:
    """Pulses in use; their curves are the sample's, or a few bytes that no listing reads."""
    bare = {"force_points_n": [], "fine_period_s": 2e-6, "fine_force_n": b""}
    curves = size.sample.curves if size.sample else [bare]
    common = {"settings_id": 1, "current": True, "extracted_at": _WHEN, "width_half_s": 2e-4,
    "width_tenth_s": 3e-4,
              "samples_in_contact": 20, "spline_nrmse": 0.001,
              "segmentation_difference": 0.05}  # fmt: skip
    for key in range(1, size.impacts + 1):
        share = key % 997 / 997
        yield {
            "id": key,
            "impact_id": key,
            "start_s": 0.25 + (key - 1) % HITS_PER_RECORDING,
            "contact_time_s": 3e-4 + 1e-3 * share,
            "compression_time_s": 1.5e-4 + 5e-4 * share,
            "peak_force_n": 1000.0 + 2000.0 * share,
            "spline_peak_force_n": 1000.0 + 2000.0 * share,
            "impulse_n_s": 0.5 + share,
            "compression_impulse_n_s": 0.25 + share / 2,
            **common,
            **curves[key % len(curves)],
        }


def _findings(size: StoreSize) -> Iterator[Row]:
    """A doubt about every hundredth impact, and about every fiftieth recording as a whole."""
    common = {"check": "few-samples", "severity": "warning", "message": "", "evidence": {}}
    for key in range(100, size.impacts + 1, 100):
        yield {**common, "recording_id": (key - 1) // HITS_PER_RECORDING + 1, "impact_id": key}
    for key in range(50, size.recordings + 1, 50):
        yield {**common, "recording_id": key, "impact_id": None}


def _insert(connection: Connection, model: type[Base], rows: Iterable[Row], signed: int) -> None:
    """Rows, all with the same keys, as written by provenance row `signed`: COPY on PostgreSQL, else
    batches."""
    waiting: Iterator[Row] = ({**row, "written_by_id": signed} for row in rows)
    if connection.dialect.name == "postgresql":
        _copy(connection, model, waiting)
        seal_table(connection, metadata.tables[model.__tablename__])
        return
    while batch := list(islice(waiting, _BATCH)):
        connection.execute(insert(model), batch)


def _copy(connection: Connection, model: type[Base], rows: Iterator[Row]) -> None:
    from psycopg import sql

    first = next(rows, None)
    if first is None:
        return

    def converter(column: str) -> Callable[[Any], Any]:
        of_type = model.__table__.c[column].type.dialect_impl(connection.dialect)
        if of_type.python_type is bytes:  # the driver's own wrapper is for parameters, not for COPY
            return bytes
        return of_type.bind_processor(connection.dialect) or (lambda value: value)

    names = sql.SQL(", ").join(map(sql.Identifier, first))
    command = sql.SQL("COPY {} ({}) FROM STDIN").format(sql.Identifier(model.__tablename__), names)
    converters, driver = [converter(name) for name in first], connection.connection
    # psycopg's own
    with driver.cursor() as cursor, cursor.copy(command) as copy:  # type: ignore[attr-defined]
        for row in chain([first], rows):
            copy.write_row(
                [convert(value) for convert, value in zip(converters, row.values(), strict=True)]
            )


def _analyse(store: Store) -> None:
    """What PostgreSQL's own service does soon after a large insert; and keys continue after those
    that were given."""
    if store.engine.dialect.name != "postgresql":
        return
    with store.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        for table in metadata.sorted_tables:
            if "id" in table.c:
                sequence = func.pg_get_serial_sequence(table.name, "id")
                connection.execute(
                    select(func.setval(sequence, func.coalesce(func.max(table.c.id), 0) + 1, False))
                )
        connection.exec_driver_sql("VACUUM ANALYZE")
