"""Folders of uploads on this machine: only what was made here is ever removed, whatever a request
says."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

_UPLOAD, _CHECKED = "pyroshock-upload-", "pyroshock-checked-"
#: A checked upload that nobody stored or discarded is removed after a day.
_KEPT_S = 24 * 3600.0


def make_scratch(*, dry_run: bool = False) -> Path:
    """A folder that nobody else can read; it outlives this process, so that another can take up
    what is in it.

    That of a dry run stays until it is stored or discarded; those of which nobody wanted anything
    for a day go now.
    """
    if dry_run:
        for old in Path(tempfile.gettempdir()).glob(f"{_CHECKED}*"):
            with suppress(OSError):  # another process removes it at the same time
                if time.time() - old.stat().st_mtime > _KEPT_S:
                    discard(old)
    return Path(tempfile.mkdtemp(prefix=_CHECKED if dry_run else _UPLOAD))


def is_scratch(path: Path) -> bool:
    """Whether `path` is such a folder of this machine."""
    here = Path(tempfile.gettempdir()).resolve()
    return (
        path.parent.resolve() == here
        and path.name.startswith((_UPLOAD, _CHECKED))
        and not path.is_symlink()
    )


def discard(path: Path) -> None:
    """Remove such a folder, whatever state it is in; another path is left alone."""
    if is_scratch(path):
        shutil.rmtree(path, ignore_errors=True)


def take_checked(checked: Path) -> Path:
    """The folder of an upload that a dry run has checked, under the name of one that goes when its
    work is over.

    Raises `LookupError` where the upload was stored or discarded meanwhile.
    """
    kept = checked.with_name(checked.name.replace(_CHECKED, _UPLOAD, 1))
    try:
        if not is_scratch(checked) or kept == checked:
            raise FileNotFoundError(checked)
        checked.rename(kept)
    except OSError as error:
        raise LookupError(
            "the checked files were stored or discarded already; upload the folder again"
        ) from error
    return kept


def stored_scratch(arguments: Mapping[str, Any]) -> Path | None:
    """The folder of the upload that a stored job works on; None where its files are not of an
    upload."""
    for part in (arguments, *arguments.values()):
        if isinstance(part, Mapping) and part.get("scratch"):
            return Path(str(part["scratch"]))
    return None
