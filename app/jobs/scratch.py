"""Folders of uploads: made here, and only what was made here is ever removed, whatever a job's row says."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

_PREFIX = "pyroshock-upload-"


def make_scratch() -> Path:
    """A folder that nobody else can read; it outlives this process, so that another can take up what is in it."""
    return Path(tempfile.mkdtemp(prefix=_PREFIX))


def is_scratch(path: Path) -> bool:
    """Whether `path` is such a folder of this machine."""
    here = Path(tempfile.gettempdir()).resolve()
    return path.parent.resolve() == here and path.name.startswith(_PREFIX) and not path.is_symlink()


def discard(path: Path) -> None:
    """Remove such a folder, whatever state it is in; another path is left alone."""
    if is_scratch(path):
        shutil.rmtree(path, ignore_errors=True)
