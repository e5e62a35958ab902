"""A table's content as one hash that is the same on every engine."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from .rows import Values


class TableDigest:
    """SHA-256 over rows in the order of their keys, and their count.

    Numbers count by their bits but for the sign of zero, which SQLite does not keep; times by their instant; JSON by
    its text.
    """

    def __init__(self) -> None:
        self.rows = 0
        self._hash = hashlib.sha256()

    def watch(self, batches: Iterable[Sequence[Values]]) -> Iterator[Sequence[Values]]:
        """The batches as they are, counted and hashed on their way."""
        for batch in batches:
            for row in batch:
                # repr tells types, NaN, infinities and every bit of a number, and where a text ends.
                self._hash.update(repr([_plain(value) for value in row]).encode())
            self.rows += len(batch)
            yield batch

    def take(self, batches: Iterable[Sequence[Values]]) -> TableDigest:
        """`watch` to the end; returns itself."""
        for _ in self.watch(batches):
            pass
        return self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TableDigest) and (self.rows, self.hex) == (other.rows, other.hex)

    __hash__ = None  # type: ignore[assignment]  # it changes with every row

    @property
    def hex(self) -> str:
        return self._hash.hexdigest()


def _plain(value: Any) -> Any:
    if type(value) is float:
        return value + 0.0  # -0.0 becomes 0.0
    return hashlib.sha256(value).digest() if type(value) is bytes else value
