"""Every model that can be trained, and every kind of model and regression that it is made of."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from pyroshock.training.models.catalogue import MODEL_SPECS, BuildOptions
from pyroshock.training.models.serialization import KINDS, describe

from .markdown import code, escaped, joined, prose, table


def page() -> str:
    """The models by their names, then a section a kind."""
    rows = [
        (code(name), _made_of(describe(entry.make(BuildOptions()))))
        for name, entry in MODEL_SPECS.items()
    ]
    return joined(
        "## Models by name",
        f"What {code('pyroshock train --models')} takes; settings are those "
        f"that differ from a kind's own.",
        table(["model", "made of"], rows),
        "## Kinds",
        *(_kind(name) for name in KINDS),
    )


def class_of(kind: str) -> type[Any]:
    """The class of a kind."""
    module, name = KINDS[kind]
    found = getattr(import_module(f"pyroshock.training.{module}"), name)
    assert isinstance(found, type)
    return found


def defaults(kind: str) -> dict[str, Any]:
    """A kind's settings where nothing is said; those without a default are left out."""
    parameters = inspect.signature(class_of(kind)).parameters.values()
    return {
        each.name: each.default
        for each in parameters
        if each.default is not inspect.Parameter.empty
    }


def _made_of(description: Mapping[str, Any]) -> str:
    """ "calibrated (pair (linear, contact-time, scaling=momentum))"."""
    own = defaults(description["kind"])
    parts = []
    for name, value in description["settings"].items():
        if isinstance(value, dict) and value.keys() == {"kind", "settings"}:
            parts.append(_made_of(value))
        elif name not in own or not _same(value, own[name]):
            parts.append(f"{escaped(name)}={escaped(_text(value))}")
    link = f"[{description['kind']}](#{description['kind']})"
    return f"{link} ({', '.join(parts)})" if parts else link


def _same(value: Any, default: Any) -> bool:
    return value == (list(default) if isinstance(default, tuple) else default) or (
        value == {} and default is None
    )


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)


def _kind(kind: str) -> str:
    found = class_of(kind)
    module = import_module(found.__module__)
    rows = [(code(name), escaped(_text(_plain(value)))) for name, value in defaults(kind).items()]
    where = f"Class {code(f'{found.__module__}.{found.__name__}')}."
    settings = table(["setting", "default"], rows)
    return joined(f"### {kind}", prose(module.__doc__), prose(found.__doc__), where, settings)


def _plain(value: Any) -> Any:
    """As JSON has it; an object by its kind."""
    if isinstance(value, tuple):
        return [_plain(each) for each in value]
    return (
        value
        if isinstance(value, str | int | float | bool | None)
        else getattr(value, "kind", repr(value))
    )
