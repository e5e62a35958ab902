"""Every kind of job: a new one is a file `job.py` of its feature, and a row here."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, MutableMapping
from typing import Any

from .kind import Kind


class KindTable(MutableMapping[str, Kind[Any]]):
    """Kinds of jobs by name. The module of a kind is imported when the kind is first asked for.

    So the queue, which all features use, imports no feature.
    """

    def __init__(self, places: dict[str, tuple[str, str]]) -> None:
        self._places: dict[str, tuple[str, str] | Kind[Any]] = dict(places)

    def __getitem__(self, name: str) -> Kind[Any]:
        place = self._places[name]
        if isinstance(place, Kind):
            return place
        module, attribute = place
        kind = getattr(importlib.import_module(module, __package__.partition(".")[0]), attribute)
        assert isinstance(kind, Kind)
        self._places[name] = kind
        return kind

    def __setitem__(self, name: str, kind: Kind[Any]) -> None:
        self._places[name] = kind

    def __delitem__(self, name: str) -> None:
        del self._places[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


#: Kind of job -> (module of the package, its object there).
KINDS = KindTable(
    {
        "ingest": (".app.ingest.job", "INGEST"),
        "extract": (".app.ingest.job", "EXTRACT"),
        "plan": (".app.plan.job", "PLAN"),
        "train": (".app.train.job", "TRAIN"),
        "tune": (".app.tune.job", "TUNE"),
        "diagnose": (".app.diagnose.job", "DIAGNOSE"),
        "validate": (".app.validate.job", "VALIDATE"),
    }
)
