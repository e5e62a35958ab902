"""What a route may ask for: the store, the jobs, the settings, the twins that are kept built."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Path
from pydantic import AfterValidator, Field
from starlette.requests import Request

from ...schema.person_roles import Person
from ...schema.session import Store, Writer
from ..operations.laboratory import Laboratory
from ..operations.operation import UNWRITABLE
from ..twins.twin_cache import TwinCache
from .guard import INNER_SLASH
from .jobs import Jobs
from .settings import Settings


def _store(request: Request) -> Store:
    """The store, with this request as the writer of what it stores."""
    what = f"serve: {request.method} {request.url.path}"
    return signed(request.app.state.store, what, request.state.person)


def signed(store: Store, what: str, person: Person) -> Store:
    """The same store written by another hand: each request and each job signs its own rows, for the
    person who asked."""
    return Store(store.engine, Writer(what, store.writer.software_version, person))


def _person(request: Request) -> Person:
    person: Person = request.state.person
    return person


def _jobs(request: Request) -> Jobs:
    jobs: Jobs = request.app.state.jobs
    return jobs


def _settings(request: Request) -> Settings:
    settings: Settings = request.app.state.settings
    return settings


def _twins(request: Request) -> TwinCache:
    twins: TwinCache = request.app.state.twins
    return twins


def _laboratory(request: Request) -> Laboratory:
    settings = _settings(request)
    return Laboratory(_store(request), settings.db, folders=settings.folders, twins=_twins(request))


#: Who sends the request.
Asker = Annotated[Person, Depends(_person)]
OpenStore = Annotated[Store, Depends(_store)]
Running = Annotated[Jobs, Depends(_jobs)]
Configured = Annotated[Settings, Depends(_settings)]
#: The store with what the server may read, for operations.
InLaboratory = Annotated[Laboratory, Depends(_laboratory)]
Twins = Annotated[TwinCache, Depends(_twins)]
#: A name within an address, slashes included (`rendering.part` writes it).
Name = Annotated[
    str, Path(max_length=1000), AfterValidator(lambda name: name.replace(INNER_SLASH, "/"))
]


def writable(text: str) -> str:
    """A text that every store, page and spreadsheet takes. Raises `ValueError` with the character
    that is none."""
    unwritable = UNWRITABLE.search(text)
    if unwritable is not None:
        raise ValueError(
            f"has the character {unwritable[0]!r}, which cannot be written; leave it out"
        )
    return text


#: A text that is stored, or looked up among stored ones.
Text = Annotated[str, AfterValidator(writable)]
#: Keys of the store's tables: what a database's integer holds.
Key = Annotated[int, Path(ge=1, le=2**31 - 1)]


Word = Annotated[str, Field(max_length=200)]
