"""What a page is made of: as long as that stays the same, so does the page."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ...schema.change_stamp import ChangeStamp
from ...schema.engine import make_engine
from ..common.model_registry import registry_of

if TYPE_CHECKING:
    from sqlalchemy import Engine

    from ...training.registry.registry import Registry


@dataclass(frozen=True)
class PageSource:
    """A dependency of a route whose page follows from its address and the store alone or, with
    `models`, from the registry of models and its files as well; never from the time of day."""

    models: bool = False

    def __call__(self) -> None:
        """Called for each request; there is nothing to do."""


THE_STORE, STORE_AND_MODELS = PageSource(), PageSource(models=True)


class SourceStamps:
    """Reads the stamp of what pages are made of. For use from several threads."""

    def __init__(self, engine: Engine, db: str) -> None:
        self._db = db
        self._store = ChangeStamp(engine)
        self._registry: ChangeStamp | None = None

    def stamp(self, source: PageSource) -> Hashable:
        """Equal as long as a page that rests on this source stays the same; None where that cannot
        be known."""
        store = self._store.read()
        if store is None or not source.models:
            return store
        models = self._of_models(registry_of(self._db))
        return None if models is None else (store, models)

    def close(self) -> None:
        """Close the connections."""
        self._store.close()
        if self._registry is not None:
            self._registry.close()

    def _of_models(self, registry: Registry) -> Hashable:
        place = registry.place
        if registry.connection.nothing_there:
            return "nothing there"
        if place.is_server or place.files is not None:
            return None
        if self._registry is None:
            self._registry = ChangeStamp(place.database or make_engine(place.tracking_uri))
        tables = self._registry.read()
        return None if tables is None else (tables, _files_below(place.folder))


def _files_below(folder: Path) -> Hashable:
    """Path, number, size and time of writing of each file and folder below a folder."""
    states = ((path, path.lstat()) for path in sorted(folder.rglob("*")))
    return hash(tuple((path, s.st_ino, s.st_size, s.st_mtime_ns) for path, s in states))
