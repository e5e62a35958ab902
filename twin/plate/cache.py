"""Solved plates on disk: a solution takes seconds, a look at it milliseconds."""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from .build import PlateBuild
from .modal import ModalPlate
from .modes import solve_plate

#: Grows with every change of the solution, so that what an older one has left is not taken for ours.
_VERSION = 1
_ARRAYS = ("frequency_hz", "damping_ratio", "shape_impact", "shapes")


def cached_plate(
    build: PlateBuild, max_frequency_hz: float, folder: Path, *, thickness_correction: bool = True
) -> ModalPlate:
    """As `solve_plate`, from `folder` where it has been solved before; a file that cannot be read is solved anew."""
    path = folder / f"{_key(build, max_frequency_hz, thickness_correction)}.npz"
    try:
        return _load(path)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        plate = solve_plate(build, max_frequency_hz, thickness_correction=thickness_correction)
    _save(plate, path)
    return plate


def _key(build: PlateBuild, max_frequency_hz: float, thickness_correction: bool) -> str:
    """A record's `repr` has all of its numbers, to the last digit."""
    text = repr((_VERSION, build, float(max_frequency_hz), thickness_correction))
    return hashlib.sha256(text.encode()).hexdigest()


def _load(path: Path) -> ModalPlate:
    with path.open("rb") as file, np.load(file, allow_pickle=False) as stored:
        return ModalPlate(
            **{name: stored[name] for name in _ARRAYS},
            impact_points=tuple(stored["impact_points"].tolist()),
            sensors=tuple(stored["sensors"].tolist()),
        )


def _save(plate: ModalPlate, path: Path) -> None:
    """Whole or not at all: another process may read at any time."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez(file, allow_pickle=False, **{name: np.asarray(value) for name, value in vars(plate).items()})
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
