"""Stores with small hammer campaigns of known pulses and all thirteen predictors, for tests of
datasets."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from support.records.campaigns import (
    HAMMER_TOML,
    blows,
    force_record,
    recording_name,
    write_recording,
    write_runs,
)
from support.stores.stores import ingested

PLATE_TOML = """
[bench.plate]
material = "aluminum"
thickness_m = 0.01
outline_m = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.4], [0.0, 0.4]]
"""
#: tip, radius (mm), anvil, insulator, boundary conditions, impact position
CONFIGURATIONS = (
    ("aluminum", 30, "none", "none", "free", "#1"),
    ("delrin", 30, "steel", "polymeric", "fixed", "#1"),
    ("polyurethane", 15, "aluminum", "none", "free", "#1"),
    ("delrin", 30, "steel", "polymeric", "fixed", "#2"),
)
COLUMNS = (
    "tip_material",
    "tip_radius_mm",
    "anvil_material",
    "insulator",
    "boundary_conditions",
    "impact_position",
)
HITS = 5


def velocity(run: int, repetition: int) -> float:
    """Impact velocity (m/s) as the lab wrote it down: every one differs."""
    return round(0.5 + 0.1 * run + 0.01 * repetition, 3)


def rows_of(recordings: int, hits: int = HITS):
    return [
        {
            "run": run,
            "repetition": i,
            **dict(zip(COLUMNS, CONFIGURATIONS[(run - 1) % len(CONFIGURATIONS)], strict=True)),
            "impact_velocity_m_s": velocity(run, i),
            "recording": recording_name(run),
        }
        for run in range(1, recordings + 1)
        for i in range(1, hits + 1)
    ]


def full_campaign(
    folder: Path, name: str = "spring", recordings: int = 4, seed: int = 1, rows=None
) -> Path:
    """A campaign of one configuration per recording, `HITS` hits each."""
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(
        HAMMER_TOML.format(name=name) + PLATE_TOML, encoding="utf-8"
    )
    for run in range(1, recordings + 1):
        force = force_record(blows(run, HITS), np.random.default_rng([seed, run]))
        write_recording(folder / recording_name(run), {"force": force})
    write_runs(folder, rows if rows is not None else rows_of(recordings))
    return folder


def filled_store(folder: Path, *campaigns: Path) -> Path:
    """An SQLite file that has ingested these campaigns in this order."""
    folder.mkdir(parents=True, exist_ok=True)
    ingested(url_of(folder / "filled.db"), *campaigns)
    return folder / "filled.db"


def copied(store: Path, folder: Path) -> str:
    """The address of a copy that a test may change."""
    target = folder / "lab.db"
    for suffix in ("", "-wal", "-shm"):
        if Path(f"{store}{suffix}").is_file():
            shutil.copyfile(f"{store}{suffix}", f"{target}{suffix}")
    return url_of(target)


def url_of(path: Path) -> str:
    return f"sqlite:///{path}"
