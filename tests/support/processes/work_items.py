"""Functions that other processes do for the tests of `map_ahead`: some die, raise or never end.

A process finds them by `support`, which nothing that is installed is called; some package has a module `tests`.
"""

from __future__ import annotations

import os
import threading
from pathlib import Path
from typing import NoReturn

from pyroshock.ingest.readers.contents import limited


def square(x: int) -> int:
    return x * x


def dies_on_three(x: int) -> int:
    if x % 10 == 3:
        os._exit(139)
    return x * x


def raises_on_three(x: int) -> int:
    if x == 3:
        raise ValueError("three")
    return x


def hangs_on_three(x: int) -> int:
    if x == 3:
        threading.Event().wait()
    return x


def walks_in_circles_on_three(x: int) -> int:
    """As libhdf5 does: no limit on the clock, and processor time for ever."""
    with limited(0.2):
        while x == 3:
            pass
    return x


def process_of(_: int) -> int:
    return os.getpid()


def lost(_: int) -> int:
    return -1


def patience(x: int) -> float:
    return 1.0 if x == 3 else 30.0


def dies_and_leaves_a_mark(path: Path) -> NoReturn:
    with path.open("a") as file:
        file.write("x")
    os._exit(139)
