"""The first twin is built while nobody waits for it."""

from __future__ import annotations

import logging
import threading
from importlib import import_module

from ..twins.building import TwinRequest
from ..twins.twin_cache import TwinCache

_log = logging.getLogger("pyroshock.web")
_HEAVY = (
    "scipy.stats",
    "scipy.optimize",
    "scipy.interpolate",
    "pyroshock.app.operations.plan.quality",
    "pyroshock.app.operations.train.comparing",
)


def warm_up_in_thread(twins: TwinCache) -> threading.Thread:
    """Begin in a thread of its own; what fails here is told where it is asked for."""

    def work() -> None:
        try:
            for name in _HEAVY:
                import_module(name)
            twins.get(TwinRequest())
        except Exception as error:  # noqa: BLE001 - a page tells it to who asks
            _log.info("not warmed: %s", error)

    thread = threading.Thread(target=work, name="pyroshock warming", daemon=True)
    thread.start()
    return thread
