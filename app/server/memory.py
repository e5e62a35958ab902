"""Memory that a page has freed goes back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress

#: Of glibc's `mallopt` (malloc.h).
_M_MMAP_THRESHOLD, _M_TRIM_THRESHOLD, _M_ARENA_MAX = -3, -1, -8
_LARGE_BYTES = 200_000


def return_freed_memory() -> None:
    """Let glibc keep one pool of memory in place of one for each thread, and give large blocks back
    at once: pages are made by several threads, and what one of them has freed the others could not
    use. Does nothing where the C library is another one.
    """
    with suppress(OSError, AttributeError):  # another C library, or one without `mallopt`
        mallopt = ctypes.CDLL("libc.so.6").mallopt
        mallopt(_M_ARENA_MAX, 1)
        mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
        mallopt(_M_TRIM_THRESHOLD, _LARGE_BYTES)
