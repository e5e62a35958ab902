"""Files of the working directory are data: no process that is started here imports or unpickles one
of them.

`python -c` and `python -m`, by which process pools start their workers, look for modules in the
working directory before anywhere else: a `copy.py` in a campaign folder would run. Python does not
look there where PYTHONSAFEPATH is set (documentation of Python 3.11, "Command line and
environment"). A worker then looks where its parent does.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock

#: numba reads settings from a `.numba_config.yaml` of the working directory, which could name a
#: folder of pickles there as its cache; what the environment says, even nothing, goes before that
#: file.
_CLOSED = {"PYTHONSAFEPATH": "1", "NUMBA_CACHE_DIR": "", "NUMBA_CACHE_LOCATOR_CLASSES": ""}

_lock = Lock()
_blocks = 0
_added: list[str] = []


def close_working_directory() -> None:
    """For this process, which is the project's own, and for all that it starts."""
    _add()
    sys.path[:] = [place for place in sys.path if place]  # an empty place is the working directory


@contextmanager
def working_directory_closed() -> Iterator[None]:
    """For processes that are started within the block, in any thread; the environment is afterwards
    what it was."""
    global _blocks
    with _lock:
        _blocks += 1
        if _blocks == 1:
            _added.extend(_add())
    try:
        yield
    finally:
        with _lock:
            _blocks -= 1
            while not _blocks and _added:
                os.environ.pop(_added.pop(), None)


def _add() -> list[str]:
    """The variables that were missing; what a user has set stays."""
    missing = [name for name in _CLOSED if name not in os.environ]
    if os.environ.get("PYTHONSAFEPATH") == "":  # which Python takes for unset
        missing.append("PYTHONSAFEPATH")
    os.environ.update({name: _CLOSED[name] for name in missing})
    return missing
