"""Limits that no program passes on this machine, measured beside it: copying, multiplying, reading, starting.

Each is a function to be timed, so that `interleaved` gives it turns with what it bounds.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from .measuring import run_child


def copying(nbytes: int) -> Callable[[], object]:
    """Copies so many bytes from memory to memory once."""
    source = np.ones(max(nbytes // 8, 1))
    target = np.zeros_like(source)
    return lambda: np.copyto(target, source)


def reading(path: Path) -> Callable[[], object]:
    """Reads the bytes of a file, or of all files below a folder, and does nothing with them."""
    files = [path] if path.is_file() else sorted(each for each in path.rglob("*") if each.is_file())

    def read() -> int:
        return sum(len(each.read_bytes()) for each in files)

    return read


def starting() -> object:
    """Python that starts and ends."""
    return run_child(["-c", "pass"])


def multiplying(flops: float, dtype: type[np.floating[Any]] = np.float64, size: int = 512) -> Callable[[], float]:
    """Seconds for so many operations at the rate of a product of two matrices, on as many threads as that takes.

    The product is timed, and its time scaled: what it returns is the limit, not what it takes.
    """
    a = np.random.default_rng(0).normal(size=(size, size)).astype(dtype)
    out = np.empty_like(a)

    def limit() -> float:
        begin = time.perf_counter()
        np.matmul(a, a, out=out)
        return (time.perf_counter() - begin) * flops / (2.0 * size**3)

    return limit
