"""Damage to tables of text: cells, rows, columns, delimiters, line ends, encodings, and texts that
none should hold."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random

from fuzzing.mutations import binary
from fuzzing.target import stacked

_DELIMITERS = ",;\t| "
Rows = list[list[str]]
_Step = Callable[[Rows, Random], Rows]


def _on_cells(step: _Step) -> Callable[[bytes, Random, Sequence[bytes]], bytes]:
    """A step on the cells of a text as one on its bytes."""

    def mutate(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
        text = data.decode("utf-8", "surrogateescape")
        delimiter = max(_DELIMITERS, key=text.count)
        rows = step([line.split(delimiter) for line in text.split("\n")], rng)
        return "\n".join(delimiter.join(row) for row in rows).encode("utf-8", "surrogateescape")[
            : binary.LONGEST
        ]

    return mutate


def nasty_cell(rows: Rows, rng: Random) -> Rows:
    row = rng.choice(rows)
    row[rng.randrange(len(row))] = rng.choice(NASTY)
    return rows


def nasty_column(rows: Rows, rng: Random) -> Rows:
    column, text = rng.randrange(max(map(len, rows))), rng.choice(NASTY)
    for row in rows[rng.randrange(2) :]:
        if column < len(row):
            row[column] = text
    return rows


def title(rows: Rows, rng: Random) -> Rows:
    """A word of the header, or a whole line, of another place."""
    row = rng.choice(rows[:12])
    row[rng.randrange(len(row))] = rng.choice(rng.choice(rows[:12]))
    return rows


def drop_row(rows: Rows, rng: Random) -> Rows:
    start = rng.randrange(len(rows))
    return rows[:start] + rows[start + rng.choice((1, 1, 1, 5, 1000)) :] or [[""]]


def repeat_row(rows: Rows, rng: Random) -> Rows:
    at = rng.randrange(len(rows))
    return rows[:at] + [list(rows[at]) for _n in range(rng.choice((2, 2, 3, 500)))] + rows[at + 1 :]


def swap_rows(rows: Rows, rng: Random) -> Rows:
    one, other = rng.randrange(len(rows)), rng.randrange(len(rows))
    rows[one], rows[other] = rows[other], rows[one]
    return rows


def drop_column(rows: Rows, rng: Random) -> Rows:
    column = rng.randrange(max(map(len, rows)))
    return [row[:column] + row[column + 1 :] or [""] for row in rows]


def repeat_column(rows: Rows, rng: Random) -> Rows:
    column = rng.randrange(max(map(len, rows)))
    times = rng.choice((2, 2, 2, 40))
    return [row[:column] + row[column : column + 1] * times + row[column + 1 :] for row in rows]


def longer_row(rows: Rows, rng: Random) -> Rows:
    rng.choice(rows).append(rng.choice(NASTY))
    return rows


def other_delimiter(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    old, new = (sign.encode() for sign in rng.sample(_DELIMITERS + " .", 2))
    return data.replace(old, new, rng.choice((-1, -1, 1, 5)))


def other_line_end(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    return data.replace(
        b"\n",
        rng.choice((b"\r\n", b"\r", b"\n\n", b"\x0b", "\u2028".encode())),
        rng.choice((-1, 1)),
    )


def other_encoding(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    return data.decode("utf-8", "replace").encode(rng.choice(ENCODINGS), "replace")


def mixed_encoding(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    """One word in another encoding, in the midst of the text."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + "Prüfstand µm".encode(rng.choice(ENCODINGS)) + data[at:]


_WEIGHTS = {
    _on_cells(nasty_cell): 12, _on_cells(nasty_column): 4, _on_cells(title): 4,
    _on_cells(drop_row): 2,
    _on_cells(repeat_row): 2, _on_cells(swap_rows): 2, _on_cells(drop_column): 2,
    _on_cells(repeat_column): 1,
    _on_cells(longer_row): 1, other_delimiter: 2, other_line_end: 1, other_encoding: 1,
    mixed_encoding: 1,
    binary.damaged: 3,
}  # fmt: skip
damaged = stacked(_WEIGHTS, most=3)


NASTY = (
    *(
        "",
        " ",
        "nan",
        "NaN",
        "inf",
        "-inf",
        "infinity",
        "1e400",
        "-1e400",
        "1e-400",
        "5e-324",
        "1e308",
        "-1e308",
    ),
    *("-1", "0", "-0", "0.0", "1", "2", "1.5", "1,5", "1.5.2", "1_0", "0x1p3", "0x10"),
    *("1 000", "+1", ".5", "5.", "1e5"),
    *(
        "١٢٣",
        "１２",
        "²",
        "½",
        "−1",
        "\u2028",
        "\ufeff1",
        "\x85",
        "\u202e",
        "e\u0301",
        "\U0001f528",
        "\ufffd",
    ),
    *("9" * 400, "9" * 5000, "x" * 499, "x" * 501, "x" * 5000, "x" * 140_000),
    *(
        '"',
        '""',
        '"a',
        'a"b',
        "'",
        "\\",
        "\\u0000",
        "\x00",
        "\x01",
        "\x1f",
        "\x7f",
        "\r",
        "\t",
        "\n",
        ";",
        ",",
        "|",
    ),
    *(
        "true",
        "None",
        "null",
        "=1+1",
        "%s%n",
        "{0}",
        "$HOME",
        "<b>",
        "--",
        "#",
        "#1",
        "//",
        "[N]",
        "(s)",
        "force [N]",
    ),
    *("2147483647", "2147483648", "9223372036854775808", "-9223372036854775809"),
    *(
        "..",
        "../x.npz",
        "/dev/zero",
        "/dev/stdin",
        "C:\\x",
        "a" * 256 + ".npz",
        "recordings",
        ".",
        "x\x00.npz",
    ),
    *(
        "N",
        "kN",
        "g",
        "m/s2",
        "m/s**2",
        "N*",
        "N**",
        "N**9",
        "N**999999999",
        "9**9**9**9",
        "m**-1e9",
        "degC",
        "V/N",
    ),
    *(
        "10**100000000",
        "N" * 2000,
        "(" * 500,
        "1e99999 N",
        "N/0",
        "0 N",
        "nan N",
        "-N",
        "kg*m/s^2",
        "dB",
        "%",
        "1",
    ),
    *(
        "steel",
        "none",
        "aluminum",
        "PLA",
        "free",
        "low",
        "polymeric",
        "hammer",
        "gun",
        "force",
        "fs",
        "time",
        "t",
    ),
)
#: Whole files' encodings, as spreadsheets and editors save them.
ENCODINGS = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "latin-1", "cp1252", "utf-7")
