"""Rows that are known by a hash of their content have that content: else two things would be taken for one. The figures
of impacts, shots and acceleration channels are those that were written."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from typing import Any

from sqlalchemy import Connection, Table, select

from ... import figures
from ...base import from_plain
from ...benches import Gun, Hammer, Material, ModalTable, Mode, ModeShape, Plate
from ...campaigns import Campaign, Configuration, ConfigurationLevel, Factor, FactorLevel
from ...impacts import ChannelFigures, ExtractionSettingsRow, Impact, Shot
from ...recordings import RecordedChannel
from ...rows import stored_columns
from ...tables import metadata
from ...transactions import fingerprint_of
from ..findings import RESTORE, IntegrityFinding, Scope

_NOT_CONTENT = ("id", "fingerprint", "written_by_id")


def check_fingerprints(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Configurations, parts of benches and extraction settings whose content is another than their fingerprint's."""
    yield from _hash_findings("configurations", _configurations(connection))
    for model in (Gun, Hammer):
        yield from _hash_findings(model.__tablename__, _parts(connection, model.__table__))  # type: ignore[arg-type]
    yield from _hash_findings("plates", _plates(connection))
    yield from _hash_findings("modal_tables", _modal_tables(connection))
    yield from _hash_findings("extraction_settings", _settings(connection))


def _hash_findings(table: str, rows: Iterable[tuple[int, str, object]]) -> Iterator[IntegrityFinding]:
    for key, fingerprint, content in rows:
        computed = fingerprint_of(content)
        if computed != fingerprint:
            message = f"its content has the fingerprint {computed[:12]}…, its row says {fingerprint[:12]}…"
            yield IntegrityFinding("fingerprints", message, RESTORE, {"table": table, "row": key})


def _configurations(connection: Connection) -> Iterator[tuple[int, str, object]]:
    query = (
        select(Configuration.id, Configuration.fingerprint, Factor.name, FactorLevel.label)
        .outerjoin(ConfigurationLevel, ConfigurationLevel.configuration_id == Configuration.id)
        .outerjoin(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .outerjoin(Factor, FactorLevel.factor_id == Factor.id)
        .order_by(Configuration.id)
    )
    rows = connection.execute(query, execution_options={"yield_per": 1000})
    for (key, fingerprint), levels in groupby(rows, key=lambda row: (row.id, row.fingerprint)):
        yield key, fingerprint, sorted([row.name, row.label] for row in levels if row.name is not None)


def _parts(connection: Connection, table: Table) -> Iterator[tuple[int, str, object]]:
    for row in connection.execute(select(table)).mappings():
        yield row["id"], row["fingerprint"], {k: v for k, v in row.items() if k not in _NOT_CONTENT}


def _plates(connection: Connection) -> Iterator[tuple[int, str, object]]:
    query = (
        select(Plate.id, Plate.fingerprint, ModalTable.fingerprint, Material.name, Plate.thickness_m, Plate.outline_m)
        .outerjoin(ModalTable, Plate.modal_table_id == ModalTable.id)
        .outerjoin(Material, Plate.material_id == Material.id)
    )
    for key, fingerprint, *content in connection.execute(query):
        yield key, fingerprint, content


def _modal_tables(connection: Connection) -> Iterator[tuple[int, str, object]]:
    for key, fingerprint in connection.execute(select(ModalTable.id, ModalTable.fingerprint)).all():
        modes = connection.execute(select(Mode.__table__).where(Mode.table_id == key).order_by(Mode.id)).all()
        yield key, fingerprint, [_mode(connection, mode) for mode in modes]


def _mode(connection: Connection, mode: Any) -> dict[str, Any]:
    shapes = select(ModeShape.channel, ModeShape.shape_per_sqrt_kg).where(ModeShape.mode_id == mode.id)
    return {
        "mode": mode.number,
        "frequency_hz": mode.frequency_hz,
        "damping_ratio": mode.damping_ratio,
        "shape_impact": mode.shape_impact_per_sqrt_kg,
        "shapes": dict(iter(connection.execute(shapes))),
    }


def _settings(connection: Connection) -> Iterator[tuple[int, str, object]]:
    columns = (ExtractionSettingsRow.id, ExtractionSettingsRow.fingerprint, ExtractionSettingsRow.code_version)
    for key, fingerprint, *content in connection.execute(select(*columns, ExtractionSettingsRow.settings)):
        yield key, fingerprint, content


_PAGE = 2000
_OF: tuple[tuple[type[Impact] | type[Shot], tuple[str, ...]], ...] = ((Impact, figures.IMPACT), (Shot, figures.SHOT))
#: Are read as they are stored: a text that need not be JSON.
_LISTS = ("force_points_n", "srs_frequency_hz", "srs_maximax_m_s2")


def check_figures(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Impacts, shots and acceleration channels whose figures (velocities, pressures, masses, peaks) have another
    SHA-256 than the recorded one."""
    for table, columns in _OF:
        own = [getattr(table, name) for name in ("id", "figures_sha256", *columns)]
        query = select(Campaign.name.label("campaign"), *own).join(Campaign, table.campaign_id == Campaign.id)
        rows = scope.iter_rows(connection, query, table.campaign_id, table.id, _PAGE)
        yield from _altered(rows, columns, table.__tablename__)
    channels = metadata.tables[ChannelFigures.__tablename__]
    wanted = ("id", "figures_sha256", *figures.CHANNEL)
    own = [column for column in stored_columns(channels) if column.name in wanted]
    place = (Campaign.name.label("campaign"), Impact.run, Impact.repetition, RecordedChannel.name.label("channel"))
    query = select(*place, *own).join_from(channels, Impact, channels.c.impact_id == Impact.id)
    query = query.join(Campaign, Impact.campaign_id == Campaign.id)
    query = query.join(RecordedChannel, channels.c.channel_id == RecordedChannel.id)
    rows = scope.iter_rows(connection, query, Impact.campaign_id, channels.c.id, _PAGE)
    yield from _altered(rows, figures.CHANNEL, channels.name)


def _altered(rows: Iterable[Any], columns: tuple[str, ...], table: str) -> Iterator[IntegrityFinding]:
    for row in rows:
        figures_of_row = dict(row._mapping)
        problem = figures_problem(figures_of_row, columns)
        if problem is not None:
            names = [name for name in ("campaign", "run", "repetition", "channel") if name in figures_of_row]
            place = {name: figures_of_row[name] for name in names}
            yield IntegrityFinding("figures", problem, RESTORE, {**place, "table": table})


def figures_problem(row: Mapping[str, Any], columns: tuple[str, ...]) -> str | None:
    """What is wrong with the figures of a row beside their SHA-256; None where they are those that were written."""
    recorded = row["figures_sha256"]
    if recorded is None:
        return "its row does not say the SHA-256 of its figures"
    computed_hash = figures.figures_hash(_decoded(row), columns)
    if computed_hash == recorded:
        return None
    return f"a figure was altered: its figures have the SHA-256 {computed_hash[:12]}…, its row says {recorded[:12]}…"


def _decoded(row: Mapping[str, Any]) -> Mapping[str, Any]:
    decoded = dict(row)
    for name in _LISTS:
        try:
            decoded[name] = from_plain(json.loads(row[name]))
        except (KeyError, TypeError, ValueError):
            continue
    return decoded
