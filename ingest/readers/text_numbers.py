"""The numbers of a text as Python writes them: decimal sign and thousands are settled once, for the
whole file."""

from __future__ import annotations

import re
from functools import cache
from itertools import zip_longest

from ...files.number_notation import (
    GROUP_SIGNS,
    AmbiguousNumberError,
    Notation,
    notation_of,
    readings,
)
from .clock_times import is_clock_text
from .text_table import BLANKS, NO_DELIMITER, split

#: Delimiter of lines that were written anew.
TAB = "\t"


def settled(body: str, delimiter: str, decimal: str | None = None) -> tuple[str, str, str]:
    """Lines of numbers with their delimiter and their decimal sign; those that the sign alone does
    not explain are written anew with points and tabs. `decimal` is the sign that the laboratory
    states.

    Raises `ValueError` for a number that can be read in two ways and that no other number of the
    file settles.
    """
    commas = "," in body if delimiter != "," else '"' in body
    points = "." in body
    if not (commas and (points or delimiter == ",")) and not _has_group_sign(body, delimiter):
        sign = "," if commas else "."
        if not (commas or points) or (
            decimal in (None, sign) and _shows_decimals(body, sign, delimiter)
        ):
            return body, delimiter, sign
    return _written_anew(body, delimiter, decimal)


def _has_group_sign(body: str, delimiter: str) -> bool:
    if any(sign in body for sign in GROUP_SIGNS if sign != " "):
        return True
    return delimiter != BLANKS and " " in body and re.search(r"\d \d{3}", body) is not None


@cache
def _decimal_pattern(sign: str, delimiter: str) -> re.Pattern[str]:
    mark, part = re.escape(sign), re.escape(delimiter)
    plain = rf"0\d*{mark}\d*|\d{{4,}}{mark}\d*|{mark}\d+|\d+{mark}(?:\d{{0,2}}|\d{{4,}})"
    number = rf"(?:{plain})(?:[eE][-+]?\d+)?|\d+{mark}\d+[eE][-+]?\d+"
    return re.compile(
        rf'(?:^|[{part}\s"])[-+]?(?:{number})(?=[{part}\s"]|$)', re.ASCII | re.MULTILINE
    )


def _shows_decimals(body: str, sign: str, delimiter: str) -> bool:
    """Whether some number can only have `sign` as its decimal sign: `0,5`, `12,34`, `1234,567`, not
    `1,234`."""
    return _decimal_pattern(sign, delimiter).search(body) is not None


def _written_anew(body: str, delimiter: str, decimal: str | None) -> tuple[str, str, str]:
    rows = [split(line, delimiter) for line in body.split("\n") if line.strip()]
    width = max(map(len, rows), default=0)
    clocks = {i for i in range(width) if rows and i < len(rows[0]) and is_clock_text(rows[0][i])}
    columns = [
        column for i, column in enumerate(zip_longest(*rows, fillvalue="")) if i not in clocks
    ]
    try:
        notation = notation_of(columns, comma_cells=delimiter == ",", decimal=decimal)
    except AmbiguousNumberError as error:
        raise ValueError(
            f"{error}, and no other number of the file shows which; give decimal under "
            "[recordings] in campaign.toml, or save the file again without signs between thousands"
        ) from error
    if notation is None:
        raise ValueError(
            "has numbers with a decimal point and numbers with a decimal "
            "comma; expected one of them"
        )
    lines = (
        TAB.join(cell if i in clocks else _plain(cell, notation) for i, cell in enumerate(row))
        for row in rows
    )
    anew = TAB if delimiter not in (BLANKS, NO_DELIMITER) else delimiter
    text = "\n".join(line if anew == TAB else line.replace(TAB, anew) for line in lines)
    return text + "\n", anew, "."


def _plain(cell: str, notation: Notation) -> str:
    """A number of the notation; what is none stays as it is, and is refused where the numbers are
    read."""
    return notation.plain(cell) if readings(cell) else cell
