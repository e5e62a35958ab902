"""The one place where a library's exception or warning becomes a `RecordingError`."""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .base import RecordingError

#: What a library says about itself, not about the file.
_ABOUT_THE_LIBRARY = (DeprecationWarning, PendingDeprecationWarning, FutureWarning, ImportWarning, ResourceWarning)
_LONGEST_REASON = 400


def one_line(text: object) -> str:
    """A message on one line, shortened: a damaged file can put kilobytes into a name.

    What cannot be printed is replaced: no database takes NUL or half a character, and no terminal should take the rest.
    """
    line = "".join(sign if sign.isprintable() else "\ufffd" for sign in " ".join(str(text).split()))
    return line if len(line) <= _LONGEST_REASON else line[:_LONGEST_REASON] + "…"


class BoundedFile(io.BufferedReader):
    """A file of which nobody asks for more than there is: libraries read parts of whatever length these declare."""

    def read(self, size: int | None = -1, /) -> bytes:
        rest = max(0, os.fstat(self.fileno()).st_size - self.tell())
        return super().read(rest if size is None or size < 0 else min(size, rest))


@contextmanager
def guarded(path: Path) -> Iterator[None]:
    """Turn whatever goes wrong inside into a `RecordingError` that names `path`; warnings count as errors.

    Seen on damaged files: OSError, EOFError, ValueError, TypeError, KeyError, IndexError, AttributeError,
    OverflowError, MemoryError, NotImplementedError, RuntimeError, SyntaxError (numpy's and lvm_read's literals),
    UnicodeError, struct.error, zlib.error, zipfile.BadZipFile, scipy's MatReadError and MatReadWarning,
    pandas' ParserError and ParserWarning, pyarrow's ArrowInvalid, and pyuff's bare `Exception`: hence no list below.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for kind in _ABOUT_THE_LIBRARY:
                warnings.simplefilter("ignore", kind)
            yield
    except RecordingError as error:
        if one_line(error) == str(error):
            raise
        raise RecordingError(one_line(error)) from error
    except FileNotFoundError as error:
        raise RecordingError(f"{path.name}: no such file: {path}") from error
    except Exception as error:
        reason = one_line(error) or type(error).__name__
        raise RecordingError(f"{path.name}: damaged, or not what its suffix says: {reason}") from error


def refuse_nothing(path: Path) -> None:
    """Raise `RecordingError` for a folder or an empty file."""
    if path.is_dir():
        raise RecordingError(f"{path.name}: is a folder; expected a recording file")
    if path.stat().st_size == 0:
        raise RecordingError(f"{path.name}: is empty (0 bytes); expected a recording")
