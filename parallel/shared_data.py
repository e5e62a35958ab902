"""What all calls share, sent to each process once."""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol


class Sent(Protocol):
    """What is shared, on its way to a process."""

    def contents(self) -> tuple[Any, ...]: ...


@dataclass(frozen=True)
class Parcel:
    """A file of ours by its path and the SHA-256 of its bytes."""

    path: str
    sha256: str

    def contents(self) -> tuple[Any, ...]:
        """Read once by each process. Raises `ValueError` where the file is not the one that was packed."""
        if self not in _latest:
            content = Path(self.path).read_bytes()
            if hashlib.sha256(content).hexdigest() != self.sha256:
                raise ValueError(f"{self.path} is not what was packed for the workers")
            _latest.clear()  # of one call at a time, for it may be large
            _latest[self] = pickle.loads(content)
        return _latest[self]


_latest: dict[Parcel, tuple[Any, ...]] = {}


def contents(shared: Sent | tuple[Any, ...]) -> tuple[Any, ...]:
    """As it was given to `mapped`."""
    return shared if isinstance(shared, tuple) else shared.contents()


@contextmanager
def packed(shared: tuple[Any, ...]) -> Iterator[Parcel | tuple[Any, ...]]:
    """As a file that is gone afterwards; what is empty needs none."""
    if not shared:
        yield ()
        return
    content = pickle.dumps(shared, pickle.HIGHEST_PROTOCOL)
    with TemporaryDirectory(prefix="pyroshock-") as folder:  # no other user may look into it
        file = Path(folder) / "shared"
        file.write_bytes(content)
        yield Parcel(str(file), hashlib.sha256(content).hexdigest())
