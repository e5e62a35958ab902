"""The start of a campaign folder: a commented `campaign.toml` and a `runs.csv`, to be filled in and
ingested.

What a person must write is marked with `FILL_IN`, which the ingest refuses wherever it stands; what
was found in recordings and may be otherwise is marked with `PLEASE_CHECK`.
"""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ...files.spreadsheet_guard import GuardedCsv
from ...signals.units import SI_UNITS, UnitError, to_si
from ..errors import IngestError, enumerated
from ..readers import AS_IN_FILE, ReadingOptions, RecordingError, all_readers, open_recording
from ..readers.contents import one_line
from ..readers.recording_files import recording_path
from .campaign_file import FILE as CAMPAIGN
from .runs_table import FILES

FILL_IN, PLEASE_CHECK = "FILL IN", "# please check"
#: `drop` stands for accelerometers alone, without an instrumented hammer.
GUN, HAMMER, DROP = ("gun", "hammer", "drop")
#: What `[campaign]` calls each.
KIND_OF_START = {GUN: "gun", HAMMER: "hammer", DROP: "hammer"}

_LAYERS = (
    "plate_material",
    "anvil_material",
    "insulator",
    "boundary_conditions",
    "impact_position",
)
_COLUMNS: dict[str, tuple[str, ...]] = {
    GUN: (
        "bullet_mass_kg",
        "tank_pressure_bar",
        "tip_material",
        "tip_radius_mm",
        *_LAYERS,
        "measured_velocity_m_s",
    ),
    HAMMER: ("tip_material", "tip_radius_mm", *_LAYERS, "hammer_speed", "impact_velocity_m_s"),
    DROP: ("tip_material", "tip_radius_mm", *_LAYERS, "impact_velocity_m_s"),
}
_BENCH: dict[str, tuple[tuple[str, str], ...]] = {
    GUN: (
        ("tank_volume_m3", "volume of the tank"),
        ("bore_diameter_m", "inner diameter of the barrel"),
        ("projectile_diameter_m", "at most the bore"),
        ("travel_m", "from rest to the vent holes"),
        ("friction_coefficient", "of the nominal model, zero or more"),
        ("heat_capacity_ratio", "1.4 for air"),
        ("efficiency", "above 0, at most 1"),
    ),
    HAMMER: (("mass_kg", "nominal effective mass of the hammer"),),
}
_HEAD = f"""\
# Written by pyroshock campaigns init. Replace every "{FILL_IN}", here and in runs.csv, \
look at the lines that say
# "please check", and try it: pyroshock ingest FOLDER --dry-run. \
docs/reference/campaigns.md says what each key means.
"""


@dataclass
class _RecordedChannel:
    """A channel by what the recordings say of it."""

    files: int = 0
    units: Counter[str] = field(default_factory=Counter)
    rates_hz: Counter[float] = field(default_factory=Counter)


@dataclass(frozen=True)
class NewFolder:
    """The texts of the two files, and what a person should know of how they came about."""

    campaign: str
    runs: str
    notes: tuple[str, ...]

    def write(self, folder: Path) -> None:
        """Write both into `folder`. Raises `IngestError` where one of them is there, and
        `OSError`."""
        folder.mkdir(parents=True, exist_ok=True)
        there = [name for name in (CAMPAIGN, *FILES) if (folder / name).exists()]
        if there:
            raise IngestError(
                f"{folder}: {' and '.join(there)} there already; nothing is overwritten"
            )
        for name, text in ((CAMPAIGN, self.campaign), (FILES[0], self.runs)):
            with (folder / name).open("x", encoding="utf-8", newline="") as file:
                file.write(text)


#: To see the channels of a recording that states no sampling rate.
_ANY_RATE = ReadingOptions(sampling_rate_hz=1.0)


def start_folder(
    folder: Path, start: str, recordings: str | None = None, rows: Sequence[Mapping[str, str]] = ()
) -> NewFolder:
    """The files of a new campaign in `folder`, `start` is "gun", "hammer" or "drop".

    `rows` are those of a plan, with run, repetition and factors by column; without any, each
    recording has one. `recordings` is a pattern or a folder within `folder`; a plan's recordings
    stand in its order, one for each run or for each row. Raises `IngestError` where nothing is
    found to begin with, and where the numbers do not agree.
    """
    paths = _recordings(folder, recordings) if recordings is not None or not rows else []
    if not rows and not paths:
        raise IngestError(
            f"{folder}: no recording found; name a plan, or where the "
            f"recordings lie within the folder"
        )
    channels: dict[str, _RecordedChannel] = {}
    usable, without_clock, notes = [], 0, []
    for path in paths:
        try:
            without_clock += _add_channels(folder / path, channels)
            usable.append(path)
        except RecordingError as error:
            notes.append(f"{path} is left out: {one_line(error)}")
    if paths and not usable:
        raise IngestError(f"{folder}: no usable recording; {notes[0]}")
    campaign = _campaign(folder.resolve().name, start, channels, len(usable), without_clock)
    return NewFolder(campaign, _runs(start, rows, usable), tuple(notes))


def _recordings(folder: Path, pattern: str | None) -> list[str]:
    """Paths within the folder, sorted. Raises `IngestError` for a pattern that leaves the
    folder."""
    text = (pattern or ".").replace("\\", "/")
    if Path(text).is_absolute() and Path(text).resolve().is_relative_to(folder.resolve()):
        text = Path(text).resolve().relative_to(folder.resolve()).as_posix()
    if Path(text).is_absolute() or ".." in Path(text).parts:
        raise IngestError(
            f"--recordings is {pattern!r}; expected a pattern or a folder within {folder}"
        )
    suffixes = {suffix for reader in all_readers() for suffix in reader.suffixes}
    place = folder / text
    if not folder.is_dir():  # it is made with the files of the campaign
        return []
    try:
        files = place.rglob("*") if place.is_dir() else folder.glob(text)
        names = sorted(file.relative_to(folder).as_posix() for file in files if file.is_file())
        return [recording_path(folder, name) for name in names if _may_be_recording(name, suffixes)]
    except ValueError as error:
        raise IngestError(f"--recordings is {pattern!r}; expected {error}") from error


def _may_be_recording(name: str, suffixes: Iterable[str]) -> bool:
    return Path(name).suffix.lower() in suffixes and name not in (*FILES, "plate_modes.csv")


def _add_channels(path: Path, channels: dict[str, _RecordedChannel]) -> bool:
    """Note the channels of a recording; whether it states no sampling rate, which campaign.toml has
    to give then."""
    try:
        _add_channels_as(path, channels, AS_IN_FILE)
    except RecordingError as error:
        try:
            _add_channels_as(path, channels, _ANY_RATE)
        except RecordingError:
            raise error from None
        return True
    return False


def _add_channels_as(
    path: Path, channels: dict[str, _RecordedChannel], reading: ReadingOptions
) -> None:
    with open_recording(path, reading) as recording:
        for info in recording.channels:
            channel = channels.setdefault(info.name, _RecordedChannel())
            channel.files += 1
            if reading is not _ANY_RATE:
                channel.rates_hz[info.sampling_rate_hz] += 1
            if info.unit and info.unit.strip():
                channel.units[info.unit.strip()] += 1


def _campaign(
    name: str, start: str, channels: Mapping[str, _RecordedChannel], files: int, without_clock: int
) -> str:
    about_kind = (
        "  # accelerometers alone: kind hammer without [bench.hammer]" if start == DROP else ""
    )
    lines = [
        f"{_HEAD}\n[campaign]\nname = {_toml(name)}  {PLEASE_CHECK}\nkind = "
        f'"{KIND_OF_START[start]}"{about_kind}',
        f'date = "{FILL_IN}"  # such as 2026-11-01\n# description = ""\n# operator = ""\n',
    ]
    if start in _BENCH:
        lines += [
            f"[bench.{start}]",
            *(f'{key} = "{FILL_IN}"  # {about}' for key, about in _BENCH[start]),
            "",
        ]
    lines += [
        "# [bench.plate]",
        '# modes = "plate_modes.csv"  # a modal table; or material, thickness_m and outline_m:',
        '# material = "steel"\n# thickness_m = 0.01\n# outline_m = [[0, 0], '
        "[0.3, 0], [0.3, 0.3], [0, 0.3]]\n",
    ]
    if without_clock:
        lines += [
            f"[recordings]  # {without_clock} of {files} recordings state no sampling rate",
            f'sampling_rate_hz = "{FILL_IN}"  # such as 51200, without quotes',
            "# columns = [...]  # names of all columns in order, where the recordings have none\n",
        ]
    expected = (
        {"acceleration": _RecordedChannel()} if start == DROP else {"force": _RecordedChannel()}
    )
    for channel, recorded in (channels or expected).items():
        lines += [_channel(channel, recorded, files), ""]
    return "\n".join(lines)


def _channel(name: str, recorded: _RecordedChannel, files: int) -> str:
    unit = next(iter(recorded.units)) if len(recorded.units) == 1 else None
    quantity = _quantity(name, unit)
    is_unit = _is_unit(unit, quantity)
    lines = [f"[channels.{_toml(name)}]  # the name as in the recordings"]
    if files:
        rates = enumerated([f"{rate:.12g} Hz" for rate in sorted(recorded.rates_hz)])
        lines.append(
            f"# in {recorded.files} of {files} recordings, at "
            f"{rates or 'a rate that they do not state'}"
        )
    if len(recorded.units) > 1:
        lines.append(
            f"# the recordings say {enumerated([one_line(text) for text in recorded.units])}"
        )
    elif unit is not None and not is_unit:
        lines.append(f"# the recordings say {one_line(unit)}, which is no unit that is known")
    if unit == "V":
        lines.append("# volts of a sensor: state its sensitivity, with its own quantity and unit")
    lines += [
        f'quantity = "{quantity or FILL_IN}"  '
        f"{PLEASE_CHECK if quantity else '# one of ' + ', '.join(SI_UNITS)}",
        f"unit = {_toml(unit)}  {PLEASE_CHECK}" if unit and is_unit else f'unit = "{FILL_IN}"',
        "# sensitivity = 0.01  # volt per unit, where the recordings hold volts",
        '# position = "tip"',
        "# range = 1000  # full scale, in unit",
    ]
    return "\n".join(lines)


def _quantity(name: str, unit: str | None) -> str | None:
    """By the unit; where the recordings state none, by the beginning of the channel's name."""
    if unit is not None:
        return next((quantity for quantity in SI_UNITS if _is_unit(unit, quantity)), None)
    return next((quantity for quantity in SI_UNITS if name.lower().startswith(quantity)), None)


def _is_unit(unit: str | None, quantity: str | None) -> bool:
    try:
        return unit is not None and quantity is not None and bool(to_si(unit, quantity))
    except UnitError:
        return False


def _runs(start: str, rows: Sequence[Mapping[str, str]], recordings: Sequence[str]) -> str:
    if rows:
        cells = _with_recordings(rows, recordings)
    else:
        empty = dict.fromkeys(_COLUMNS[start], "")
        cells = [
            {"run": str(number), "repetition": "1", **empty, "recording": path}
            for number, path in enumerate(recordings, 1)
        ]
    needed = {"bullet_mass_kg", "tank_pressure_bar"} if start == GUN else set()
    text = io.StringIO(newline="")
    columns = dict.fromkeys(["run", "repetition", *sorted(needed - cells[0].keys()), *cells[0]])
    writer = GuardedCsv(text, line_end="\n")
    writer.write_row(columns)
    for row in cells:
        writer.write_row(
            row.get(column) or (FILL_IN if column in needed else "") for column in columns
        )
    return text.getvalue()


def _with_recordings(
    rows: Sequence[Mapping[str, str]], recordings: Sequence[str]
) -> list[dict[str, str]]:
    if not recordings:
        return [{**row, "recording": FILL_IN} for row in rows]
    if len(recordings) == len(rows):
        return [{**row, "recording": path} for row, path in zip(rows, recordings, strict=True)]
    runs = dict.fromkeys(row["run"] for row in rows)
    if len(recordings) != len(runs):
        raise IngestError(
            f"{len(recordings)} recordings for a plan of {len(runs)} runs and {len(rows)} "
            "repetitions; expected one for each run or for each repetition"
        )
    of_run = dict(zip(runs, recordings, strict=True))
    return [{**row, "recording": of_run[row["run"]]} for row in rows]


def _toml(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)
