"""Small campaign folders of known content, for tests of the ingest: hits of known peak, width and
time."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

FS_HZ = 51_200.0
#: Time of the first hit in a record, and between hits: further apart than the extraction's
#: separation.
FIRST_HIT_S, BETWEEN_HITS_S = 0.05, 0.15

HAMMER_TOML = """\
[campaign]
name = "{name}"
kind = "hammer"
date = "2026-03-02"

[bench.hammer]
mass_kg = 0.32

[channels.force]
quantity = "force"
unit = "N"
position = "tip"
range = 10000.0
"""

GUN_TOML = """\
[campaign]
name = "{name}"
kind = "gun"
date = "2026-03-03"

[bench.gun]
tank_volume_m3 = 0.0095
bore_diameter_m = 0.049
projectile_diameter_m = 0.048
travel_m = 0.9
friction_coefficient = 1.4
heat_capacity_ratio = 1.4
efficiency = 0.5
"""

Row = Mapping[str, object]


@dataclass(frozen=True)
class Blow:
    """A hit as it was made: start (s), peak (N) and width at the foot (s) of a half-sine to the
    power 1.5."""

    start_s: float
    peak_n: float
    width_s: float


def blows(recording: int, hits: int) -> list[Blow]:
    """The hits of a recording: every peak of a campaign differs, so that mixed-up rows show."""
    return [
        Blow(
            FIRST_HIT_S + i * BETWEEN_HITS_S,
            1000.0 + 100.0 * recording + 10.0 * i,
            0.6e-3 + 0.1e-3 * (i % 3),
        )
        for i in range(hits)
    ]


def force_record(
    made: Sequence[Blow], rng: np.random.Generator, noise_n: float = 0.2
) -> NDArray[np.float32]:
    """Force (n,) in newtons at `FS_HZ`, long enough for the hits, at least 0.15 s."""
    time_s = (
        np.arange(round((FIRST_HIT_S + BETWEEN_HITS_S * max(1, len(made)) - 0.05) * FS_HZ)) / FS_HZ
    )
    force = noise_n * rng.standard_normal(time_s.size)
    for blow in made:
        phase = (time_s - blow.start_s) / blow.width_s
        inside = (phase > 0) & (phase < 1)
        force[inside] += blow.peak_n * np.sin(np.pi * phase[inside]) ** 1.5
    return force.astype(np.float32)


def write_recording(path: Path, channels: Mapping[str, NDArray[Any]], fs_hz: float = FS_HZ) -> None:
    """`.npz` or MATLAB 5, by the path's suffix."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npz":
        np.savez(path, fs=fs_hz, **channels)
        return
    from scipy.io import savemat

    savemat(path, {"fs": fs_hz, **channels}, do_compression=True)


def write_folder(
    folder: Path, toml: str, runs: str | Sequence[str], recordings: Mapping[str, Any]
) -> Path:
    """A new folder: campaign.toml, runs.csv as text or lines, and recordings by file name, .npz of
    these arrays."""
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(toml, encoding="utf-8")
    (folder / "runs.csv").write_text(
        runs if isinstance(runs, str) else "\n".join(runs) + "\n", encoding="utf-8"
    )
    for name, arrays in recordings.items():
        np.savez(folder / name, **arrays)
    return folder


def write_runs(folder: Path, rows: Sequence[Row], delimiter: str = ",") -> None:
    """`runs.csv` with the columns of the first row."""
    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]), delimiter=delimiter)
        writer.writeheader()
        writer.writerows(rows)


def recording_name(number: int) -> str:
    """Recordings come in two formats by turns."""
    return f"recordings/test-{number:02d}.{'npz' if number % 2 else 'mat'}"


def hammer_rows(recordings: int = 2, hits: int = 2) -> list[Row]:
    """One row per hit; the run is the recording, its repetitions are the hits."""
    tips = ("steel", "aluminum", "PLA")
    return [
        {
            "run": number,
            "repetition": i + 1,
            "tip_material": tips[number % 3],
            "tip_radius_mm": 5 * (1 + number % 4),
            "hammer_speed": "low",
            "recording": recording_name(number),
        }
        for number in range(1, recordings + 1)
        for i in range(hits)
    ]


def hammer_campaign(
    folder: Path, recordings: int = 2, hits: int = 2, name: str = "hammer", seed: int = 1
) -> Path:
    """A hammer campaign of `recordings` files with `hits` hits each, and a row for each hit."""
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(HAMMER_TOML.format(name=name), encoding="utf-8")
    for number in range(1, recordings + 1):
        force = force_record(blows(number, hits), np.random.default_rng([seed, number]))
        write_recording(folder / recording_name(number), {"force": force})
    write_runs(folder, hammer_rows(recordings, hits))
    return folder


def gun_rows(shots: int = 3) -> list[Row]:
    return [
        {
            "run": number,
            "repetition": 1,
            "bullet_mass_kg": 0.1428,
            "tank_pressure_bar": round(0.2 + 0.05 * number, 3),
            "tip_material": "PLA",
            "measured_velocity_m_s": 10.0 + number,
            "measured_velocity_u_m_s": 0.1,
        }
        for number in range(1, shots + 1)
    ]


def gun_campaign(folder: Path, shots: int = 3, name: str = "gun") -> Path:
    """A gun campaign whose lab wrote the velocities down: no recordings."""
    folder.mkdir(parents=True)
    (folder / "campaign.toml").write_text(GUN_TOML.format(name=name), encoding="utf-8")
    write_runs(folder, gun_rows(shots))
    return folder


def replace_in(path: Path, old: str, new: str) -> None:
    """Replace a text that must be there."""
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{old!r} is not in {path}"
    path.write_text(text.replace(old, new), encoding="utf-8")


def with_cell(rows: Sequence[Row], column: str, value: object, row: int = 0) -> list[Row]:
    """The rows with one cell changed; a column that is new is empty in the other rows."""
    return [{**r, column: value if i == row else r.get(column, "")} for i, r in enumerate(rows)]
