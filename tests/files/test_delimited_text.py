"""Tables in text files: which sign parts the cells, which rows count, and what is refused."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from pyroshock.files.delimited_text import (
    HeadedTable,
    decode_utf8,
    delimiter_of,
    parse_number,
    table_rows,
)
from support.records.written_numbers import WrittenColumn, tables, text_of


@pytest.mark.parametrize("delimiter", [";", "\t", ","])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_rows_keep_their_numbers_in_the_file(delimiter: str, line_end: str) -> None:
    text = line_end.join(["", f"a {delimiter}b", delimiter, f'1{delimiter}" 2"'])
    assert table_rows(text + line_end) == [(2, ["a", "b"]), (4, ["1", "2"])]


@pytest.mark.parametrize(
    ("header", "delimiter"),
    [("f;g, peak", ";"), ("a,b,c;d", ","), ("a\tb;c\td", "\t"), ("a b|c", ",")],
)
def test_delimiter_is_the_sign_that_the_header_has_most_often(header: str, delimiter: str) -> None:
    assert delimiter_of(f"\n{header}\n1;1;1;1,1,1,1\n") == delimiter


def test_headed_table_names_what_does_not_fit() -> None:
    table = HeadedTable.of([(1, ["a", "", "b", "b"]), (2, ["1", "2", "3", "4"]), (5, ["1"])])
    assert table.header_problems == ["column 2 has no name", "column 'b' stands twice"]
    assert table.row_problems == ["row 5: 1 cells; expected 4 as in the header"]
    assert [line for line, _ in table.lines] == [2]
    with pytest.raises(ValueError, match=r"^column 2 has no name$"):
        table.check()
    with pytest.raises(ValueError, match=r"^empty; expected a header"):
        HeadedTable.of(table_rows(" \n;;\n"))


def test_what_is_no_text_or_no_table_is_refused() -> None:
    assert decode_utf8("\ufeffGröße".encode()) == "Größe"
    with pytest.raises(ValueError, match=r"^byte 2 is not UTF-8; save the file as UTF-8$"):
        decode_utf8("Größe".encode("latin-1"))
    with pytest.raises(ValueError, match=r"^holds a NUL character at 1; not a text file$"):
        table_rows("a\0b")
    assert table_rows('a,b\n1,"2\n') == [(1, ["a", "b"]), (2, ["1", "2"])]
    with pytest.raises(ValueError, match=r"^row 2: unexpected end of data$"):
        table_rows('a,b\n1,"2\n', strict=True)


def test_number_has_a_point_or_a_comma_and_may_have_its_thousands_apart() -> None:
    assert [parse_number(text) for text in ("1.5", "1,5", "-2e3", " 7 ", "1.250")] == [
        1.5,
        1.5,
        -2000.0,
        7.0,
        1.25,
    ]
    spellings = (
        "1,234.5",
        "1.234,5",
        "1 234,5",
        "1\u00a0234.5",
        "1\u202f234,5",
        "1\u2009234,5",
        "1'234.5",
        "1\u2019234.5",
    )
    assert {parse_number(text) for text in spellings} == {1234.5}
    assert parse_number("-1,234,567") == -1234567.0
    for text in (
        "1_0",
        "٣",
        "inf",
        "nan",
        "",
        "12,34.5",
        "1,23,456",
        "1 23",
        "1,234.567,8",
        "0,123.5",
    ):
        with pytest.raises(
            ValueError, match=r"could not convert|is no decimal number|is not finite"
        ):
            parse_number(text)
    with pytest.raises(
        ValueError, match=r"^'1,250' can be 1250 or 1\.25: its comma is a decimal sign or sets"
    ):
        parse_number("1,250")


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ('mm,g\n"1,200",0.6\n885,1\n', ["1200", "885"]),
        ('mm,n\n"1,200",7\n885,1\n', ["1200", "885"]),
        ("mm;g\n1.200;0,6\n885;1\n", ["1200", "885"]),
        ("mm;g\n1,200;0,6\n885;1\n", ["1.200", "885"]),
        ('mm,n\n1.250,7\n"1,5",8\n', None),
        ('mm,n\n"1,200",7\n"1,100",1\n', None),
        ("mm;n\n1,200;7\n885;1\n", None),
        ("mm;n\n1.234;7\n998;1\n", None),
        ("mm;n\n1,234;1.234\n", None),
        ("mm\tn\n1,234,567\t1\n1,234\t5\n", ["1,234,567", "1234"]),
    ],
)
def test_the_other_numbers_of_a_table_prove_what_a_comma_means(
    text: str, cells: list[str] | None
) -> None:
    if cells is None:
        with pytest.raises(ValueError, match=r"^row 2: '1[.,]2\d\d' can be .* or .*; write "):
            table_rows(text)
    else:
        assert [row[0] for _, row in table_rows(text)[1:]] == cells


@settings(max_examples=300)
@given(tables())
def test_a_table_of_numbers_is_read_exactly_or_refused(
    drawn: tuple[list[WrittenColumn], tuple[str, str], str],
) -> None:
    table, notation, delimiter = drawn
    text = text_of(table, notation, delimiter, ["a", "b", "c"][: len(table)])
    try:
        rows = HeadedTable.of(table_rows(text))
        rows.check()
        numbers = [[parse_number(cells[name]) for _, cells in rows.lines] for name in rows.header]
    except ValueError:
        return
    assert numbers == [column.values for column in table]
