"""How far work over many rows is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

Item = TypeVar("Item")

#: Called with (done, total, what).
Progress = Callable[[int, int, str], None]


class ProgressBar:
    """Counts to `total` and tells it on."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress = progress
        self._total = total
        self._done = 0

    def step(self, count: int, what: str) -> None:
        self._done += count
        if self._progress is not None:
            self._progress(self._done, self._total, what)

    def watch(self, batches: Iterable[Sequence[Item]], what: str) -> Iterator[Sequence[Item]]:
        """The batches as they are, counted once they were used."""
        for batch in batches:
            yield batch
            self.step(len(batch), what)
