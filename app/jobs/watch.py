"""Which workers have fallen silent, by this process's own stopwatch.

A job is given up for dead when it was seen unmoved for the whole of its lease. No time of day enters, neither of this
machine nor of another: clocks that differ, or are set back, change nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from .claims import Sighting


@dataclass
class Watch:
    """Remembers since when each running job has not moved."""

    clock: Callable[[], float] = time.monotonic
    _since: dict[Sighting, float] = field(default_factory=dict)
    _alive: set[int] = field(default_factory=set)

    def silent(self, seen: Iterable[Sighting]) -> list[Sighting]:
        """Of all jobs that run now, those whose lease has passed under this watch's eyes."""
        now, before = self.clock(), self._since
        known = {each.job for each in before}
        self._since = {each: before.get(each, now) for each in seen}
        running = {each.job for each in self._since}
        moved = {each.job for each in self._since if each.job in known and each not in before}
        self._alive = (self._alive & running) | moved
        return [each for each, since in self._since.items() if now - since >= each.lease_s]

    def forget(self) -> None:
        """Begin anew: while the store was out of reach nobody could be seen moving."""
        self._since.clear()

    @property
    def undecided(self) -> bool:
        """Whether a job runs that has neither moved yet nor been silent for long enough."""
        return any(each.job not in self._alive for each in self._since)
