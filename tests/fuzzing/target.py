"""What is fuzzed: a way into the product, files that it takes, and how these are damaged."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random

#: A damaged copy of an input; the others of its target lend pieces.
Mutate = Callable[[bytes, Random, Sequence[bytes]], bytes]
#: Gives an input to the product, in an empty folder: "accepted" or "set aside", else it raises.
Use = Callable[[bytes, Path], str]

ACCEPTED, REFUSED, SET_ASIDE = "accepted", "refused", "set aside"


@dataclass(frozen=True)
class Target:
    """`refusals` are the errors by which the product may refuse; their message must hold `names`, one line of text.

    `watched` are the source files whose lines the long run counts.
    """

    name: str
    use: Use
    seeds: Callable[[], Sequence[bytes]]
    mutate: Mutate
    refusals: tuple[type[Exception], ...]
    names: str
    watched: tuple[str, ...]
    #: Its share of a long run: whole campaigns take a hundred times as long as a table.
    weight: float = 1.0
    #: A library of it may be crashed by a damaged file: the ingest reads such files in a process of their own.
    may_crash: bool = False


def stacked(mutations: Mapping[Mutate, int], most: int = 4) -> Mutate:
    """One of the mutations, sometimes two or `most`, drawn by their weights, one after the other."""
    choices, weights = list(mutations), list(mutations.values())

    def mutate(data: bytes, rng: Random, others: Sequence[bytes]) -> bytes:
        for _ in range(rng.choice((1, 1, 1, 2, most))):
            (one,) = rng.choices(choices, weights)
            data = one(data, rng, others)
        return data

    return mutate
