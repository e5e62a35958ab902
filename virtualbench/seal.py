"""The sealed envelope beside a campaign folder: what the operator set, and what really happened in each run.

It is for whoever scores a diagnosis afterwards. Nothing of it stands in the folder.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

#: Raised whenever a key changes its meaning.
VERSION = 1


class SealError(ValueError):
    """A seal cannot be written or read; the message says why."""


@dataclass(frozen=True)
class Seal:
    """`effects` as `Effects.as_json` gives them; `runs` has for each row of runs.csv the truth of its hits or shot.

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
        """Whether `folder` holds, byte for byte, what this seal was written for."""
        return folder_hash(folder) == self.folder_sha256


def seal_path(folder: Path) -> Path:
    """FOLDER.sealed.json, beside the folder."""
    return folder.with_name(f"{folder.name}.sealed.json")


def folder_hash(folder: Path) -> str:
    """SHA-256 over the names and contents of all files of a folder. Raises `SealError` where there is no folder."""
    if not folder.is_dir():
        raise SealError(f"{folder}: no such folder")
    digest = hashlib.sha256()
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())
    for name in names:
        with (folder / name).open("rb") as file:
            digest.update(f"{name}\0{hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())
    return digest.hexdigest()


def write_seal(folder: Path, seal: Seal, path: Path | None = None) -> Path:
    """Write `seal` to `path`, by default beside the campaign in `folder`; returns where.

    Raises `SealError` for a path inside the folder, where a diagnosis could read it, and for one that exists.
    """
    path = path or seal_path(folder)
    if path.resolve().is_relative_to(folder.resolve()):
        raise SealError(f"seal {path}: expected a place outside of the campaign folder {folder}")
    if path.exists():
        raise SealError(f"seal {path}: there is one already; expected a new name")
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        content = asdict(seal)
        if not seal.echoes:  # a seal without them is the same text as before there were any
            del content["echoes"]
        unfinished.write_text(json.dumps(content, indent=1, allow_nan=False), encoding="utf-8")
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return path


def open_seal(path: Path) -> Seal:
    """Read a seal. Raises `SealError` for a file that is none, or of another version."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        seal = Seal(**content)
    except (OSError, ValueError, TypeError) as error:
        raise SealError(f"{path}: not a seal: {error}") from error
    if seal.version != VERSION:
        raise SealError(f"{path}: a seal of version {seal.version!r}; expected {VERSION}")
    return seal
