"""A store of many campaigns, filled in bulk: what listings are measured on."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterable, Iterator
from itertools import islice, product
from typing import Any

from pyroshock.schema.base import Base
from pyroshock.schema.campaigns import Campaign, Configuration, ConfigurationLevel, Factor, FactorLevel
from pyroshock.schema.impacts import ExtractionSettings, Impact, Pulse
from pyroshock.schema.quality import QualityFinding
from pyroshock.schema.recordings import Recording
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import Connection, insert

IMPACTS_PER_CAMPAIGN, HITS_PER_RECORDING = 1_800, 10
DESIGN: dict[str, tuple[str | float, ...]] = {
    "tip_material": ("aluminum", "steel", "delrin"),
    "tip_radius": (0.005, 0.01, 0.02, 0.03, 0.04),
    "anvil_material": ("none", "aluminum", "steel"),
    "hammer_speed": ("low", "high"),
    "boundary_conditions": ("free", "fixed"),
}
#: A level that one recording of the first campaign has, and no other.
RARE = ("tip_material", "polyurethane")
_BATCH = 20_000
_WHEN = dt.datetime(2026, 11, 1, tzinfo=dt.UTC)

Row = dict[str, Any]


def fill(url: str, impacts: int, analyse: bool = True) -> None:
    """A new store at `url` with `impacts` impacts, their pulses, recordings and some findings."""
    with open_store(url, Writer("benchmark", "0"), create=True) as store:
        with store.writing() as session:
            signed = store.written_by(session)
        with store.engine.begin() as connection:
            configurations = _design(connection, signed)
            _insert(connection, ExtractionSettings, _settings(), signed)
            _insert(connection, Campaign, _campaigns(impacts), signed)
            _insert(connection, Recording, _recordings(impacts), signed)
            _insert(connection, Impact, _impacts(impacts, configurations), signed)
            _insert(connection, Pulse, _pulses(impacts), signed)
            _insert(connection, QualityFinding, _findings(impacts), signed)
        if analyse:
            _analyse(store)


def _analyse(store: Store) -> None:
    """What PostgreSQL's own service does within a minute of a large insert, and SQLite never does."""
    if store.engine.dialect.name == "postgresql":
        with store.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
            connection.exec_driver_sql("VACUUM ANALYZE")


def _insert(connection: Connection, model: type[Base], rows: Iterable[Row], signed: int) -> None:
    waiting: Iterator[Row] = ({**row, "written_by_id": signed} for row in rows)
    while batch := list(islice(waiting, _BATCH)):
        connection.execute(insert(model), batch)


def _design(connection: Connection, signed: int) -> list[int]:
    """All combinations of the levels, and one with the rare level; keys of the configurations."""
    factors = [{"id": i, "name": name, "si_unit": _unit(name)} for i, name in enumerate(DESIGN, 1)]
    choices = [(i, value) for i, values in enumerate(DESIGN.values(), 1) for value in values] + [(1, RARE[1])]
    levels = [
        {"id": key, "factor_id": factor, "label": str(value), "number": value if isinstance(value, float) else None}
        for key, (factor, value) in enumerate(choices, 1)
    ]
    key_of = {choice: key for key, choice in enumerate(choices, 1)}
    combinations = list(product(*DESIGN.values()))
    combinations.append((RARE[1], *combinations[0][1:]))
    _insert(connection, Factor, factors, signed)
    _insert(connection, FactorLevel, levels, signed)
    keys = range(1, len(combinations) + 1)
    _insert(connection, Configuration, ({"id": key, "fingerprint": f"{key:064d}"} for key in keys), signed)
    rows = (
        {"configuration_id": key, "level_id": key_of[i, value], "factor_id": i}
        for key, combination in zip(keys, combinations, strict=True)
        for i, value in enumerate(combination, 1)
    )
    _insert(connection, ConfigurationLevel, rows, signed)
    return list(keys)


def _unit(factor: str) -> str | None:
    return "m" if factor == "tip_radius" else None


def campaign_name(number: int) -> str:
    return f"campaign-{number:04d}"


def _campaigns(impacts: int) -> Iterator[Row]:
    for key in range(1, -(-impacts // IMPACTS_PER_CAMPAIGN) + 1):
        yield {"id": key, "name": campaign_name(key), "kind": "hammer", "date": _WHEN.date(), "fingerprint": str(key)}


def _campaign_of(impact: int) -> int:
    return (impact - 1) // IMPACTS_PER_CAMPAIGN + 1


def _recordings(impacts: int) -> Iterator[Row]:
    for key in range(1, impacts // HITS_PER_RECORDING + 1):
        campaign = _campaign_of(key * HITS_PER_RECORDING)
        yield {
            "id": key,
            "campaign_id": campaign,
            "path": f"recordings/{key:06d}.mat",
            "sha256": f"{key:064d}",
            "size_bytes": 4_096_000,
            "format": "mat",
            "status": "stored",
        }


def _impacts(impacts: int, configurations: list[int]) -> Iterator[Row]:
    *common, rare = configurations
    for key in range(1, impacts + 1):
        recording = (key - 1) // HITS_PER_RECORDING
        yield {
            "id": key,
            "campaign_id": _campaign_of(key),
            "run": recording % (IMPACTS_PER_CAMPAIGN // HITS_PER_RECORDING) + 1,
            "repetition": (key - 1) % HITS_PER_RECORDING + 1,
            "configuration_id": rare if recording == 90 else common[recording % len(common)],
            "recording_id": recording + 1,
            "impact_velocity_m_s": 0.5 + key % 1000 / 1000,
            "impact_velocity_u_m_s": 0.001,
            "velocity_source": "integrated",
        }


def _settings() -> list[Row]:
    return [{"id": 1, "fingerprint": "0" * 64, "code_version": 1, "settings": {}}]


def _pulses(impacts: int) -> Iterator[Row]:
    """Pulses in use: their numbers in full, their curves as a few bytes, which no listing reads."""
    for key in range(1, impacts + 1):
        share = key % 997 / 997
        yield {
            "id": key,
            "impact_id": key,
            "settings_id": 1,
            "current": True,
            "extracted_at": _WHEN,
            "start_s": 0.25,
            "contact_time_s": 3e-4 + 1e-3 * share,
            "compression_time_s": 1.5e-4 + 5e-4 * share,
            "peak_force_n": 1000.0 + 2000.0 * share,
            "spline_peak_force_n": 1000.0 + 2000.0 * share,
            "impulse_n_s": 0.5 + share,
            "compression_impulse_n_s": 0.25 + share / 2,
            "width_half_s": 2e-4,
            "width_tenth_s": 3e-4,
            "samples_in_contact": 20,
            "spline_nrmse": 0.001,
            "segmentation_difference": 0.05,
            "force_points_n": [],
            "fine_period_s": 2e-6,
            "fine_force_n": b"",
        }


def _findings(impacts: int) -> Iterator[Row]:
    """A doubt about every hundredth impact, and about every fiftieth recording as a whole."""
    make: Callable[..., Row] = lambda **row: {"check": "few-samples", "severity": "warning", "message": "", **row}  # noqa: E731
    for key in range(100, impacts + 1, 100):
        yield make(recording_id=(key - 1) // HITS_PER_RECORDING + 1, impact_id=key, evidence={})
    for key in range(50, impacts // HITS_PER_RECORDING + 1, 50):
        yield make(recording_id=key, impact_id=None, evidence={})
