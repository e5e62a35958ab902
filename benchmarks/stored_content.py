"""What the ways of storing are given, the same for all: recordings with factors, series and cut pulses, in memory."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.folder import CampaignFile, read_campaign_file
from pyroshock.ingest.processing import ProcessedRecording, process_recording, read_channels
from pyroshock.ingest.runs import MatchedImpact, RunRow, expected_hits, match, read_runs
from pyroshock.ingest.settings import ExtractionSettings
from pyroshock.signals.channel import Channel

Samples = NDArray[np.float32]
#: A factor of every recording, by a level of which pulses are asked for.
FACTOR = "tip_material"


@dataclass(frozen=True)
class Struck:
    """One impact: figures in SI, and which pulse of the recording's it is."""

    repetition: int
    velocity_m_s: float
    start_s: float
    contact_time_s: float
    peak_force_n: float
    impulse_n_s: float


@dataclass(frozen=True, eq=False)
class Recorded:
    """One recording. `series` by channel (n,); `pulses` (m,) N of its impacts, in their order."""

    path: str
    run: int
    rate_hz: float
    factors: dict[str, str | float]
    series: dict[str, Samples]
    impacts: tuple[Struck, ...]
    pulses: tuple[NDArray[np.float64], ...]


@dataclass(frozen=True, eq=False)
class Cut:
    """The same as our own ingest holds it when it comes to storing: the channels, and what was worked out of them."""

    channels: tuple[Channel, ...]
    done: ProcessedRecording
    hits: list[MatchedImpact]


@dataclass(frozen=True, eq=False)
class Content:
    file: CampaignFile
    rows: tuple[RunRow, ...]
    settings: ExtractionSettings
    cut: tuple[Cut, ...]
    recorded: tuple[Recorded, ...]

    @property
    def bytes(self) -> int:
        """Of all series and pulses, as they are in memory."""
        series = sum(x.nbytes for one in self.recorded for x in one.series.values())
        return series + sum(x.nbytes for one in self.recorded for x in one.pulses)

    def pulses(self, level: str) -> list[NDArray[np.float64]]:
        """Of all impacts with a level of `FACTOR`."""
        return [pulse for one in self.recorded if one.factors[FACTOR] == level for pulse in one.pulses]


def content_of(folder: Path) -> Content:
    """Of a campaign folder with a recording a run, each read, judged and cut as an ingest does."""
    file = read_campaign_file(folder)
    rows = read_runs(folder, file.kind, lambda name: name)
    settings = ExtractionSettings()
    cut = tuple(_cut(folder, file, rows, row, settings) for row in rows)
    return Content(file, rows, settings, cut, tuple(map(_recorded, rows, cut)))


def _cut(folder: Path, file: CampaignFile, rows: tuple[RunRow, ...], row: RunRow, settings: ExtractionSettings) -> Cut:
    path = str(row.recording)
    channels, _ = read_channels(folder / path, file.sensors)
    done = process_recording(folder, path, file.sensors, settings, expected=expected_hits([row], rows))
    # The series are encoded when they are stored: that is part of what is measured.
    return Cut(tuple(channels), replace(done, series=()), match(path, [row], len(done.pulses), rows))


def _recorded(row: RunRow, cut: Cut) -> Recorded:
    factors = {level.factor: level.label if level.number is None else level.number for level in row.levels}
    impacts = []
    for number, (pulse, speed) in enumerate(zip(cut.done.pulses, cut.done.speeds, strict=True), row.repetition):
        velocity = speed.velocity_m_s if speed else float("nan")
        figures = (pulse.start_s, pulse.contact_time_s, pulse.peak_force_n, pulse.impulse_n_s)
        impacts.append(Struck(number, velocity, *figures))
    return Recorded(
        path=str(row.recording),
        run=row.run,
        rate_hz=cut.channels[0].sampling_rate_hz,
        factors=factors,
        series={channel.name: channel.recorded for channel in cut.channels},
        impacts=tuple(impacts),
        pulses=tuple(pulse.fine_force_n for pulse in cut.done.pulses),
    )


def written(content: Content, folder: Path) -> Path:
    """The recordings as plain arrays with an index, for a program that imports nothing of ours."""
    folder.mkdir(parents=True, exist_ok=True)
    index: list[dict[str, Any]] = []
    for one in content.recorded:
        pulses = {f"pulse_{i}": pulse for i, pulse in enumerate(one.pulses)}
        np.savez(folder / f"{one.run}.npz", **one.series, **pulses)  # type: ignore[arg-type]  # takes them all by name
        index.append({"run": one.run, "path": one.path, "rate_hz": one.rate_hz, "factors": one.factors,
                      "channels": list(one.series), "impacts": [asdict(hit) for hit in one.impacts]})  # fmt: skip
    (folder / "index.json").write_text(json.dumps(index))
    return folder
