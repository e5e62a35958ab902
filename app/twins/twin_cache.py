"""Twins that stay ready: built once for each request, as long as what they are made of in the store stays the same.

A twin takes seconds to build (modes of a plate, a registered model), and tenths of a second; ready, it answers in
tens of milliseconds.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from typing import TYPE_CHECKING

from ..models.training import models_extra
from .building import BuiltTwin, TwinRequest, twin_of
from .cache_key import StampReader

if TYPE_CHECKING:
    from ...schema.session import Store

#: A solved plate with its answers takes some 20 MB.
KEPT = 4
#: So many draws meet every plate of the ensemble.
_DRAWS = 64
_VELOCITY_M_S = 5.0

_Key = tuple[TwinRequest, Hashable]


class TwinShelf:
    """The last few twins of a store (None: of the shipped bench), for use from several threads.

    `build` makes one, as `twin_of`. A twin is built anew when campaigns, shots, impacts, pulses, materials or adopted
    effects were added to the store, and when another model is in use.
    """

    def __init__(
        self,
        store: Store | None,
        db: str,
        *,
        kept: int = KEPT,
        build: Callable[[Store | None, str, TwinRequest], BuiltTwin] = twin_of,
    ) -> None:
        self._store, self._db, self._kept, self._build = store, db, kept, build
        self._stamps = StampReader(store, db)
        self._ready: OrderedDict[_Key, BuiltTwin] = OrderedDict()
        self._shelf = threading.Lock()
        #: One is built at a time: who asks for the same one waits for it, and MLflow's settings are the process's.
        self._building = threading.Lock()

    def get(self, request: TwinRequest) -> BuiltTwin:
        """The twin, ready to be asked. Raises as `twin_of`, and what is missing of `pyroshock[models]` as one line."""
        key = (request, self._stamps.stamp(request))
        twin = self._taken(key)
        if twin is not None:
            return twin
        with self._building:
            twin = self._taken(key)
            if twin is None:
                with models_extra():
                    twin = self._build(self._store, self._db, request)
                warmed(twin)
                self._put(key, twin)
        return twin

    def _taken(self, key: _Key) -> BuiltTwin | None:
        with self._shelf:
            if key in self._ready:
                self._ready.move_to_end(key)
            return self._ready.get(key)

    def _put(self, key: _Key, built: BuiltTwin) -> None:
        with self._shelf:
            for other in [key_ready for key_ready in self._ready if key_ready[0] == key[0]]:
                del self._ready[other]  # of an earlier state of the store
            self._ready[key] = built
            while len(self._ready) > self._kept:
                self._ready.popitem(last=False)


def warmed(built: BuiltTwin) -> None:
    """Let the twin make what it keeps: the answer of every plate of its ensemble at every impact position."""
    import numpy as np

    positions = built.twin.plate.ensemble(built.plate.name)[0].impact_points if built.twin.sensor_names else ("#1",)
    for position in positions:
        # A model may know nothing of such a shot; then the first prediction is a slow one.
        with suppress(ValueError, LookupError):
            setting = built.setting(
                impactor_mass_kg=0.5,
                tip=built.plate,
                tip_radius_m=0.045,
                impact_velocity_m_s=_VELOCITY_M_S,
                impact_position=position,
            )
            built.twin.predict(setting, draws=_DRAWS, rng=np.random.default_rng(0))
