"""Rows that are known by a hash of their content have that content: else two things would be taken
for one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

from sqlalchemy import Connection, Table, select

from ...benches import Gun, Hammer, Material, ModalTable, Mode, ModeShape, Plate
from ...campaigns import Configuration, ConfigurationLevel, Factor, FactorLevel
from ...impacts import ExtractionSettingsRow
from ...row_hashes import ROW_SHA256
from ...transactions import fingerprint_of
from ..findings import RESTORE, IntegrityFinding, Scope

_NOT_CONTENT = ("id", "fingerprint", "written_by_id", ROW_SHA256)


def check_fingerprints(connection: Connection, _: Scope) -> Iterator[IntegrityFinding]:
    """Configurations, parts of benches and extraction settings whose content is another than their
    fingerprint's."""
    yield from _hash_findings("configurations", _configurations(connection))
    for model in (Gun, Hammer):
        yield from _hash_findings(model.__tablename__, _parts(connection, model.__table__))  # type: ignore[arg-type]
    yield from _hash_findings("plates", _plates(connection))
    yield from _hash_findings("modal_tables", _modal_tables(connection))
    yield from _hash_findings("extraction_settings", _settings(connection))


def _hash_findings(
    table: str, rows: Iterable[tuple[int, str, object]]
) -> Iterator[IntegrityFinding]:
    for key, fingerprint, content in rows:
        computed = fingerprint_of(content)
        if computed != fingerprint:
            message = (
                f"its content has the fingerprint "
                f"{computed[:12]}…, its row says {fingerprint[:12]}…"
            )
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
        yield (
            key,
            fingerprint,
            sorted([row.name, row.label] for row in levels if row.name is not None),
        )


def _parts(connection: Connection, table: Table) -> Iterator[tuple[int, str, object]]:
    for row in connection.execute(select(table)).mappings():
        yield row["id"], row["fingerprint"], {k: v for k, v in row.items() if k not in _NOT_CONTENT}


def _plates(connection: Connection) -> Iterator[tuple[int, str, object]]:
    query = (
        select(
            Plate.id,
            Plate.fingerprint,
            ModalTable.fingerprint,
            Material.name,
            Plate.thickness_m,
            Plate.outline_m,
        )
        .outerjoin(ModalTable, Plate.modal_table_id == ModalTable.id)
        .outerjoin(Material, Plate.material_id == Material.id)
    )
    for key, fingerprint, *content in connection.execute(query):
        yield key, fingerprint, content


def _modal_tables(connection: Connection) -> Iterator[tuple[int, str, object]]:
    for key, fingerprint in connection.execute(select(ModalTable.id, ModalTable.fingerprint)).all():
        modes = connection.execute(
            select(Mode.__table__).where(Mode.table_id == key).order_by(Mode.id)
        ).all()
        yield key, fingerprint, [_mode(connection, mode) for mode in modes]


def _mode(connection: Connection, mode: Any) -> dict[str, Any]:
    shapes = select(ModeShape.channel, ModeShape.shape_per_sqrt_kg).where(
        ModeShape.mode_id == mode.id
    )
    return {
        "mode": mode.number,
        "frequency_hz": mode.frequency_hz,
        "damping_ratio": mode.damping_ratio,
        "shape_impact": mode.shape_impact_per_sqrt_kg,
        "shapes": dict(iter(connection.execute(shapes))),
    }


def _settings(connection: Connection) -> Iterator[tuple[int, str, object]]:
    columns = (
        ExtractionSettingsRow.id,
        ExtractionSettingsRow.fingerprint,
        ExtractionSettingsRow.code_version,
    )
    for key, fingerprint, *content in connection.execute(
        select(*columns, ExtractionSettingsRow.settings)
    ):
        yield key, fingerprint, content
