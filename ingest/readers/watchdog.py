"""An end to calls into a C library that never come back, in a process that may be ended for it.

A wrong byte in an HDF5 file can make libhdf5 walk in circles. No Python code runs meanwhile, so that only the system
can end it: by a timer of processor time, which a slow disk or network does not use up.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

#: Processor time of a call: a file of a megabyte is opened and read in hundredths of a second.
_CALL_S, _FILE_BYTES_PER_S, _SAMPLE_BYTES_PER_S = 3.0, 1e6, 50e6
_ends_process = False


def end_this_process_when_stuck() -> None:
    """From now on a call that takes too long ends this process, which must hold nothing that matters."""
    global _ends_process  # it is the process that is so, and no call's argument
    _ends_process = hasattr(signal, "setitimer")  # not on Windows


def seconds_for(file_bytes: int, sample_bytes: int = 0) -> float:
    """Far above what a call needs that reads `sample_bytes` of samples from a file of `file_bytes`."""
    return _CALL_S + file_bytes / _FILE_BYTES_PER_S + sample_bytes / _SAMPLE_BYTES_PER_S


@contextmanager
def limited(seconds: float) -> Iterator[None]:
    """A call that may take so much processor time, where `end_this_process_when_stuck`."""
    if not _ends_process:
        yield
        return
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
