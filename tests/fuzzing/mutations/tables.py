"""Damage to tables of text: cells, rows, columns, delimiters, line ends, encodings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random

from fuzzing.mutations import binary
from fuzzing.mutations.texts import ENCODINGS, NASTY
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
        return "\n".join(delimiter.join(row) for row in rows).encode("utf-8", "surrogateescape")[: binary.LONGEST]

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
    return data.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\n\n", b"\x0b", "\u2028".encode())), rng.choice((-1, 1)))


def other_encoding(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    return data.decode("utf-8", "replace").encode(rng.choice(ENCODINGS), "replace")


def mixed_encoding(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    """One word in another encoding, in the midst of the text."""
    at = rng.randrange(len(data) + 1)
    return data[:at] + "Prüfstand µm".encode(rng.choice(ENCODINGS)) + data[at:]


_WEIGHTS = {
    _on_cells(nasty_cell): 12,
    _on_cells(nasty_column): 4,
    _on_cells(title): 4,
    _on_cells(drop_row): 2,
    _on_cells(repeat_row): 2,
    _on_cells(swap_rows): 2,
    _on_cells(drop_column): 2,
    _on_cells(repeat_column): 1,
    _on_cells(longer_row): 1,
    other_delimiter: 2,
    other_line_end: 1,
    other_encoding: 1,
    mixed_encoding: 1,
    binary.damaged: 3,
}
damaged = stacked(_WEIGHTS, most=3)
