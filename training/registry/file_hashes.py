"""The SHA-256 of every file of a registered version, made when it is registered and compared when
it is read."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

#: Begin of the names of the model's files, and of those of the run that trained it (held-out
#: predictions, plots).
MODEL, RUN = "model/", "run/"
#: What MLflow itself adds to a copy that it downloads.
_OF_MLFLOW = frozenset({"registered_model_meta"})


class AlteredFilesError(ValueError):
    """Files of a version are not those that were registered; the message names each."""


def hash_files(folder: Path, begin: str) -> dict[str, str]:
    """Name below `folder`, after `begin`, -> SHA-256, of all files; nothing for a folder that is
    not there."""
    files = (
        path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in _OF_MLFLOW
    )
    return {begin + path.relative_to(folder).as_posix(): _hash(path) for path in files}


def check_files(folder: Path, begin: str, recorded: Mapping[str, str]) -> None:
    """Hold all files below a folder against those recorded of it. Raises `AlteredFilesError`.

    Versions of software that recorded none (`recorded` is empty) pass.
    """
    own = {name: digest for name, digest in recorded.items() if name.startswith(begin)}
    if not recorded:
        return
    here = hash_files(folder, begin)
    faults = [f"no {name}" for name in own if name not in here]
    faults += [
        f"{name} is not the file that was registered"
        for name in own
        if here.get(name, own[name]) != own[name]
    ]
    faults += [f"{name} was not registered" for name in here if name not in own]
    if faults:
        raise AlteredFilesError("; ".join(faults))


def check_file(path: Path, name: str, recorded: Mapping[str, str]) -> None:
    """The same for one file, whose name begins with `RUN` or `MODEL`."""
    if name in recorded and _hash(path) != recorded[name]:
        raise AlteredFilesError(f"{name} is not the file that was registered")


def _hash(path: Path) -> str:
    with path.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()
