"""Writes a campaign folder: campaign.toml, runs.csv and recordings, each file whole or not at all."""

from __future__ import annotations

import csv
import io
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from .sensors import SensorBuild

#: What a bench's table in campaign.toml may hold.
Value = str | float | Sequence[Sequence[float]]
Channels = Mapping[str, NDArray[np.float32]]

#: Converters leave few distinct numbers: the fastest level of deflate takes most of what the slowest does.
_DEFLATE_LEVEL = 1
#: MATLAB 5 files begin with a text of this length, in which scipy states the time of writing.
_MAT_TEXT_BYTES = 116


@dataclass(frozen=True)
class CampaignCard:
    """What campaign.toml says; `bench` by stage ("gun", "hammer", "plate"), SI."""

    name: str
    kind: str
    date: str
    sensors: tuple[SensorBuild, ...]
    description: str = ""
    bench: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)


def write_card(folder: Path, card: CampaignCard) -> None:
    """`folder`/campaign.toml."""
    head = {"name": card.name, "kind": card.kind, "date": card.date, "description": card.description}
    tables: list[tuple[str, Mapping[str, Value]]] = [("campaign", {k: v for k, v in head.items() if v})]
    tables += [(f"bench.{stage}", values) for stage, values in card.bench.items()]
    tables += [(f"channels.{sensor.name}", _channel(sensor)) for sensor in card.sensors]
    texts = ["\n".join([f"[{name}]", *(f"{k} = {_toml(v)}" for k, v in rows.items())]) for name, rows in tables]
    _write(folder / "campaign.toml", ("\n\n".join(texts) + "\n").encode())


def write_runs(folder: Path, rows: Sequence[Mapping[str, str]]) -> None:
    """`folder`/runs.csv: every column that a row has, in the order in which they first appear."""
    columns = list(dict.fromkeys(column for row in rows for column in row))
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    _write(folder / "runs.csv", text.getvalue().encode())


def write_recording(path: Path, channels: Channels, sampling_rate_hz: float) -> None:
    """Channels (n,) and their rate `fs`, as `.npz` or MATLAB 5 by the path's suffix; same channels, same bytes.

    Raises `ValueError` for another suffix.
    """
    if path.suffix not in RECORDING_FORMATS:
        raise ValueError(f"recording {path.name!r}: format unknown; expected one of {', '.join(RECORDING_FORMATS)}")
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, RECORDING_FORMATS[path.suffix](channels, sampling_rate_hz))


def _npz(channels: Channels, sampling_rate_hz: float) -> bytes:
    file = io.BytesIO()
    with ZipFile(file, "w") as archive:
        for name, values in {"fs": np.float64(sampling_rate_hz), **channels}.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asarray(values), allow_pickle=False)
            # a ZipInfo of its own has a fixed date
            archive.writestr(ZipInfo(f"{name}.npy"), member.getbuffer(), ZIP_DEFLATED, _DEFLATE_LEVEL)
    return file.getvalue()


def _mat(channels: Channels, sampling_rate_hz: float) -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    savemat(file, {"fs": sampling_rate_hz, **channels}, do_compression=True)  # type: ignore[arg-type]  # takes files
    text = b"MATLAB 5.0 MAT-file".ljust(_MAT_TEXT_BYTES)
    return text + file.getvalue()[_MAT_TEXT_BYTES:]


#: Suffix to writer.
RECORDING_FORMATS: dict[str, Callable[[Channels, float], bytes]] = {".npz": _npz, ".mat": _mat}


def _channel(sensor: SensorBuild) -> dict[str, Value]:
    rows: dict[str, Value | None] = {
        "quantity": sensor.quantity,
        "unit": sensor.unit,
        "sensitivity": sensor.sensitivity,
        "offset_v": sensor.offset_v or None,
        "position": sensor.position,
        "axis": sensor.axis,
        "range": sensor.full_scale,
    }
    return {key: value for key, value in rows.items() if value is not None}


def _toml(value: Any) -> str:
    """Texts, numbers and lists of them: what TOML writes as JSON does."""
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _write(path: Path, content: bytes) -> None:
    """Under another name first: whoever finds the file finds all of it."""
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        unfinished.write_bytes(content)
        unfinished.replace(path)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from error  # a full disk does not say which file
    finally:
        unfinished.unlink(missing_ok=True)
