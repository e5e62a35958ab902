"""What a page says that its commands print, held against what they did print."""

from __future__ import annotations

import math
import re

#: A figure of another machine may differ in its last digits.
TOLERANCE = 0.02
#: ... but a count is a count.
_COUNTS_BELOW = 1000.0
#: ... and a share is told to some percent.
_PERCENT = 3.0
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?: %)?")


def missing(shown: str, printed: str) -> str | None:
    """The first line of `shown` that `printed` has not after those before it; None where all are there.

    White space counts as one blank; a line that is `…` is passed over, one that ends with ` …` is the beginning of a
    line.
    """
    rest = iter(printed.splitlines())
    for line in shown.splitlines():
        wanted = " ".join(line.split())
        if wanted in ("", "…"):
            continue
        if not any(alike(wanted, " ".join(each.split())) for each in rest):
            return line
    return None


def alike(wanted: str, told: str) -> bool:
    if wanted.endswith("…"):
        wanted = wanted.removesuffix("…").rstrip()
        told = " ".join(told.split(" ")[: len(wanted.split(" "))])
    if _NUMBER.split(wanted) != _NUMBER.split(told):
        return False
    pairs = list(zip(_NUMBER.findall(wanted), _NUMBER.findall(told), strict=True))
    return all(a.endswith("%") == b.endswith("%") and _near(a, b) for a, b in pairs)


def _near(wanted: str, told: str) -> bool:
    if wanted.endswith("%"):
        return math.isclose(float(wanted[:-1]), float(told[:-1]), abs_tol=_PERCENT)
    a, b = float(wanted), float(told)
    mantissa, _, power = wanted.partition("e")
    _, point, decimals = mantissa.partition(".")
    if not point and abs(a) < _COUNTS_BELOW:
        return a == b
    last_digit = 10.0 ** (int(power or 0) - len(decimals))
    return math.isclose(a, b, rel_tol=TOLERANCE, abs_tol=2 * last_digit)
