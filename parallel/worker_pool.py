"""What `mapped` asks of every kind of worker pool."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Protocol

from .task import Errand, Outcome


class Hands(Protocol):
    """Workers that are ready."""

    def outcomes(self, errands: Iterable[Errand]) -> Generator[Outcome, None, None]:
        """As they come. An errand over which its worker died comes with `Died()`; then some may not come at all."""
        ...


class _Abandoned(BaseException):
    pass


@contextmanager
def abandoned_after(stream: Generator[Any, None, None]) -> Iterator[None]:
    """Whatever of joblib's `stream` is left after the block is cancelled.

    Thrown into, not closed: for a stream that is closed early joblib warns.
    """
    try:
        yield
    finally:
        with suppress(_Abandoned):
            stream.throw(_Abandoned())
