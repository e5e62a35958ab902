"""Writes a campaign folder: campaign.toml, runs.csv and recordings, each file whole or not at all.

The sealed envelope beside a campaign folder: what the operator set, and what really happened in
each run.

It is for whoever scores a diagnosis afterwards. Nothing of it stands in the folder.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from .sensors import SensorBuild

#: What a bench's table in campaign.toml may hold.
Value = str | float | Sequence[Sequence[float]]
Channels = Mapping[str, NDArray[np.float32]]

#: Converters leave few distinct numbers: the fastest level of deflate takes most of what the
#: slowest does.
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
    """Write campaign.toml into a campaign folder.

    Parameters:
        folder: The campaign folder, which must exist.
        card: What the file says.
    """
    head = {
        "name": card.name,
        "kind": card.kind,
        "date": card.date,
        "description": card.description,
    }
    tables: list[tuple[str, Mapping[str, Value]]] = [
        ("campaign", {k: v for k, v in head.items() if v})
    ]
    tables += [(f"bench.{stage}", values) for stage, values in card.bench.items()]
    tables += [(f"channels.{sensor.name}", _channel(sensor)) for sensor in card.sensors]
    texts = [
        "\n".join([f"[{name}]", *(f"{k} = {_toml(v)}" for k, v in rows.items())])
        for name, rows in tables
    ]
    _write(folder / "campaign.toml", ("\n\n".join(texts) + "\n").encode())


def write_runs(folder: Path, rows: Sequence[Mapping[str, str]]) -> None:
    """Write runs.csv into a campaign folder: every column that a row has, in the order in which
    they first appear.

    Parameters:
        folder: The campaign folder, which must exist.
        rows: Column to cell for each row; a column that a row has not is left blank.
    """
    columns = list(dict.fromkeys(column for row in rows for column in row))
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    _write(folder / "runs.csv", text.getvalue().encode())


def write_recording(path: Path, channels: Channels, sampling_rate_hz: float) -> None:
    """Write a recording. The same channels give the same bytes.

    Parameters:
        path: The file, `.npz` or MATLAB 5 by its suffix; its folder is made where it is missing.
        channels: What the recorder writes, each of shape `(n,)`, by the name of the channel.
        sampling_rate_hz: The rate of all channels, which is written as `fs`.

    Raises:
        ValueError: For another suffix.
    """
    if path.suffix not in RECORDING_FORMATS:
        raise ValueError(
            f"recording {path.name!r}: format unknown; expected one of "
            f"{', '.join(RECORDING_FORMATS)}"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    _write(path, RECORDING_FORMATS[path.suffix](channels, sampling_rate_hz))


def _npz(channels: Channels, sampling_rate_hz: float) -> bytes:
    file = io.BytesIO()
    with ZipFile(file, "w") as archive:
        for name, values in {"fs": np.float64(sampling_rate_hz), **channels}.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asarray(values), allow_pickle=False)
            # a ZipInfo of its own has a fixed date
            archive.writestr(
                ZipInfo(f"{name}.npy"), member.getbuffer(), ZIP_DEFLATED, _DEFLATE_LEVEL
            )
    return file.getvalue()


def _mat(channels: Channels, sampling_rate_hz: float) -> bytes:
    from scipy.io import savemat

    file = io.BytesIO()
    # takes files
    savemat(file, {"fs": sampling_rate_hz, **channels}, do_compression=True)  # type: ignore[arg-type]
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
        raise OSError(
            error.errno, error.strerror, str(path)
        ) from error  # a full disk does not say which file
    finally:
        unfinished.unlink(missing_ok=True)


#: Raised whenever a key changes its meaning.
VERSION = 1


class SealError(ValueError):
    """A seal cannot be written or read; the message says why."""


@dataclass(frozen=True)
class Seal:
    """`effects` as `Effects.as_json` gives them; `runs` has for each row of runs.csv the truth of
    its hits or shot.

    `folder_sha256` is the `folder_hash` of the campaign that it belongs to.
    """

    kind: str
    seed: int
    effects: Mapping[str, Mapping[str, Any]]
    runs: Sequence[Mapping[str, Any]]
    folder_sha256: str
    version: int = VERSION
    echoes: bool = False  # whether the edges of the plate acted on what struck it

    def belongs_to(self, folder: Path) -> bool:
        """Whether a folder holds, byte for byte, what this seal was written for.

        Parameters:
            folder: A campaign folder.

        Raises:
            SealError: Where there is no such folder.
        """
        return folder_hash(folder) == self.folder_sha256


def seal_path(folder: Path) -> Path:
    """The path of a folder's seal: FOLDER.sealed.json, beside the folder.

    Parameters:
        folder: A campaign folder, which need not exist.
    """
    return folder.with_name(f"{folder.name}.sealed.json")


def folder_hash(folder: Path) -> str:
    """SHA-256 over the names and contents of all files of a folder.

    Parameters:
        folder: A campaign folder.

    Raises:
        SealError: Where there is no such folder.
    """
    if not folder.is_dir():
        raise SealError(f"{folder}: no such folder")
    digest = hashlib.sha256()
    names = sorted(
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()
    )
    for name in names:
        with (folder / name).open("rb") as file:
            digest.update(f"{name}\0{hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())
    return digest.hexdigest()


def write_seal(folder: Path, seal: Seal, path: Path | None = None) -> Path:
    """Write a seal; returns where.

    Parameters:
        folder: The campaign folder that the seal belongs to.
        seal: What the operator set, and what really happened.
        path: The file, by default beside the folder as `seal_path` says.

    Raises:
        SealError: For a path inside the folder, where a diagnosis could read it, and for one that
            exists.
    """
    path = path or seal_path(folder)
    if path.resolve().is_relative_to(folder.resolve()):
        raise SealError(f"seal {path}: expected a place outside of the campaign folder {folder}")
    if path.exists():
        raise SealError(f"seal {path}: there is one already; expected a new name")
    content = asdict(seal)
    if not seal.echoes:  # a seal without them is the same text as before there were any
        del content["echoes"]
    _write(path, json.dumps(content, indent=1, allow_nan=False).encode())
    return path


def open_seal(path: Path) -> Seal:
    """Read a seal.

    Parameters:
        path: The file that `write_seal` wrote.

    Raises:
        SealError: For a file that is none, or of another version.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        seal = Seal(**content)
    except (OSError, ValueError, TypeError) as error:
        raise SealError(f"{path}: not a seal: {error}") from error
    if seal.version != VERSION:
        raise SealError(f"{path}: a seal of version {seal.version!r}; expected {VERSION}")
    return seal
