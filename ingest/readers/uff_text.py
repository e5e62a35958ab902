"""Universal files as programs write them, brought to the form that the standard gives and pyuff reads.

Three liberties are met in files that other programs read: tags `-1` and set numbers at another column, and data lines
that are filled up with blanks to column 80. Binary samples are passed over by the byte count that their set states.
"""

from __future__ import annotations

import re

TAG = b"    -1"
_TAG_COLUMNS = 6
_SET_LINE = re.compile(rb"\s{0,6}(\d{1,6})(b?)(.*)", re.DOTALL)
_HEAD_LINES = 11
_FUNCTION = b"58"


def normalised(raw: bytes) -> bytes:
    """`raw` with tags and set numbers right-aligned to column 6, and no blanks behind the numbers of sets 58."""
    parts: list[bytes] = []
    position, line_of_set, number = 0, None, b""
    while position < len(raw):
        end = raw.find(b"\n", position) + 1 or len(raw)
        line, position = raw[position:end], end
        if line[:_TAG_COLUMNS].strip() == b"-1" and not line[_TAG_COLUMNS:].strip():
            parts.append(TAG + _line_end(line))
            line_of_set = 0 if line_of_set is None else None
            continue
        if line_of_set == 0 and (match := _SET_LINE.fullmatch(line.rstrip(b"\r\n"))):
            number = match.group(1) if not match.group(2) else b""
            parts.append(b"%6d%b%b" % (int(match.group(1)), match.group(2), match.group(3)) + _line_end(line))
            if match.group(2):
                size = _binary_part(raw, position, match.group(3))
                parts.append(raw[position : position + size])
                position += size
            line_of_set = 1
            continue
        if line_of_set is not None:
            line_of_set += 1
            if number == _FUNCTION and line_of_set > _HEAD_LINES + 1:
                line = line.rstrip() + _line_end(line)
        parts.append(line)
    return b"".join(parts)


def _line_end(line: bytes) -> bytes:
    return b"\r\n" if line.endswith(b"\r\n") else b"\n" if line.endswith(b"\n") else b""


def _binary_part(raw: bytes, position: int, facts: bytes) -> int:
    """Bytes of the head lines and samples of a binary set, from its byte order, format, head lines and sample bytes."""
    words = facts.split()
    if len(words) < 4 or not all(word.isdigit() for word in words[2:4]):
        return 0
    end = position
    for _ in range(int(words[2])):
        end = raw.find(b"\n", end) + 1
        if end == 0:
            return 0
    return end - position + int(words[3])
