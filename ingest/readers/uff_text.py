"""Universal files as programs write them, brought to the form that the standard gives and pyuff
reads.

Three liberties are met in files that other programs read: tags `-1` and set numbers at another
column, and data lines that are filled up with blanks to column 80. Binary samples are passed over
by the byte count that their set states.
"""

from __future__ import annotations

import re
from typing import NamedTuple

TAG = b"    -1"
#: A tag stands in the first six columns of a line of its own.
_TAG_LINE = re.compile(rb"\n[ ]{0,4}-1[ \t]*(?=\r?(?:\n|\Z))")
_SET_LINE = re.compile(rb"[ ]{0,6}(\d{1,6})(b?)([^\r\n]*)\r?\n")
_BLANKS_AT_END = re.compile(rb"[ \t]+(?=\r?\n)")
_HEAD_LINES = 11
_FUNCTION = b"58"


def normalised(raw: bytes) -> bytes:
    """`raw` with tags and set numbers right-aligned to column 6, and no blanks behind the numbers
    of sets 58."""
    raw = b"\n" + raw  # every tag has a line end before it
    parts: list[bytes] = []
    position = 1
    while (tag := _next_tag(raw, position)) is not None:
        parts += [raw[position : tag.start], TAG]
        position = _line_end(raw, tag.end)
        parts.append(raw[tag.end : position])
        head = _SET_LINE.match(raw, position)
        if head is None:
            continue
        number, binary, facts = head.groups()
        parts.append(b"%6d%b%b" % (int(number), binary, facts) + raw[head.end(3) : head.end()])
        position = head.end() + (_binary_part(raw, head.end(), facts) if binary else 0)
        parts.append(raw[head.end() : position])
        closing = _next_tag(raw, position)
        end = len(raw) if closing is None else closing.start
        numbers = (
            _after_lines(raw, position, _HEAD_LINES) if number == _FUNCTION and not binary else end
        )
        parts.append(raw[position : min(numbers, end)])
        samples = raw[numbers:end]
        padded = b" \n" in samples or b" \r\n" in samples
        parts.append(_BLANKS_AT_END.sub(b"", samples) if padded else samples)
        if closing is None:
            return b"".join(parts)
        position = _line_end(raw, closing.end)
        parts += [TAG, raw[closing.end : position]]
    parts.append(raw[position:])
    return b"".join(parts)


class _Tag(NamedTuple):
    """From its first column to behind its blanks."""

    start: int
    end: int


def _next_tag(raw: bytes, position: int) -> _Tag | None:
    """The tag from `position` on, which begins a line."""
    match = _TAG_LINE.search(raw, position - 1)
    return None if match is None else _Tag(match.start() + 1, match.end())


def _line_end(raw: bytes, position: int) -> int:
    """Behind the end of the line."""
    return raw.find(b"\n", position) + 1 or len(raw)


def _after_lines(raw: bytes, position: int, lines: int) -> int:
    """Where the line after so many from `position` on begins."""
    for _ in range(lines):
        position = _line_end(raw, position)
    return position


def _binary_part(raw: bytes, position: int, facts: bytes) -> int:
    """Bytes of the head lines and samples of a binary set, from its byte order, format, head lines
    and sample bytes."""
    words = facts.split()
    if len(words) < 4 or not all(word.isdigit() for word in words[2:4]):
        return 0
    samples = _after_lines(raw, position, min(int(words[2]), 2 * _HEAD_LINES))
    return min(samples + int(words[3]), len(raw)) - position
