"""Numbers as people and instruments write them: point or decimal comma, and thousands set apart by
a comma, a point, a blank or an apostrophe.

`1,250` can be 1.25 or 1250. Which one it is, the other numbers of the same table prove
(`notation_of`), or nobody knows and it is refused. Thousands count as set apart only where one to
three digits, no leading zero, are followed by groups of exactly three.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

#: Signs that mean the same between thousands: blanks of Unicode (no-break, thin, narrow no-break),
#: and apostrophes.
_SAME_SIGN = str.maketrans({"\u00a0": " ", "\u2009": " ", "\u202f": " ", "\u2019": "'"})
#: What can stand between thousands and nowhere else in a number.
GROUP_SIGNS = " '\u00a0\u2009\u202f\u2019"
_DECIMALS = (".", ",")
_NUMBER = re.compile(r"([-+]?)([\d.,' ]*\d[\d.,' ]*)([eE][-+]?\d+)?", re.ASCII)
_GROUPED = {
    sign: re.compile(rf"[1-9]\d{{0,2}}(?:{re.escape(sign)}\d{{3}})+", re.ASCII) for sign in ".,' "
}
_DIGITS = re.compile(r"\d+", re.ASCII)


@dataclass(frozen=True)
class NumberReading:
    """One meaning of a number's text: its signs, None where it has none, and the number as Python
    writes it."""

    decimal: str | None
    thousands: str | None
    plain: str


@dataclass(frozen=True)
class Notation:
    """How a table writes its numbers; `thousands` is None where they are not set apart."""

    decimal: str = "."
    thousands: str | None = None

    def plain(self, text: str) -> str:
        """A number of this notation as Python writes it.

        Parameters:
            text: The number as the table has it.

        Raises:
            ValueError: Where the text is no number of this notation.
        """
        for reading in readings(text):
            if reading.decimal in (None, self.decimal) and reading.thousands in (
                None,
                self.thousands,
            ):
                return reading.plain
        raise ValueError(f"{text!r} is no number with the decimal sign {self.decimal!r}")


class AmbiguousNumberError(ValueError):
    """A number that has two readings, `text`; `choices` names both as they can be written without
    doubt."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.choices = " or ".join(_undoubted(reading.plain) for reading in readings(text))
        sign = "comma" if "," in text else "point"
        super().__init__(
            f"{text!r} can be {self.choices}: its {sign} is a decimal sign or sets thousands apart"
        )


def _undoubted(plain: str) -> str:
    """A plain number with other than three decimals: `1.200` is `1.2`, `1.234` is `1.2340`."""
    whole, point, fraction = plain.partition(".")
    fraction = fraction.rstrip("0")
    return whole + (
        point + (fraction + "0" if len(fraction) == 3 else fraction or "0") if point else ""
    )


def readings(text: str) -> list[NumberReading]:
    """Every meaning of a text as a number: two of `1,250` and `1.250`, none of what is no number.

    Parameters:
        text: A cell; blanks around it do not count.
    """
    match = _NUMBER.fullmatch(text.translate(_SAME_SIGN).strip())
    if match is None:
        return []
    sign, mantissa, exponent = match.group(1), match.group(2), match.group(3) or ""
    if _DIGITS.fullmatch(mantissa):
        return [NumberReading(None, None, text.strip())]
    meanings = []
    for decimal in _DECIMALS:
        whole, mark, fraction = mantissa.partition(decimal)
        if (
            mark
            and (fraction == "" or _DIGITS.fullmatch(fraction))
            and (whole == "" or _DIGITS.fullmatch(whole))
        ):
            meanings.append(NumberReading(decimal, None, f"{sign}{whole}.{fraction}{exponent}"))
        for thousands, grouped in _GROUPED.items():
            if (
                exponent
                or thousands == decimal
                or not grouped.fullmatch(whole)
                or (mark and not fraction.isdigit())
            ):
                continue
            digits = sign + whole.replace(thousands, "") + (f".{fraction}" if mark else "")
            meanings.append(NumberReading(decimal if mark else None, thousands, digits))
    return list(dict.fromkeys(meanings))


def plain_number(text: str) -> str:
    """A number that stands alone, as Python writes it.

    Parameters:
        text: The number; a point alone is a decimal point.

    Raises:
        ValueError: For a text that is no number.
        AmbiguousNumberError: For a comma that has two readings.
    """
    meanings = readings(text)
    if not meanings:
        raise ValueError(f"{text!r} is no decimal number")
    if len(meanings) == 1 or meanings[0].decimal == ".":
        return meanings[0].plain
    raise AmbiguousNumberError(text)


def notation_of(
    columns: Iterable[Sequence[str]],
    *,
    comma_cells: bool,
    by_hand: bool = False,
    decimal: str | None = None,
) -> Notation | None:
    """The notation in which a table's numbers are written; None where single numbers contradict
    each other without doubt about any of them (`0.5` beside `1,5`).

    What proves a sign: `0,5` and `12,34` a decimal sign, `1,234,567` and `1,234.5` a sign between
    thousands. Where no cell proves any, two things count. A comma sets thousands apart in a column
    that also has numbers below 1000 without it and a group that ends in zero: three decimals in
    every number would leave no bare ones, and dropped zeros no `1,250`. Between commas a point is a
    decimal point.

    Parameters:
        columns: The cells of each column of the table. Cells that are no numbers do not count.
        comma_cells: Whether commas stand between the cells of a row.
        by_hand: Whether people wrote the table, whose notation is less regular: then only a decimal
            point between commas, or a decimal comma between other signs, proves what the other sign
            is. By default an instrument wrote it.
        decimal: The decimal sign that the laboratory states; None, the default, where it states
            none.

    Raises:
        AmbiguousNumberError: Where two readings of a number remain.
    """
    decimals: set[str] = set() if decimal is None else {decimal}
    thousands: set[str] = set()
    doubtful: dict[str, list[tuple[str, Sequence[str]]]] = {}
    for column in columns:
        for text in dict.fromkeys(column):
            meanings = readings(text)
            if len(meanings) == 1:
                decimals |= {sign for sign in (meanings[0].decimal,) if sign}
                thousands |= {sign for sign in (meanings[0].thousands,) if sign}
            elif meanings:
                doubtful.setdefault("," if "," in text else ".", []).append((text, column))
    for sign, cells in doubtful.items():
        other = "." if sign == "," else ","
        usual = not by_hand or (other == ".") == comma_cells
        if sign in decimals or sign in thousands or (other in decimals and usual) or thousands:
            continue
        grouped = any(_sets_thousands_apart(sign, column) for _, column in cells)
        if sign == "," and grouped and (comma_cells or not by_hand) and other not in doubtful:
            thousands.add(sign)
        elif sign == "." and comma_cells and not grouped and other not in doubtful:
            decimals.add(sign)
        else:
            raise AmbiguousNumberError(cells[0][0])
    for sign in doubtful:
        other = "." if sign == "," else ","
        if not (sign in decimals or sign in thousands):
            (thousands if other in decimals else decimals).add(sign)
    if len(decimals) > 1 or len(thousands) > 1 or decimals & thousands:
        if doubtful:
            raise AmbiguousNumberError(next(iter(doubtful.values()))[0][0])
        return None
    separator = next(iter(thousands), None)
    return Notation(next(iter(decimals), "," if separator == "." else "."), separator)


def _sets_thousands_apart(sign: str, column: Sequence[str]) -> bool:
    texts = {text.strip() for text in column}
    bare = [text for text in texts if _DIGITS.fullmatch(text.lstrip("+-"))]
    grouped = [text for text in texts if sign in text]
    return (
        bool(bare)
        and all(len(text.lstrip("+-")) < 4 for text in bare)
        and any(t.endswith("0") for t in grouped)
    )
