"""Numbers in the sentences of a report: three digits, whole per cent, lists in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

NOTHING = "–"
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def format_number(value: float | None, digits: int = 4) -> str:
    """A number for a person: `digits` significant digits, powers of ten below 0.0001 and from 10⁹
    on, no negative zero.

    A dash stands for None and for what is no number.
    """
    if value is None or math.isnan(value):
        return NOTHING
    if math.isinf(value):
        return "infinite" if value > 0 else "-infinite"
    rounded = float(f"{value:.{digits}g}")
    if rounded == 0:
        return "0"
    size = math.floor(math.log10(abs(rounded)))
    if not -4 <= size < 9:
        return _with_power_of_ten(value, digits)
    text = f"{rounded:.{max(0, digits - 1 - size)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def _with_power_of_ten(value: float, digits: int) -> str:
    """`1.2×10⁹`."""
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return f"{float(mantissa):g}×10{str(int(exponent)).translate(_SUPERSCRIPTS)}"


def format_interval(value: float, low: float, high: float) -> tuple[str, str, str]:
    """A number and the ends of its 90 % interval, all with the digits that the interval leaves: the
    second digit of its half-width is the last.

    Zeros at the end that all three have in common are left out.
    """
    numbers = (value, low, high)
    half_width = (high - low) / 2
    small_or_large = [number for number in numbers if number and not 1e-4 <= abs(number) < 1e9]
    if not half_width > 0 or max(map(abs, numbers)) in map(abs, small_or_large):
        return format_number(value), format_number(low), format_number(high)
    texts = [format_measured(number, half_width) for number in numbers]
    while all("." in text and text[-1] in "0." for text in texts):
        texts = [text[:-1] for text in texts]
    return texts[0], texts[1], texts[2]


def format_measured(value: float, uncertainty: float) -> str:
    """A number to the digits that its standard uncertainty leaves, the second of the uncertainty
    the last (GUM 7.2.6).

    Four significant digits where the uncertainty is zero or no number.
    """
    if not (math.isfinite(value) and math.isfinite(uncertainty) and uncertainty > 0):
        return format_number(value)
    last = math.floor(math.log10(uncertainty)) - 1
    rounded = round(value / 10.0**last) * 10.0**last + 0.0  # no negative zero
    return f"{rounded:.{max(0, -last)}f}"


def measured_text(value: float, uncertainty: float) -> str:
    """`5.62 ± 0.11`: a number with its standard uncertainty; the number alone where that is zero or
    no number."""
    text = format_measured(value, uncertainty)
    return f"{text} ± {format_measured(uncertainty, uncertainty)}" if uncertainty > 0 else text


def number_ranges(numbers: Iterable[int], most: int = 8) -> str:
    """`3, 5–8` of whole numbers; of more than `most` ranges the first ones and how many numbers
    follow."""
    ordered = sorted(set(numbers))
    ranges: list[list[int]] = []
    for number in ordered:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    words = [
        str(low) if low == high else f"{low}{', ' if high == low + 1 else '–'}{high}"
        for low, high in ranges[:most]
    ]
    if rest := sum(high - low + 1 for low, high in ranges[most:]):
        words.append(f"and {rest} more")
    return ", ".join(words)


def number(value: float) -> str:
    """Three digits; a dash for what is no number."""
    return format_number(value, 3)


def percent(share: float) -> str:
    """`93 %`; never 100 or 0 for what is only near it, a dash for what is no number."""
    if not math.isfinite(share):
        return NOTHING
    if 0.995 <= share < 1:
        return "> 99 %"
    if 0 < share < 0.005:
        return "< 1 %"
    text = f"{100 * share:.0f}"
    return f"{'0' if text == '-0' else text} %"


def error_percent(error: float) -> str:
    """`4.15 %`, `202 %`: a relative error with three digits, a dash for what is no number."""
    return NOTHING if math.isnan(error) else f"{number(100 * error)} %".replace("-", "−")


def percentage_points(difference: float) -> str:
    """`4.15 % points`, `−12 % points`: a difference of two shares or relative errors, which is no
    share of either; a dash for what is no number."""
    return NOTHING if math.isnan(difference) else f"{error_percent(difference)} points"


def signed_percent(share: float) -> str:
    """`+1.2 %`, `−0.3 %`; no sign where nothing is left of the number, a dash for what is no
    number."""
    if not math.isfinite(share):
        return NOTHING
    text = f"{100 * share:+.1f} %"
    return "0.0 %" if text in ("+0.0 %", "-0.0 %") else text.replace("-", "−")


def percent_range(low: float, high: float) -> str:
    """`52 to 68 %`."""
    if not math.isfinite(low + high):
        return "interval not known"
    return f"{100 * low:.0f} to {100 * high:.0f} %"


def percent_with_range(share: float, interval: tuple[float, float]) -> str:
    """`61 % (52 to 68 %)`."""
    return f"{percent(share)} ({percent_range(*interval)})"


def times(ratio: float) -> str:
    """How many times: `42`, `0.8`; two digits."""
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.2g}"


def join_words(words: Sequence[str], last: str = "and") -> str:
    """`a, b and c`."""
    if len(words) < 2:
        return "".join(words)
    return f"{', '.join(words[:-1])} {last} {words[-1]}"


def finite(value: Any) -> Any:
    """Plain data with null for NaN and infinities, lists for tuples."""
    if isinstance(value, float):  # first: most of what is asked is numbers
        return float(value) if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [finite(element) for element in value]
    if isinstance(value, Mapping):
        return {key: finite(element) for key, element in value.items()}
    return value
