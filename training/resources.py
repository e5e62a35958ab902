"""Seconds and memory of a piece of work."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


@dataclass
class Meter:
    """Filled when the work is done."""

    seconds: float = 0.0
    peak_memory_mb: float = 0.0


@contextmanager
def metered() -> Iterator[Meter]:
    """Times the block, and notes the greatest memory that the process held within it.

    Elsewhere than on Linux the greatest since the process began: the system counts no other there.
    """
    meter = Meter()
    with suppress(OSError):
        _RESET.write_text("5")  # proc(5): sets the high-water mark of the resident set to what is resident
    begun = time.perf_counter()
    try:
        yield meter
    finally:
        meter.seconds = time.perf_counter() - begun
        meter.peak_memory_mb = _peak_mb()


def _peak_mb() -> float:
    with suppress(OSError):
        for line in _STATUS.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) / 1024
    with suppress(ImportError):
        import resource
        import sys

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / 2**20 if sys.platform == "darwin" else peak / 1024
    return float("nan")
