"""A worker's sign of life while it works: a thread that beats, tells progress, and hears of a stop."""

from __future__ import annotations

import threading
import time

from sqlalchemy.exc import SQLAlchemyError

from ...schema.engine import StoreError
from ...schema.session import Store
from .job_updates import JobProgress, Sign, beat, look
from .lease import Lease, LeaseLostError
from .work import InterruptedWorkError, StoppedError

#: A lease is kept by so many beats: some may come late, on a machine that is busy or a store that is locked.
_BEATS = 6
#: A stop is heard of, and progress told, within this time.
_TICK_S = 1.0


class Heart:
    """Beats for as long as it is entered. `step` tells progress, and raises what ends the work."""

    def __init__(self, store: Store, lease: Lease, lease_s: float, ending: threading.Event, stop: bool) -> None:
        self.progress = JobProgress()
        self._store, self._lease, self._ending = store, lease, ending
        self._beat_s = lease_s / _BEATS
        self._sign = Sign(True, stop)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"pyroshock job {lease.job}", daemon=True)

    def __enter__(self) -> Heart:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def step(self, done: int, total: int, what: str) -> None:
        """Raises `LeaseLostError`, `StoppedError`, `InterruptedWorkError`."""
        self.progress = JobProgress(done, total, what)
        self.check()

    def check(self) -> None:
        """Raises as `step`."""
        sign = self._sign
        if not sign.held:
            raise LeaseLostError(f"job {self._lease.job} was taken over")
        if sign.stop:
            raise StoppedError
        if self._ending.is_set():
            raise InterruptedWorkError

    def _run(self) -> None:
        last_written, beaten = JobProgress(), time.monotonic()
        while self._sign.held and not self._over.wait(min(_TICK_S, self._beat_s)):
            now, progress = time.monotonic(), self.progress
            try:
                if progress != last_written or now - beaten >= self._beat_s:
                    self._sign = beat(self._store, self._lease, progress)
                    last_written, beaten = progress, now
                else:
                    self._sign = look(self._store, self._lease)
            except (StoreError, SQLAlchemyError):
                continue  # out of reach for the moment; if for too long, the next answer is that the lease is lost
