"""A simulated campaign has its folder's name when all of it is there: it grows beside its place."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .seal import seal_path


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """Gives the folder to write to, and its seal beside it; after the block both are at `out`, new or empty before.

    What an error leaves goes at once, so that a repeat may begin; what a kill left goes with the next folder of that
    name. The campaign takes its place before its seal does: the two cannot in one step.
    """
    place = out.resolve()  # of a link, the folder that it stands for
    place.parent.mkdir(parents=True, exist_ok=True)
    for abandoned_path in _left_by_the_dead(place):
        _remove(abandoned_path)
    partial = place.with_name(f".{place.name}.{os.getpid()}.part")
    partial.mkdir()
    try:
        yield partial
        partial.replace(place)
        seal_path(partial).replace(seal_path(out))
    finally:
        _remove(partial)


def _left_by_the_dead(place: Path) -> Iterator[Path]:
    form = re.compile(rf"\.{re.escape(place.name)}\.(\d+)\.part")
    for path in list(place.parent.iterdir()):
        name_match = form.fullmatch(path.name)
        if name_match is not None and not _lives(int(name_match[1])):
            yield path


def _lives(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # somebody else's
        return True
    return True


def _remove(partial: Path) -> None:
    shutil.rmtree(partial, ignore_errors=True)
    seal_path(partial).unlink(missing_ok=True)
