"""Every way of designing a campaign, the shipped factors, and the figures by which a design is
judged."""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Callable, Iterator
from dataclasses import fields
from importlib import import_module
from typing import Any

from pyroshock.doe import designs
from pyroshock.doe.designs.base import Design
from pyroshock.doe.designs.methods import METHODS, DesignMethod, Option
from pyroshock.doe.factors import DesignFactor
from pyroshock.doe.merit import Quality
from pyroshock.doe.space import Space, gun_space, hammer_space

from .comments import field_comments
from .markdown import code, escaped, joined, prose, table


def functions() -> Iterator[Callable[..., Any]]:
    """The functions in `doe/designs/` that give a design, a file after the other."""
    for found in sorted(pkgutil.iter_modules(designs.__path__), key=lambda each: each.name):
        module = import_module(f"{designs.__name__}.{found.name}")
        kinds = {
            name
            for name, thing in vars(module).items()
            if isinstance(thing, type) and issubclass(thing, Design)
        }
        for name, thing in vars(module).items():
            own = (
                inspect.isfunction(thing)
                and thing.__module__ == module.__name__
                and not name.startswith("_")
            )
            if own and thing.__annotations__.get("return") in kinds:
                yield thing


def page() -> str:
    """A section a method, and one for each function behind them; then factors and figures."""
    gun, hammer = gun_space(), hammer_space()
    return joined(
        *(_method(name, method) for name, method in METHODS.items()),
        *(_section(function) for function in functions()),
        _space("Factors of the gun", gun),
        _space("Factors of the hammer", hammer),
        _figures(),
    )


def _method(name: str, method: DesignMethod) -> str:
    rows = [
        (code(option.name), _values(option), _default(option), escaped(option.help))
        for option in method.options
    ]
    options = table(["option", "values", "default", "what it is"], rows) if rows else ""
    lines = "\n".join(f"pyroshock {line}" for line in method.example.splitlines())
    return joined(f"## {name}", escaped(method.help), f"```sh\n{lines}\n```", options)


def _values(option: Option) -> str:
    return escaped(
        ", ".join(option.choices)
        or {str: "text", int: "whole number", float: "number"}[option.kind]
    )


def _default(option: Option) -> str:
    return "" if option.default is None else code(str(option.default))


def _section(function: Callable[..., Any]) -> str:
    module = import_module(function.__module__)
    title = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
    call = (
        f"from {function.__module__} import "
        f"{function.__name__}\n\n{function.__name__}{inspect.signature(function)}"
    )
    called = call.replace("'", "").replace(", /", "")
    return joined(
        f"## {title}", prose(module.__doc__), f"```python\n{called}\n```", prose(function.__doc__)
    )


def _space(title: str, space: Space) -> str:
    axes = {factor.name: axis.name for axis in space.axes for factor in axis.factors}
    rows = [
        (code(f.name), code(f.column), _levels(f), str(f.change), code(axes[f.name]))
        for f in space.factors
    ]
    header = ["factor", "column", "levels", "work to change", "axis"]
    return joined(f"## {title}", f"{space.size} feasible treatments.", table(header, rows))


def _levels(factor: DesignFactor) -> str:
    words = factor.level_text
    if factor.values:
        words += f" ({', '.join(f'{value:g}' for value in factor.values)})"
    return escaped(f"{words} {factor.unit or ''}".strip())


def _figures() -> str:
    comments = field_comments(Quality)
    rows = [(code(each.name), escaped(comments.get(each.name, ""))) for each in fields(Quality)]
    return joined(
        "## Figures of a design", prose(Quality.__doc__), table(["figure", "what it is"], rows)
    )
