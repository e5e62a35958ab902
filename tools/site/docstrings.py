"""Docstrings and signatures for autodoc: plain prose becomes reStructuredText that shows what it
says."""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import Any

from sphinx.application import Sphinx

from ..reference.api import documented
from ..reference.blocks import blocks_of
from ..reference.comments import field_comments, source_of

_SPAN = re.compile(r"`([^`]+)`")
#: What reStructuredText takes for a list, a field, a comment or an option where a paragraph begins.
_BEGINNING = re.compile(r"\(?[A-Za-z0-9#]+[.)] |[-+*•–—:|>/]|\.\. ")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.]*")
_PLAIN = (int, float, str, bool, type(None))


def setup(app: Sphinx) -> None:
    """Connects the events."""
    app.connect(
        "builder-inited", lambda _: documented()
    )  # imports it all once, before readers part
    app.connect("autodoc-process-docstring", _docstring)
    app.connect("autodoc-process-signature", _signature)
    app.connect("autodoc-skip-member", _skip)


def rst(doc: str) -> list[str]:
    """A docstring's lines."""
    lines: list[str] = []
    for block in blocks_of(doc):
        if block.kind == "code":
            lines += ["::", "", *(f"   {line}".rstrip() for line in block.text.split("\n")), ""]
        elif block.kind == "item":
            lines += [f"- {paragraph(block.text)}", ""]
        else:
            lines += [paragraph(block.text), ""]
    return lines


def paragraph(text: str) -> str:
    """One line of text, its code spans as literals and nothing else as markup."""
    made, at = "", 0
    for span in _SPAN.finditer(text):
        made += _escaped(text[at : span.start()])
        before = "" if not made or made[-1].isspace() else "\\ "
        after = "" if span.end() == len(text) or text[span.end()].isspace() else "\\ "
        made += f"{before}``{span[1].strip()}``{after}"
        at = span.end()
    made += _escaped(text[at:])
    if made.endswith("::"):
        made = made[:-1] + "\\:"
    return f"\\{made}" if _BEGINNING.match(made) else made


def _escaped(text: str) -> str:
    return re.sub(r"([\\*|_`])", r"\\\1", text)


def fields_of(kind: type) -> list[str]:
    """A list of the fields of a record that have a comment."""
    if not dataclasses.is_dataclass(kind):
        return []
    comments = field_comments(kind)
    named = [each.name for each in dataclasses.fields(kind) if each.name in comments]
    return [line for name in named for line in (f"- ``{name}``: {paragraph(comments[name])}", "")]


def signature_of(thing: Any, *, bound: bool = False) -> str | None:
    """Parameters and what is returned, as the source spells them; None where there is no signature.

    Names that the reference has are given in full, so that they become links. `bound` leaves the
    first parameter out.
    """
    try:
        signature = inspect.signature(thing)
    except (TypeError, ValueError):
        return None
    names = names_of(thing.__module__)
    parameters = list(signature.parameters.values())[1 if bound else 0 :]
    spelled = [
        each.replace(annotation=_annotation(each.annotation, names), default=_default(each.default))
        for each in parameters
    ]
    return str(
        signature.replace(
            parameters=spelled, return_annotation=_annotation(signature.return_annotation, names)
        )
    )


@cache
def names_of(module: str) -> Mapping[str, Any]:
    """What a module knows by name: what it holds, and what it imports for annotations alone."""
    known = sys.modules[module]
    found: dict[str, Any] = {}
    for node in _for_annotations(source_of(module).tree):
        source = import_module("." * node.level + (node.module or ""), known.__package__)
        found |= {each.asname or each.name: getattr(source, each.name, None) for each in node.names}
    return found | vars(known)


def _for_annotations(tree: ast.Module) -> Iterator[ast.ImportFrom]:
    """The package's own imports under `if TYPE_CHECKING`."""
    for node in tree.body:
        if (
            isinstance(node, ast.If)
            and isinstance(node.test, ast.Name)
            and node.test.id == "TYPE_CHECKING"
        ):
            yield from (
                each for each in node.body if isinstance(each, ast.ImportFrom) and each.level
            )


class _Raw:
    """What a signature prints as it is."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def _annotation(annotation: Any, names: Mapping[str, Any]) -> Any:
    if annotation is inspect.Parameter.empty:
        return annotation
    text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
    return _Raw(_NAME.sub(lambda name: _in_full(name[0], names), text))


def _in_full(name: str, names: Mapping[str, Any]) -> str:
    thing = names.get(name)
    full = f"{getattr(thing, '__module__', '')}.{getattr(thing, '__name__', '')}"
    return full if full in documented() else name


def _default(value: Any) -> Any:
    if value is inspect.Parameter.empty:
        return value
    plain = isinstance(value, _PLAIN) or (
        isinstance(value, tuple) and all(isinstance(v, _PLAIN) for v in value)
    )
    return _Raw(repr(value) if plain and len(repr(value)) < 60 else "...")


def _docstring(
    _app: Sphinx, what: str, _name: str, thing: Any, _options: Any, lines: list[str]
) -> None:
    made = rst("\n".join(lines))
    if what == "class" and isinstance(thing, type):
        made += fields_of(thing)
    lines[:] = made


def _signature(
    _app: Sphinx,
    what: str,
    _name: str,
    thing: Any,
    _options: Any,
    signature: str | None,
    _returned: str | None,
) -> tuple[str | None, str | None] | None:
    if what not in ("function", "method", "class") or signature is None:
        return None
    first = next(iter(inspect.signature(thing).parameters), "") if what == "method" else ""
    text = signature_of(thing, bound=first in ("self", "cls"))
    if text is None:
        return None
    given, arrow, returned = text.rpartition(" -> ")
    return (given, returned if what != "class" else None) if arrow else (text, None)


def _skip(
    _app: Sphinx, what: str, _name: str, thing: Any, skip: bool, _options: Any
) -> bool | None:
    """Fields of records are told in one list, not one by one."""
    if (
        what == "class"
        and not skip
        and not (callable(thing) or isinstance(thing, property | classmethod))
    ):
        cached = type(thing).__name__ == "cached_property"
        return None if cached else True
    return None
