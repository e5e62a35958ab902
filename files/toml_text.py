"""TOML that somebody else has written: how large, how wide and how deep it may be is asked before
it is parsed.

Python's own parser takes time and memory that grow with the square of the parts of a dotted key:
16,000 parts, 32 kB, took 3 s and 1.0 GB. What is within the limits is parsed in a second and 100 MB
at most.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from .delimited_text import decode_utf8

#: The shipped files have 0.2 to 1.5 kB, fewer than 60 keys and five levels.
LARGEST_BYTES, MOST_KEYS, DEEPEST = 2**18, 10_000, 16

_PART = r"""(?:[A-Za-z0-9_-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')"""
#: Wherever it stands, in a text or a comment, too: whether it is a key, only parsing would tell.
_DEEP_KEY = re.compile(rf"(?<![\\A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{DEEPEST},}}+")
#: A sign of equality (not a ruler of them), or a line that begins as a table does.
_KEY = re.compile(r"(?<!=)=(?!=)|^[ \t]*+\[", re.MULTILINE)


def read_toml_text(path: Path) -> str:
    """The text of a TOML file, with or without a byte order mark.

    Parameters:
        path: The file.

    Raises:
        ValueError: Where the file is no UTF-8, or larger than `LARGEST_BYTES`, of which no more is
            read.
        OSError: Where the file cannot be read.
    """
    with path.open("rb") as file:
        content = file.read(LARGEST_BYTES + 1)
    if len(content) > LARGEST_BYTES:
        raise ValueError(
            f"the file has {max(path.stat().st_size, len(content)):,} bytes; {_AT_MOST_BYTES}"
        )
    return decode_utf8(content)


def toml_table(text: str) -> dict[str, Any]:
    """What the text of a TOML file says.

    Parameters:
        text: The text of the file.

    Raises:
        ValueError: For a text that is no TOML, and for one beyond a limit of size, of keys or of
            depth; the message says which limit, and by how far.
    """
    _check_size(text)
    try:
        table = tomllib.loads(text)
    except RecursionError as error:
        raise ValueError(
            f"lists or tables lie within each other hundreds deep; {_AT_MOST_DEEP}"
        ) from error
    except ValueError as error:  # a number of thousands of digits is no TOMLDecodeError
        raise ValueError(f"not TOML: {error}") from error
    if (depth := _depth(table)) > DEEPEST:
        raise ValueError(f"lists or tables lie within each other {depth} deep; {_AT_MOST_DEEP}")
    return table


def key_problems(table: Mapping[str, Any], allowed: Collection[str], prefix: str = "") -> list[str]:
    """A message for each key of a table that is not allowed.

    Parameters:
        table: The table as it was read.
        allowed: The keys that it may have; the message lists them.
        prefix: What stands before the key in the message, such as "bench."; by default nothing.
    """
    expected = ", ".join(allowed)
    return [
        f"unknown key {_shortened(f'{prefix}{key}')}; known: {expected}"
        for key in table
        if key not in allowed
    ]


def check_keys(
    table: object, allowed: Collection[str], where: str, required: Collection[str] = ()
) -> None:
    """Refuse a table whose keys are not those expected.

    Parameters:
        table: The value that should be a table, as it was read.
        allowed: The keys that it may have; the message lists them.
        where: How the message names the table, such as "[plate]".
        required: Those of the allowed keys that it must have; by default none.

    Raises:
        ValueError: For a value that is no table, for an unknown key, and for a required key that is
            missing.
    """
    if not isinstance(table, Mapping):
        raise ValueError(f"{where} is {_shortened(table)}; expected a table")
    for problem in key_problems(table, allowed):
        raise ValueError(f"{where}: {problem}")
    for key in required:
        if key not in table:
            raise ValueError(f"{where}: key {key!r} is missing; expected {', '.join(allowed)}")


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 100 else text[:100] + "…"


_AT_MOST_BYTES = f"expected TOML of at most {LARGEST_BYTES:,} bytes"
_AT_MOST_DEEP = f"expected at most {DEEPEST} of them"


def _check_size(text: str) -> None:
    if (size := len(text.encode("utf-8", "surrogatepass"))) > LARGEST_BYTES:
        raise ValueError(f"the text has {size:,} bytes; {_AT_MOST_BYTES}")
    if (keys := len(_KEY.findall(text))) > MOST_KEYS:
        raise ValueError(f"the text has {keys:,} keys and tables; expected at most {MOST_KEYS:,}")
    if deep_key := _DEEP_KEY.search(text):
        parts = len(re.findall(_PART, deep_key[0]))
        raise ValueError(
            f"the key {deep_key[0][:40] + '…'!r} has {parts:,} parts joined "
            f"by dots; expected at most {DEEPEST}"
        )


def _depth(table: dict[str, Any]) -> int:
    """Of tables and lists, the whole being the first; counted without recursion, which would end at
    some depth."""
    depth, level = 0, list[Any]([table])
    while level:
        depth += 1
        inside = [
            nested
            for container in level
            for nested in (container.values() if isinstance(container, dict) else container)
        ]
        level = [nested for nested in inside if isinstance(nested, dict | list)]
    return depth
