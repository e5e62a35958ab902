"""Twins that stay ready: built once for each request, as long as what they are made of in the store
stays the same, which a stamp that is cheap to compare tells.

A twin takes tenths of a second to seconds to build (modes of a plate, a registered model); ready,
it answers in tens of milliseconds.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from sqlalchemy import func, select

from ...schema.benches import Material, ModalTable
from ...schema.campaigns import Campaign
from ...schema.diagnoses import TwinVersion
from ...schema.impacts import Impact, Pulse, Shot
from ...schema.provenance import Tombstone
from ...twin.contact.laws import LAWS
from ..common.model_registry import models_extra, registry_of
from .benches import GUN, bench_of_campaign
from .building import REGISTERED, BuiltTwin, TwinRequest, twin_of
from .learning import model_in_use

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...schema.session import Store
    from ...training.registry.registry import Registry


#: A registry on a server is asked for its champion at most so often.
_ASKED_EVERY_S = 10.0
#: Their newest keys tell what was added; rows that a twin is made of are never changed, and what is
#: deleted leaves a tombstone (a key may be given again).
_TABLES = (Campaign, Shot, Impact, Pulse, TwinVersion, Material, ModalTable, Tombstone)


class CacheKeyReader:
    """Stamps of requests: equal as long as the same twin would be built. Takes some
    milliseconds."""

    def __init__(self, store: Store | None, db: str) -> None:
        self._store, self._db = store, db
        #: State of the registry, and by campaign the model in use then.
        self._known: tuple[Hashable, dict[str | None, str | None]] | None = None
        self._lock = threading.Lock()

    def stamp(self, request: TwinRequest) -> Hashable:
        """Of the store, of the files that the request names, and of the registered model that it
        means."""
        files = tuple(
            _signature(path) for path in (request.modes, request.bench) if path is not None
        )
        return self._of_store(), files, self._of_model(request)

    def _of_store(self) -> Hashable:
        if self._store is None:
            return None
        with self._store.reading() as session:
            return _newest(session)

    def _of_model(self, request: TwinRequest) -> Hashable:
        """Nothing where a law answers; any change of the registry where a version is named."""
        if request.contact in LAWS:
            return None
        registry = registry_of(self._db)
        if registry.connection.nothing_there:
            return None
        state = self._state(registry)
        if request.contact not in (None, REGISTERED):
            return state
        with self._lock:
            if self._known is None or self._known[0] != state:
                self._known = state, {}
            champions = self._known[1]
            if request.campaign not in champions:
                champions[request.campaign] = self._champion(registry, request.campaign)
            return champions[request.campaign]

    def _champion(self, registry: Registry, campaign: str | None) -> str | None:
        """SHA-256 of the model in use for the kind of a campaign's bench, or of the newest
        gun's."""
        if self._store is None:
            version = model_in_use(None, registry, GUN)
        else:
            with self._store.reading() as session:
                version = model_in_use(session, registry, bench_of_campaign(session, campaign).kind)
        return None if version is None else version.sha256

    def _state(self, registry: Registry) -> Hashable:
        """Of the registry's file; of a server, the time in steps."""
        database = registry.place.database
        if database is None:
            return int(time.monotonic() / _ASKED_EVERY_S)
        return _signature(database), _signature(database.with_name(f"{database.name}-wal"))


def _newest(session: Session) -> Hashable:
    keys = [select(func.max(table.id)).scalar_subquery() for table in _TABLES]
    return tuple(session.execute(select(*keys)).one())


def _signature(path: Path) -> tuple[int, int] | None:
    """When a file was written and its size; None where there is none."""
    try:
        state = path.stat()
    except OSError:
        return None
    return state.st_mtime_ns, state.st_size


#: A solved plate with its answers takes some 20 MB.
KEPT = 4
#: So many draws meet every plate of the ensemble.
_DRAWS = 64
_VELOCITY_M_S = 5.0

_Key = tuple[TwinRequest, Hashable]


class TwinCache:
    """The last few twins of a store (None: of the shipped bench), for use from several threads.

    `build` makes one, as `twin_of`. A twin is built anew when campaigns, shots, impacts, pulses,
    materials or adopted effects were added to the store, and when another model is in use.
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
        self._stamps = CacheKeyReader(store, db)
        self._ready: OrderedDict[_Key, BuiltTwin] = OrderedDict()
        self._shelf = threading.Lock()
        #: One is built at a time: who asks for the same one waits for it, and MLflow's settings are
        #: the process's.
        self._building = threading.Lock()

    def get(self, request: TwinRequest) -> BuiltTwin:
        """The twin, ready to be asked. Raises as `twin_of`, and what is missing of
        `pyroshock[models]` as one line."""
        key = (request, self._stamps.stamp(request))
        twin = self._taken(key)
        if twin is not None:
            return twin
        with self._building:
            twin = self._taken(key)
            if twin is None:
                with models_extra():
                    twin = self._build(self._store, self._db, request)
                warm_up(twin)
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


def warm_up(built: BuiltTwin) -> None:
    """Let the twin make what it keeps: the answer of every plate of its ensemble at every impact
    position."""
    positions = (
        built.twin.plate.ensemble(built.plate.name)[0].impact_points
        if built.twin.sensor_names
        else ("#1",)
    )
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
