"""Files for people and other programs: a file has its name when all of it is there, never half of
it.

It grows beside its place under another name, and takes its own at the end. A full disk, a kill or
an error leaves what stood there before.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


class OutputError(OSError):
    """A file could not be written; says which, why, and what next."""


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """Gives the name to write to, of the same ending; after the block the file is at `path`.

    Parameters:
        path: Where the file stands after the block. A file that is there already is replaced; of a
            link, the file that it stands for. A device or a pipe ("/dev/stdout") is written to as
            it is.

    Raises:
        OutputError: Where the system refuses to write.
    """
    try:
        if path.exists() and not path.is_file():
            yield path
            return
        target = path.resolve()  # of a link, the file that it stands for
        partial = target.with_name(f".{target.stem}.{os.getpid()}.part{target.suffix}")
        try:
            yield partial
            partial.replace(target)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot write {path}: {error.strerror or error}; what was there is as it was: make "
            "room or choose another place, and repeat"
        ) from error


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, whole or not at all.

    Parameters:
        path: Where the file stands afterwards; a file that is there already is replaced.
        text: All of its content.

    Raises:
        OutputError: Where the system refuses to write.
    """
    with atomic_file(path) as partial:
        partial.write_text(text, encoding="utf-8")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file of bytes, whole or not at all.

    Parameters:
        path: Where the file stands afterwards; a file that is there already is replaced.
        content: All of its bytes.

    Raises:
        OutputError: Where the system refuses to write.
    """
    with atomic_file(path) as partial:
        partial.write_bytes(content)
