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
        earlier_jobs = {attempt.job for attempt in before}
        self._since = {attempt: before.get(attempt, now) for attempt in seen}
        running = {attempt.job for attempt in self._since}
        moved = {attempt.job for attempt in self._since if attempt.job in earlier_jobs and attempt not in before}
        self._alive = (self._alive & running) | moved
        return [attempt for attempt, since in self._since.items() if now - since >= attempt.lease_s]

    def forget(self) -> None:
        """Begin anew: while the store was out of reach nobody could be seen moving."""
        self._since.clear()

    @property
    def undecided(self) -> bool:
        """Whether a job runs that has neither moved yet nor been silent for long enough."""
        return any(attempt.job not in self._alive for attempt in self._since)
