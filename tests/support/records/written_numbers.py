"""Numbers as the programs and spreadsheets of several countries write them, made from the numbers
themselves."""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import strategies as st

#: Decimal sign and sign between thousands.
NOTATIONS = [
    (".", ""),
    (",", ""),
    (".", ","),
    (",", "."),
    (",", " "),
    (",", "\u00a0"),
    (",", "\u202f"),
    (".", "'"),
]


@dataclass(frozen=True)
class WrittenColumn:
    """Numbers, and how they are written: with so many decimals, None as short as they can be."""

    values: list[float]
    decimals: int | None


def written(value: float, decimals: int | None, notation: tuple[str, str]) -> str:
    """`value` with the signs of a notation; where thousands are apart, all of them are."""
    point, comma = notation
    text = (
        f"{value:,.{decimals}f}"
        if decimals is not None
        else f"{value:,.6f}".rstrip("0").rstrip(".")
    )
    return text.replace(",", "\x00").replace(".", point).replace("\x00", comma)


@st.composite
def columns(draw: st.DrawFn, rows: int) -> WrittenColumn:
    """Whole numbers or decimals, small or beyond a thousand."""
    decimals = draw(st.sampled_from([None, 0, 1, 2, 3, 4]))
    digits = 3 if decimals is None else decimals
    limit = draw(st.sampled_from([2, 900, 5_000, 3_000_000]))
    whole = draw(
        st.lists(st.integers(-limit * 10**digits, limit * 10**digits), min_size=rows, max_size=rows)
    )
    return WrittenColumn([number / 10**digits for number in whole], decimals)


@st.composite
def tables(draw: st.DrawFn) -> tuple[list[WrittenColumn], tuple[str, str], str]:
    """Columns of one length, a notation, and a delimiter that such a notation is found with."""
    notation = draw(st.sampled_from(NOTATIONS))
    delimiter = draw(st.sampled_from([";", "\t", ","] if notation[0] == "." else [";", "\t"]))
    rows = draw(st.integers(3, 12))
    return draw(st.lists(columns(rows), min_size=1, max_size=3)), notation, delimiter


def text_of(
    table: list[WrittenColumn], notation: tuple[str, str], delimiter: str, names: list[str]
) -> str:
    """The table with a line of names; a cell that holds the delimiter is quoted."""
    cells = [
        [written(value, column.decimals, notation) for value in column.values] for column in table
    ]
    quoted = [[f'"{cell}"' if delimiter in cell else cell for cell in column] for column in cells]
    return "\n".join(delimiter.join(row) for row in [names, *zip(*quoted, strict=True)]) + "\n"
