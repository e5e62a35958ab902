"""A store of many campaigns, filled in bulk: what listings, and a laboratory of many years, are measured on."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

from pyroshock.ingest.settings import EXTRACTION_VERSION
from pyroshock.ingest.settings import ExtractionSettings as Settings
from pyroshock.schema.benches import Hammer, Plate, material_id
from pyroshock.schema.campaigns import Campaign, Configuration, ConfigurationLevel, Factor, FactorLevel
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact, Pulse
from pyroshock.schema.recordings import QualityFinding, RecordedChannel, Recording, SeriesChunk
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import Connection

from .bulk import Row, insert_rows, tidy
from .sampled import Sample

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


@dataclass(frozen=True)
class Crowd:
    """How many impacts, and what a store of them is like.

    `own_radii`: each campaign has configurations of its own, as campaigns do that were planned one by one; else all
    share those of one design. `sample`: pulses' curves, channels and series of recordings that were ingested, the
    series with every `series_every`-th recording; without it pulses have empty curves, and recordings no channels.
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


def fill(url: str, crowd: Crowd | int, analyse: bool = True) -> None:
    """A new store at `url` with so many impacts, their pulses, recordings and some findings."""
    crowd = Crowd(crowd) if isinstance(crowd, int) else crowd
    with open_store(url, Writer("benchmark", "0"), create=True) as store:
        with store.writing() as session:
            signed = store.written_by(session)
            aluminum = material_id(session, "aluminum")
        with store.engine.begin() as connection:
            insert_rows(connection, Hammer, [{"id": 1, "fingerprint": "hammer", "mass_kg": 0.32}], signed)
            insert_rows(connection, Plate, [_plate(aluminum)], signed)
            insert_rows(connection, ExtractionSettingsRow, [_settings()], signed)
            configurations, rare = _design(connection, crowd, signed)
            insert_rows(connection, Campaign, _campaigns(crowd), signed)
            insert_rows(connection, Recording, _recordings(crowd), signed)
            insert_rows(connection, RecordedChannel, _channels(crowd), signed)
            insert_rows(connection, SeriesChunk, _chunks(crowd), signed)
            insert_rows(connection, Impact, _impacts(crowd, configurations, rare), signed)
            insert_rows(connection, Pulse, _pulses(crowd), signed)
            insert_rows(connection, QualityFinding, _findings(crowd), signed)
        if analyse:
            tidy(store)


def _plate(material: int) -> Row:
    corners = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.4], [0.0, 0.4]]
    return {"id": 1, "fingerprint": "plate", "material_id": material, "thickness_m": 0.01, "outline_m": corners}


def _settings() -> Row:
    """Those that a campaign is ingested with: pages read them, and an ingest finds them."""
    settings = Settings()
    return {
        "id": 1,
        "fingerprint": settings.fingerprint,
        "code_version": EXTRACTION_VERSION,
        "settings": settings.as_json(),
    }


def _design(connection: Connection, crowd: Crowd, signed: int) -> tuple[list[list[int]], int]:
    """Keys of the configurations of each campaign (of one where they share them), which are all combinations of its
    levels, and of the one with the rare level."""
    factors = [{"id": i, "name": name, "si_unit": _unit(name)} for i, name in enumerate(DESIGN, 1)]
    key_of: dict[tuple[int, str | float], int] = {}
    combinations: list[tuple[str | float, ...]] = []
    groups: list[list[int]] = []
    for campaign in range(crowd.campaigns if crowd.own_radii else 1):
        own = [*product(*_levels(campaign).values())]
        groups.append(list(range(len(combinations) + 1, len(combinations) + len(own) + 1)))
        combinations += own
    combinations.append((RARE[1], *combinations[0][1:]))
    for combination in combinations:
        for choice in enumerate(combination, 1):
            key_of.setdefault(choice, len(key_of) + 1)
    levels = (
        {"id": key, "factor_id": factor, "label": str(value), "number": value if isinstance(value, float) else None}
        for (factor, value), key in key_of.items()
    )
    insert_rows(connection, Factor, factors, signed)
    insert_rows(connection, FactorLevel, levels, signed)
    keyed = list(enumerate(combinations, 1))
    insert_rows(connection, Configuration, ({"id": key, "fingerprint": f"{key:064d}"} for key, _ in keyed), signed)
    rows = (
        {"configuration_id": key, "level_id": key_of[choice], "factor_id": choice[0]}
        for key, combination in keyed
        for choice in enumerate(combination, 1)
    )
    insert_rows(connection, ConfigurationLevel, rows, signed)
    return groups, len(combinations)


def _levels(campaign: int) -> dict[str, tuple[str | float, ...]]:
    """The design's, its radii a micrometre further for each campaign."""
    return DESIGN | {"tip_radius": tuple(round(value + 1e-6 * campaign, 6) for value in _TIP_RADII_M)}


def _unit(factor: str) -> str | None:
    return "m" if factor == "tip_radius" else None


def campaign_name(number: int) -> str:
    return f"campaign-{number:04d}"


def _campaigns(crowd: Crowd) -> Iterator[Row]:
    common = {"kind": "hammer", "date": _WHEN.date(), "hammer_id": 1, "plate_id": 1}
    for key in range(1, crowd.campaigns + 1):
        yield {"id": key, "name": campaign_name(key), "fingerprint": str(key), **common}


def _recordings(crowd: Crowd) -> Iterator[Row]:
    for key in range(1, crowd.recordings + 1):
        yield {
            "id": key,
            "campaign_id": crowd.campaign_of(key * HITS_PER_RECORDING),
            "path": f"recordings/{key:06d}.mat",
            "sha256": f"{key:064d}",
            "size_bytes": 4_096_000,
            "format": "mat",
            "status": "stored",
        }


def _channels(crowd: Crowd) -> Iterator[Row]:
    if crowd.sample is None:
        return
    channels = crowd.sample.channels
    for recording in range(1, crowd.recordings + 1):
        for i, channel in enumerate(channels):
            key = (recording - 1) * len(channels) + i + 1
            yield {**channel.row, "id": key, "recording_id": recording, "sha256": f"{key:064x}"}


def _chunks(crowd: Crowd) -> Iterator[Row]:
    if crowd.sample is None:
        return
    channels = crowd.sample.channels
    for recording in range(crowd.series_every, crowd.recordings + 1, crowd.series_every):
        for i, channel in enumerate(channels):
            key = (recording - 1) * len(channels) + i + 1
            for number, frame in enumerate(channel.frames):
                yield {"channel_id": key, "number": number, "frame": frame}


def _impacts(crowd: Crowd, configurations: list[list[int]], rare: int) -> Iterator[Row]:
    per_campaign = crowd.per_campaign // HITS_PER_RECORDING
    for key in range(1, crowd.impacts + 1):
        recording = (key - 1) // HITS_PER_RECORDING
        common = configurations[(crowd.campaign_of(key) - 1) % len(configurations)]
        yield {
            "id": key,
            "campaign_id": crowd.campaign_of(key),
            "run": recording % per_campaign + 1,
            "repetition": (key - 1) % HITS_PER_RECORDING + 1,
            "configuration_id": rare if recording == 90 else common[recording % len(common)],
            "recording_id": recording + 1,
            "impact_velocity_m_s": 0.5 + key % 1000 / 1000,
            "impact_velocity_u_m_s": 0.001,
            "velocity_source": "integrated",
        }


def _pulses(crowd: Crowd) -> Iterator[Row]:
    """Pulses in use, their numbers in full; their curves are the sample's, or a few bytes that no listing reads."""
    bare = {"force_points_n": [], "fine_period_s": 2e-6, "fine_force_n": b""}
    curves = [bare] if crowd.sample is None else crowd.sample.curves
    for key in range(1, crowd.impacts + 1):
        share = key % 997 / 997
        yield {
            "id": key,
            "impact_id": key,
            "settings_id": 1,
            "current": True,
            "extracted_at": _WHEN,
            "start_s": 0.25 + (key - 1) % HITS_PER_RECORDING,
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
            **curves[key % len(curves)],
        }


def _findings(crowd: Crowd) -> Iterator[Row]:
    """A doubt about every hundredth impact, and about every fiftieth recording as a whole."""
    make: Callable[..., Row] = lambda **row: {"check": "few-samples", "severity": "warning", "message": "", **row}  # noqa: E731
    for key in range(100, crowd.impacts + 1, 100):
        yield make(recording_id=(key - 1) // HITS_PER_RECORDING + 1, impact_id=key, evidence={})
    for key in range(50, crowd.recordings + 1, 50):
        yield make(recording_id=key, impact_id=None, evidence={})
