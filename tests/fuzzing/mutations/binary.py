"""Damage to bytes of any meaning: flips, cuts, splices, and numbers that are extreme where a length
may stand."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from random import Random

from fuzzing.target import stacked

_INTEGERS = (
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x7FFF,
    0xFFFF,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**40,
    2**63 - 1,
    2**64 - 1,
)
_FLOATS = (float("nan"), float("inf"), -float("inf"), 0.0, -1.0, 5e-324, 1e308, 1e-300)
_SIZES = {1: "B", 2: "H", 4: "I", 8: "Q"}
#: Inputs do not grow beyond this: what a file of a few kilobytes can do is the question.
LONGEST = 1 << 17


def flip_bits(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    damaged = bytearray(data)
    for _n in range(rng.choice((1, 1, 1, 2, 4, 16)) if damaged else 0):
        damaged[rng.randrange(len(damaged))] ^= 1 << rng.randrange(8)
    return bytes(damaged)


def set_integer(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    """An extreme number of 1, 2, 4 or 8 bytes anywhere."""
    size = rng.choice(tuple(_SIZES))
    return _put(
        data, rng, struct.pack(_order(rng) + _SIZES[size], rng.choice(_INTEGERS) % 256**size)
    )


def set_float(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    kind = rng.choice("fd")
    value = rng.choice(_FLOATS if kind == "d" else _FLOATS[:5])
    return _put(data, rng, struct.pack(_order(rng) + kind, value))


def false_length(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    """Where a number stands that could be a length of something in the file, a neighbour of it or
    an extreme."""
    size = rng.choice((2, 4, 8))
    form = _order(rng) + _SIZES[size]
    places = [
        at
        for at in (rng.randrange(max(1, len(data) - size + 1)) for _n in range(64))
        if len(data) >= at + size and 0 < struct.unpack_from(form, data, at)[0] <= 16 * len(data)
    ]
    if not places:
        return flip_bits(data, rng, ())
    at = rng.choice(places)
    true = struct.unpack_from(form, data, at)[0]
    false = rng.choice((true + 1, true - 1, true * 2, 0, true * 2**16, *_INTEGERS)) % 256**size
    return data[:at] + struct.pack(form, false) + data[at + size :]


def cut(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def drop(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    start, stop = _range(data, rng)
    return data[:start] + data[stop:]


def repeat(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    start, stop = _range(data, rng)
    times = min(rng.choice((2, 2, 3, 16, 1000)), LONGEST // max(1, stop - start))
    return (data[:start] + data[start:stop] * times + data[stop:])[:LONGEST]


def overwrite(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    """A stretch of one byte, or of noise."""
    start, stop = _range(data, rng)
    fill = rng.choice((b"\0", b"\xff", b" ", None))
    return (
        data[:start]
        + (rng.randbytes(stop - start) if fill is None else fill * (stop - start))
        + data[stop:]
    )


def move(data: bytes, rng: Random, _: Sequence[bytes]) -> bytes:
    """A stretch copied over another place of the file, of the same length."""
    start, stop = _range(data, rng)
    return _put(data, rng, data[start:stop])


def splice(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
    """The start of this and the end of another, or a piece of another in the midst of this."""
    other = rng.choice(others) if others else data
    if rng.random() < 0.5:
        return (data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :])[
            :LONGEST
        ]
    start, stop = _range(other, rng)
    return _put(data, rng, other[start:stop])


def _put(data: bytes, rng: Random, piece: bytes) -> bytes:
    """`piece` over the bytes at a place where it fits, aligned as often as not."""
    if len(data) < len(piece):
        return data
    at = rng.randrange(len(data) - len(piece) + 1)
    at = at - at % 4 if rng.random() < 0.5 else at
    return data[:at] + piece + data[at + len(piece) :]


def _range(data: bytes, rng: Random) -> tuple[int, int]:
    start = rng.randrange(len(data) + 1)
    return start, min(len(data), start + rng.choice((1, 4, 8, 64, 512, len(data))))


def _order(rng: Random) -> str:
    return rng.choice("<<>")


#: What keeps the length stands first: it leads deeper into a format than a cut.
_WEIGHTS: dict[Callable[[bytes, Random, Sequence[bytes]], bytes], int] = {
    flip_bits: 6, set_integer: 6, false_length: 6, set_float: 2, move: 2, overwrite: 2, splice: 2,
    cut: 1, drop: 1,
    repeat: 1,
}  # fmt: skip
damaged = stacked(_WEIGHTS)
