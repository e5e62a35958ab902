"""What autodoc does not know of the package: the comments that explain fields of a class, and types
that a signature names without their module."""

from __future__ import annotations

import dataclasses
from typing import Any

from docutils import nodes  # type: ignore[import-untyped]  # it publishes no types
from sphinx import addnodes
from sphinx.application import Sphinx

from ..reference.api import modules
from ..reference.comments import field_comments
from ..reference.rooms import ROOMS


def setup(app: Sphinx) -> None:
    """Connects the events."""
    app.connect("builder-inited", _import_rooms)
    app.connect("autodoc-process-docstring", _with_fields)
    app.connect("autodoc-skip-member", _skip)
    app.connect("doctree-read", _find_types_anywhere)


def fields_of(kind: type) -> list[str]:
    """A list of the fields of a record that have a comment."""
    comments = field_comments(kind) if dataclasses.is_dataclass(kind) else {}
    return [line for name, text in comments.items() for line in (f"- ``{name}``: {text}", "")]


def _import_rooms(_: Sphinx) -> None:
    """Before Sphinx forks its readers, so that each does not import all rooms again."""
    for room in ROOMS:
        list(modules(room))


def _with_fields(
    _app: Sphinx, what: str, _name: str, member: Any, _options: Any, lines: list[str]
) -> None:
    if what == "class" and isinstance(member, type):
        lines += ["", *fields_of(member)]


def _skip(
    _app: Sphinx, what: str, _name: str, member: Any, skip: bool, _options: Any
) -> bool | None:
    """Fields of records are in one list, not one by one."""
    if what != "class" or skip or callable(member) or isinstance(member, property | classmethod):
        return None
    return None if type(member).__name__ == "cached_property" else True


def _find_types_anywhere(_: Sphinx, document: nodes.document) -> None:
    """Signatures name a type as their module imports it; a class has one name in the package."""
    for reference in document.findall(addnodes.pending_xref):
        if reference.get("refdomain") == "py" and reference.get("reftype") in ("class", "exc"):
            reference["refspecific"] = True
