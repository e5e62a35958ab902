"""JSON that both engines take: NaN and infinities on purpose, and no text that a database refuses.

`to_plain` and `from_plain` are inverse on what JSON can say plus non-finite numbers; numpy scalars and arrays become
Python's, tuples lists, and what is no character (lone surrogates, NUL) a question mark or the replacement character.
"""

from __future__ import annotations

import math
from typing import Any

_FLOAT = "$float"  # JSON has no NaN, and PostgreSQL refuses Python's


def to_plain(value: Any) -> Any:
    """`value` as JSON types only. Raises `TypeError` for what has no such form."""
    if value is None or isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {_FLOAT: repr(float(value))}
    if isinstance(value, str):
        return value.encode("utf-8", "replace").decode("utf-8").replace("\x00", "\ufffd")
    if isinstance(value, dict):
        return {to_plain(str(key)): to_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [to_plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy's scalars and arrays
        return to_plain(value.tolist())
    raise TypeError(f"{type(value).__name__} {value!r} cannot be stored as JSON")


def from_plain(value: Any) -> Any:
    """The inverse of `to_plain`."""
    if isinstance(value, dict):
        if value.keys() == {_FLOAT}:
            return float(value[_FLOAT])
        return {key: from_plain(item) for key, item in value.items()}
    return [from_plain(item) for item in value] if isinstance(value, list) else value
