"""What workers are asked to do in tests: they import it by name, as nothing that is installed is
called `support`."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import NoReturn

import numpy as np
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from pyroshock.ingest.readers.contents import limited


def squared(number: int) -> int:
    return number * number


def scaled(number: int, factor: np.ndarray, offset: int) -> float:
    return float(number * factor.sum() + offset)


def process(_: int) -> int:
    time.sleep(0.05)
    return os.getpid()


def threads(_: int) -> list[int]:
    """Of each library of linear algebra."""
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_info

    return [library["num_threads"] for library in threadpool_info()]


def product(seed: int) -> bytes:
    """Large enough for a library to take several threads; their number shows in the last bits."""
    one = np.random.default_rng(seed).standard_normal((300, 300))
    return np.linalg.solve(one @ one.T + np.eye(300), one).tobytes()


def refused(number: int) -> int:
    raise LookupError(f"no chore {number}")


def deadly(number: int) -> int:
    """3 kills its process, as a library might that a damaged file makes crash."""
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def dies_before_any() -> None:
    """A worker that cannot begin, as one that lacks memory for its libraries."""
    os.kill(os.getpid(), signal.SIGKILL)


def endless(number: int) -> int:
    while number == 3:
        time.sleep(0.05)
    return number


def left_behind(number: int, folder: Path) -> int:
    """Leaves a file when begun, and one when ended: long after the first."""
    (folder / f"begun-{number}").touch()
    time.sleep(0.1 if number == 0 else 3)
    (folder / f"ended-{number}").touch()
    return number


def held(number: int, folder: Path) -> int:
    """Writes down who begins it; 3 waits to be released."""
    with (folder / "begun").open("a") as file:
        file.write(f"{number} {os.getpid()}\n")
    while number == 3 and not (folder / "released").exists():
        time.sleep(0.02)
    return number * number


def away(genes: tuple[int, ...]) -> float:
    return float(sum((gene - 2) ** 2 for gene in genes))


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


def lost(_: int) -> int:
    return -1


def patience(x: int) -> float:
    return 1.0 if x == 3 else 30.0


def dies_and_leaves_a_mark(path: Path) -> NoReturn:
    with path.open("a") as file:
        file.write("x")
    os._exit(139)


def refusal(options: ReadingOptions, path: Path) -> str | None:
    """Why a file is refused; None for one that reads as it declares."""
    try:
        with open_recording(path, options) as recording:
            for channel in recording.channels:
                assert recording.read(channel.name).size == channel.samples
    except RecordingError as error:  # not swallowed: the test judges its words
        return str(error)
    return None
