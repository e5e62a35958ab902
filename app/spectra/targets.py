"""An uploaded specification as the target of a tune or a spectrum, read as `--target` reads a file."""

from __future__ import annotations

import csv
from pathlib import PurePath
from typing import TYPE_CHECKING

from ...twin.srs.target import parse_tolerance
from ...twin.srs.target_csv import target_of_csv

if TYPE_CHECKING:
    from ...twin.srs.target import Target

#: A specification has tens of break points; a measured spectrum as one has a few hundred lines.
MOST_BYTES, MOST_POINTS = 262_144, 2_000
#: Beyond these no oscillator of a bench lies, and sums over octaves have no end.
LOWEST_HZ, HIGHEST_HZ = 1e-2, 1e6
_LONGEST_NAME = 80


def target_from_upload(content: bytes | str, name: str, tolerance: str | None = None) -> Target:
    """The target in a CSV's content; `name` is what errors call it, `tolerance` such as 6dB goes before the file's.

    Raises `ValueError` naming file, line and value of what is wrong, and for content that is too large: more than
    `MOST_BYTES` or `MOST_POINTS`, or a frequency that is none of a bench.
    """
    source = source_name(name)
    raw = content.encode("utf-8", "replace") if isinstance(content, str) else content
    if len(raw) > MOST_BYTES:
        raise ValueError(f"{source}: {len(raw)} bytes; expected a specification of at most {MOST_BYTES}")
    wanted = parse_tolerance(tolerance) if tolerance else None
    try:
        target = target_of_csv(raw, source, wanted)
    except csv.Error as error:
        raise ValueError(f"{source}: no CSV table ({error}); expected a header such as frequency_hz,level_g") from error
    if target.frequency_hz.size > MOST_POINTS:
        raise ValueError(f"{source}: {target.frequency_hz.size} points; expected at most {MOST_POINTS}")
    for hz in (float(target.frequency_hz[0]), float(target.frequency_hz[-1])):
        if not LOWEST_HZ <= hz <= HIGHEST_HZ:
            raise ValueError(f"{source}: frequency_hz is {hz:g}; expected {LOWEST_HZ:g} to {HIGHEST_HZ:g} Hz")
    return target


def source_name(name: str) -> str:
    """The last part of an upload's name, on one line and short: it stands in errors, and nowhere in a path."""
    last = PurePath(name.replace("\\", "/")).name
    return "".join(sign for sign in last if sign.isprintable())[:_LONGEST_NAME] or "specification"
