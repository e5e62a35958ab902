"""Damage to TOML: keys dropped, doubled, renamed, of another type, in another table."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from random import Random

from fuzzing.mutations import binary, tables
from fuzzing.mutations.tables import NASTY
from fuzzing.target import stacked

_VALUES = (
    *(
        "true",
        "1",
        "-1",
        "0",
        "1.5",
        "nan",
        "-inf",
        "1e400",
        "1e308",
        "5e-324",
        "9" * 400,
        "9" * 5000,
        "0x7fffffff",
    ),
    *(
        "[]",
        "[1]",
        "[[]]",
        "[[0, 0], [1, 0], [1, 1]]",
        "[[0, 0], [1, 0], [1, nan]]",
        "{}",
        "{ a = 1 }",
        "[1, 'a', {}]",
    ),
    *(
        "1979-05-27",
        "1979-05-27T07:32:00Z",
        "07:32:00",
        "9999-12-31",
        "'2026-02-30'",
        "'force'",
        "''",
        '"\\u0000"',
    ),
    *("[" * 200 + "]" * 200, "[" * 5_000, "{a=" * 500 + "1" + "}" * 500, '"""x"""', "'''"),
    *('"\\ud800"', '"\\U00110000"'),
    *(
        "[[0, 0], [1, 0]]",
        "[" + "[0, 0], " * 500 + "]",
        "['low', 'low']",
        "[1, 1]",
        "[2, 1]",
        "['a', 'b']",
    ),
)
_Step = Callable[[list[str], Random], list[str]]


def _on_lines(step: _Step) -> Callable[[bytes, Random, Sequence[bytes]], bytes]:
    def mutate(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
        lines = step(data.decode("utf-8", "surrogateescape").split("\n"), rng)
        return "\n".join(lines).encode("utf-8", "surrogateescape")[: binary.LONGEST]

    return mutate


def other_value(lines: list[str], rng: Random) -> list[str]:
    keys = [n for n, line in enumerate(lines) if "=" in line]
    if keys:
        at = rng.choice(keys)
        text = json.dumps(rng.choice(NASTY), ensure_ascii=False)
        lines[at] = (
            lines[at].split("=")[0] + "= " + (rng.choice(_VALUES) if rng.random() < 0.6 else text)
        )
    return lines


def other_key(lines: list[str], rng: Random) -> list[str]:
    """The key or the table of another line, or one that nobody knows, with this line's value."""
    at = rng.randrange(len(lines))
    other = rng.choice(lines).split("=")[0].strip()
    name = rng.choice(
        (
            other,
            other,
            "x",
            "a.b.c",
            '""',
            '"x\\u0000"',
            "a" * 600,
            ".".join("a" * 300),
            json.dumps("é\n"),
        )
    )
    head, sign, value = lines[at].partition("=")
    lines[at] = (
        f"{name} {sign}{value}"
        if sign
        else f"[{name.strip('[]')}]"
        if head.startswith("[")
        else head
    )
    return lines


def drop_line(lines: list[str], rng: Random) -> list[str]:
    del lines[rng.randrange(len(lines))]
    return lines or [""]


def repeat_line(lines: list[str], rng: Random) -> list[str]:
    at = rng.randrange(len(lines))
    return lines[:at] + [lines[at]] * rng.choice((2, 2, 50)) + lines[at + 1 :]


def swap_lines(lines: list[str], rng: Random) -> list[str]:
    one, other = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return lines


def number(lines: list[str], rng: Random) -> list[str]:
    """A digit, a sign or an exponent more or less."""
    at = rng.randrange(len(lines))
    places = [n for n, sign in enumerate(lines[at]) if sign.isdigit()]
    if places:
        n = rng.choice(places)
        new = rng.choice(("", "0", "-1", "e9", "e-300", "e308", ".", "_", "99", "9" * 300))
        lines[at] = lines[at][:n] + new + lines[at][n + rng.randrange(2) :]
    return lines


_WEIGHTS = {
    _on_lines(other_value): 10, _on_lines(other_key): 4, _on_lines(number): 4,
    _on_lines(drop_line): 2,
    _on_lines(repeat_line): 2, _on_lines(swap_lines): 2, tables.other_encoding: 1,
    tables.mixed_encoding: 1,
    binary.damaged: 2,
}  # fmt: skip
damaged = stacked(_WEIGHTS, most=3)
