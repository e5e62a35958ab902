"""The scores of a validation as rows and lines for people, of the data of `validate --json`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ..number_format import number, percent, percent_range

#: Of one row of `quantities`: 90 % bands that hold what they promise are near this share.
COLUMNS = ("quantity", "shots", "inside 50 % band", "inside 90 % band", "95 % interval", "median error",
           "mean deviation", "width of 90 % band", "CRPS")  # fmt: skip


def score_rows(data: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """A row for each quantity; errors of logarithms as per cent of the measured value."""
    for row in data["quantities"]:
        unit = row["unit"]
        cells = (
            quantity_words(row["name"]),
            row["shots"],
            percent(row["coverage50"]),
            percent(row["coverage90"]),
            percent_range(*row["coverage90_ci95"]),
            _size(row["median_abs_error"], unit),
            _size(row["bias"], unit, signed=True),
            _width(row["sharpness90"], unit),
            f"{number(row['crps'])} {unit}",
        )
        yield dict(zip(COLUMNS, cells, strict=True))


def quantity_words(name: str) -> str:
    """ "peak_force" as "peak force", "srs_acceleration_1" as "spectrum, acceleration_1"."""
    for start, words in (("srs_", "spectrum, "), ("peak_acceleration_", "peak acceleration, ")):
        if name.startswith(start):
            return words + name.removeprefix(start)
    return name.replace("_", " ")


def failure_lines(data: Mapping[str, Any]) -> list[str]:
    return [failure["sentence"] for failure in data["failures"]]


def reason_lines(reasons: Sequence[str]) -> list[str]:
    """Why shots are not compared, each reason once with its number: "no recording (5)"."""
    counts = Counter(reason.partition(": ")[2] or reason for reason in reasons)
    return [f"{reason} ({count})" if count > 1 else reason for reason, count in counts.most_common()]


def _size(value: float, unit: str, *, signed: bool = False) -> str:
    sign = "+" if signed else ""
    return f"{value:{sign}.2f} dB" if unit == "dB" else f"{100 * math.expm1(value):{sign}.1f} %"


def _width(value: float, unit: str) -> str:
    """Upper over lower end of the band, or their distance in dB."""
    return f"{value:.1f} dB" if unit == "dB" else f"factor {math.exp(value):.3g}"
