"""The library's names, room by room: for each module what it is for, then its functions and classes
by autodoc."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType
from typing import Any

from pyroshock.schema.base import Base

from .markdown import joined, prose
from .rooms import ROOMS


def page(room: str) -> str:
    """A section a module."""
    return joined(*(_section(module) for module in modules(room)))


def modules(room: str) -> Iterator[ModuleType]:
    """The modules of a room that the reference tells."""
    for name in ROOMS[room]:
        yield import_module(f"pyroshock.{room}.{name}")


def members(module: ModuleType) -> list[Any]:
    """Its own public functions and classes in the order of the file; rows of the store are told by
    their tables."""
    return [
        thing
        for name, thing in vars(module).items()
        if not name.startswith("_")
        and (inspect.isclass(thing) or inspect.isroutine(thing))
        and getattr(thing, "__module__", "") == module.__name__
        and getattr(thing, "__name__", "") == name
        and not (inspect.isclass(thing) and issubclass(thing, Base))
    ]


def _section(module: ModuleType) -> str:
    name = module.__name__
    lines = [f".. py:module:: {name}", ""]
    for thing in members(module):
        if inspect.isclass(thing):
            lines += [f".. autoclass:: {name}.{thing.__name__}", "   :members:", ""]
        else:
            lines += [f".. autofunction:: {name}.{thing.__name__}", ""]
    return joined(f"## {name}", prose(module.__doc__), "\n".join(["```{eval-rst}", *lines, "```"]))
