"""What a worker does: one call of one function, watched."""

from __future__ import annotations

import faulthandler
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from .shared_data import contents
from .threads import use_one_thread


class Errand(NamedTuple):
    """An item by its number, and the seconds after which its worker is ended; None: it may take as long as it likes.

    A tuple, for joblib hands tuples to Dask as they are; other objects it would first place on one worker, and with
    that worker they would be lost.
    """

    number: int
    item: Any
    patience_s: float | None = None


@dataclass(frozen=True)
class Died:
    """In the place of a result: the worker died over the errand."""


#: An errand's number with what came of it.
Outcome = tuple[int, Any]


def carried_out(function: Callable[..., Any], errand: Errand, shared: Any) -> Outcome:
    """In a worker."""
    from joblib import parallel_config

    use_one_thread()
    # The function's own libraries get no workers of their own: on a cluster they would wait for each other.
    with parallel_config("sequential"), _ended_after(errand.patience_s):
        return errand.number, function(errand.item, *contents(shared))


@contextmanager
def _ended_after(patience_s: float | None) -> Iterator[None]:
    """This process ends when the block takes longer, even inside a C library."""
    if patience_s is None:
        yield
        return
    with Path(os.devnull).open("w") as nowhere:
        faulthandler.dump_traceback_later(patience_s, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
