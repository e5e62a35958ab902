"""Campaign folders with force and accelerations on a small plate, and records of the same, each
played by its modes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration, Series
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.response import respond

from support.records.campaigns import (
    FS_HZ,
    Blow,
    Row,
    blows,
    force_record,
    write_recording,
    write_runs,
)

MODES_HZ = np.array([310.0, 640.0, 1130.0, 1900.0, 2800.0, 4100.0])
CHANNELS = ("acceleration_1", "acceleration_2")

CARD = """\
[campaign]
name = "{name}"
kind = "hammer"
date = "2026-03-04"

[bench.hammer]
mass_kg = 0.32

[bench.plate]
modes = "plate_modes.csv"
"""
CHANNEL = """
[channels.{name}]
quantity = "{quantity}"
unit = "{unit}"
"""


def small_plate() -> ModalPlate:
    """Six modes; the second sensor stands where odd modes have the other sign."""
    shape = np.array([0.30, -0.25, 0.40, 0.35, -0.30, 0.20])
    return ModalPlate(
        frequency_hz=MODES_HZ,
        damping_ratio=np.full(6, 0.01),
        shape_impact=np.full((1, 6), 0.4),
        shapes=np.array([shape, shape * np.array([-0.6, 1.2, -1.0, 0.3, -1.4, 0.9])]),
        impact_points=("#1",),
        sensors=CHANNELS,
    )


@dataclass(frozen=True)
class PlateCampaign:
    """A folder, what was written into its recordings, and when each was hit."""

    folder: Path
    written: Mapping[int, Mapping[str, NDArray[np.float32]]]
    blows: Mapping[int, Sequence[Blow]]


def plate_campaign(
    folder: Path,
    *,
    recordings: int = 3,
    hits: int = 2,
    cells: int = 1,
    sign: int = 1,
    clip: Mapping[str, float] | None = None,
    with_force: bool = True,
) -> PlateCampaign:
    """Recordings of `hits` hits each; the force is shared by `cells` cells. No velocities. `clip`:
    rails by channel.

    Without `with_force` the plate is hit alike, and no force is recorded.
    """
    folder.mkdir(parents=True)
    forces = [f"force_{i + 1}" for i in range(cells)] if cells > 1 else ["force"]
    forces = forces if with_force else []
    card = CARD.format(name="plate") + "".join(
        CHANNEL.format(name=n, quantity="force", unit="N") for n in forces
    )
    card += "".join(CHANNEL.format(name=n, quantity="acceleration", unit="m/s2") for n in CHANNELS)
    (folder / "campaign.toml").write_text(card, encoding="utf-8")
    write_modes(folder / "plate_modes.csv", small_plate())
    written = {}
    for number in range(1, recordings + 1):
        force = force_record(blows(number, hits), np.random.default_rng([3, number])).astype(
            np.float64
        )
        felt = respond(small_plate(), force, 1 / FS_HZ)
        shares = np.arange(1, cells + 1) / np.arange(1, cells + 1).sum()
        channels = {name: sign * s * force for name, s in zip(forces, shares, strict=False)}
        channels |= dict(zip(CHANNELS, felt, strict=True))
        for name, rail in (clip or {}).items():
            channels[name] = np.clip(channels[name], -rail, rail)
        written[number] = {name: values.astype(np.float32) for name, values in channels.items()}
        write_recording(folder / f"{number}.npz", written[number])
    write_runs(folder, [row for number in range(1, recordings + 1) for row in _rows(number, hits)])
    return PlateCampaign(folder, written, {number: blows(number, hits) for number in written})


def _rows(number: int, hits: int) -> list[Row]:
    fixed = {"tip_material": "steel", "plate_material": "aluminum", "impact_position": "#1"}
    return [
        {
            "run": number,
            "repetition": i + 1,
            "tip_radius_mm": 10 * number,
            **fixed,
            "recording": f"{number}.npz",
        }
        for i in range(hits)
    ]


def write_modes(path: Path, plate: ModalPlate) -> None:
    """`plate_modes.csv`."""
    lines = [
        "mode,frequency_hz,damping_ratio,shape_impact,"
        + ",".join(f"shape_{name}" for name in plate.sensors)
    ]
    for i, frequency in enumerate(plate.frequency_hz):
        numbers = (frequency, plate.damping_ratio[i], plate.shape_impact[0, i], *plate.shapes[:, i])
        lines.append(f"{i + 1}," + ",".join(f"{number:.12g}" for number in numbers))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def plate_record(
    true: ModalPlate | None = None, *, noise: float = 0.001, seed: int = 0
) -> CampaignRecord:
    """Half-sine forces of four durations; the record believes in `small_plate`, the bench has
    `true`."""
    rng, rate = np.random.default_rng(seed), 51_200.0
    time = np.arange(-64, round(0.05 * rate)) / rate
    runs = []
    for order in range(8):
        width = 1e-3 * (0.3 + 0.2 * (order // 2))
        force = 1000 * np.where((time > 0) & (time < width), np.sin(np.pi * time / width), 0.0)
        felt = respond(true or small_plate(), force, 1 / rate)
        shown = [
            row + noise * np.abs(row).max() * rng.standard_normal(row.size)
            for row in (force, *felt)
        ]
        series = [Series(values, rate, float(time[0])) for values in shown]
        accelerations = dict(zip(CHANNELS, series[1:], strict=True))
        runs.append(
            Run(order // 2, order + 1, 1, order, force=series[0], accelerations=accelerations)
        )
    configurations = tuple(
        RunConfiguration(f"pulse {i}", {"impact_position": "#1", "pulse": float(i)})
        for i in range(4)
    )
    return CampaignRecord("plate", "hammer", configurations, tuple(runs), plate=small_plate())
