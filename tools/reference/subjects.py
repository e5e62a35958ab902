"""What a page may ask for by `<!-- generated: SUBJECT -->`."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial

from . import (
    api,
    checks,
    commands,
    designs,
    effects,
    models,
    observables,
    operations,
    readers,
    tables,
)
from .rooms import ROOMS

#: Subject -> its Markdown.
SUBJECTS: dict[str, Callable[[], str]] = {
    "commands": commands.page,
    "operations": operations.page,
    "tables": tables.page,
    "effects": effects.page,
    "readers": readers.page,
    "checks": checks.page,
    "designs": designs.page,
    "models": models.page,
    "observables": observables.page,
    **{f"api {room}": partial(api.page, room) for room in ROOMS},
}

_MARK = re.compile(r"^<!-- generated: ([a-z. ]+) -->$", re.MULTILINE)


def filled(text: str) -> str:
    """A page with what it asks for. Raises `LookupError` for a subject that there is not."""
    return _MARK.sub(lambda mark: _subject(mark[1])(), text)


def asked(text: str) -> list[str]:
    """The subjects that a page asks for."""
    return _MARK.findall(text)


def _subject(name: str) -> Callable[[], str]:
    if name not in SUBJECTS:
        raise LookupError(f"no subject {name!r} of the reference; there are: {', '.join(SUBJECTS)}")
    return SUBJECTS[name]
