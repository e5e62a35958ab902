"""Numbers that decide, with their reasons: a module's constants as a table."""

from __future__ import annotations

from types import ModuleType

from .comments import constants
from .markdown import code, escaped, table

_LONGEST = 60


def constants_table(*modules: ModuleType) -> str:
    """Name, value and reason of the public constants that are numbers or words; "" where there are
    none."""
    rows = [
        (code(name), code(shown), escaped(comment))
        for module in modules
        for name, value, comment in constants(module)
        if (shown := text_of(value)) is not None
    ]
    return table(["limit", "value", "reason"], rows)


def text_of(value: object) -> str | None:
    """A number, a word or some of them; None for anything else, and for what is too long to be
    looked at."""
    if isinstance(value, bool | int | float | str):
        text = f"{value:g}" if isinstance(value, float) else str(value)
    elif (
        isinstance(value, tuple)
        and value
        and all(isinstance(each, int | float | str) for each in value)
    ):
        text = ", ".join(text_of(each) or "" for each in value)
    else:
        return None
    return text if text and len(text) <= _LONGEST else None
