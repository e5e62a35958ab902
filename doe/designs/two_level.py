"""Screening designs of two levels a factor: fractional factorials, and those of Plackett and
Burman.

Both are orthogonal; what they save is paid in aliases (`doe/merit/quality.py`): a main effect
stands for a sum of itself and interactions.
"""

from __future__ import annotations

from collections.abc import Iterator

from ..space import Space
from . import pydoe
from .base import Design, TwoLevelWords, from_two_levels, varied_axes

_LETTERS = "abcdefghijklmnopqrst"
#: 65,536 runs.
_MOST_LETTERS = 16
#: For more factors it takes long to find out that the same runs have no higher resolution.
_MOST_IMPROVED = 10


def fractional_factorial(
    space: Space,
    *,
    generators: str | None = None,
    resolution: int = 4,
    categorical: TwoLevelWords = "refuse",
) -> Design:
    """A two-level design of `generators` such as "a b c ab", a word for each varied axis, or the
    smallest of a resolution.

    Resolution III: main effects are aliased with interactions of two factors; IV: not with them,
    but these with each other; V: neither. Raises `ValueError` for generators that do not fit the
    axes, and as `coded.from_two_levels`.
    """
    names = [space.axes[index].name for index in varied_axes(space)]
    words = generators if generators is not None else smallest_generators(len(names), resolution)
    given = words.split()
    if len(given) != len(names):
        raise ValueError(
            f"generators {words!r} give {len(given)} columns; expected "
            f"{len(names)}: {', '.join(names)}"
        )
    if (letters := sum(len(word.strip("+-")) == 1 for word in given)) > _MOST_LETTERS:
        raise ValueError(
            f"generators have {letters} letters, or 2^{letters} runs; "
            f"expected {_MOST_LETTERS} at most"
        )
    coded = pydoe.two_level(words)
    return Design(space, from_two_levels(space, coded, categorical), "fractional-factorial", None)


def plackett_burman(space: Space, *, categorical: TwoLevelWords = "refuse") -> Design:
    """The smallest multiple of four runs above the number of axes; main effects are aliased with
    interactions in part.

    Raises `ValueError` as `pydoe.plackett_burman` and `coded.from_two_levels` do.
    """
    coded = pydoe.plackett_burman(len(varied_axes(space)))
    return Design(space, from_two_levels(space, coded, categorical), "plackett-burman", None)


def smallest_generators(factors: int, resolution: int) -> str:
    """Generators of the fewest runs whose resolution is at least as asked, and of up to ten factors
    the highest with these runs; a full factorial where no fraction has it.

    pyDOE3's own search leaves out products of all base letters: no 2^(5-1) of resolution V, and 16
    runs for 2^(7-4) of resolution III. Raises `ValueError` for a resolution below 3, and for no or
    more than 20 factors.
    """
    if resolution < 3:
        raise ValueError(f"resolution is {resolution}; expected 3 or more")
    if not 1 <= factors <= len(_LETTERS):
        raise ValueError(
            f"{factors} factors; expected 1 to {len(_LETTERS)} for a fractional factorial"
        )
    for base in range(1, factors + 1):
        added = next(_words(base, factors - base, resolution), None)
        while added and factors <= _MOST_IMPROVED:
            resolution += 1
            better = next(_words(base, factors - base, resolution), None)
            if better is None:
                break
            added = better
        if added is not None:
            return " ".join([*_LETTERS[:base], *map(_letters, added)])
    raise AssertionError("a full factorial has every resolution")


def _words(base: int, count: int, resolution: int) -> Iterator[list[int]]:
    """Products of base letters, as bits, for `count` more factors; none of the defining words is
    too short."""
    candidates = [word for word in range(1, 2**base) if word.bit_count() >= resolution - 1]
    candidates.sort(
        key=lambda word: (word.bit_count() % 2 != (resolution - 1) % 2, -word.bit_count(), word)
    )
    if len(candidates) < count:
        return

    def extended(chosen: list[int], defining: list[int], start: int) -> Iterator[list[int]]:
        if len(chosen) == count:
            yield chosen
            return
        for index in range(start, len(candidates) - (count - len(chosen)) + 1):
            word = candidates[index] | 1 << (base + len(chosen))
            products = [word ^ other for other in defining]
            if min(product.bit_count() for product in products) >= resolution:
                yield from extended([*chosen, candidates[index]], defining + products, index + 1)

    yield from extended([], [0], 0)


def _letters(word: int) -> str:
    return "".join(letter for place, letter in enumerate(_LETTERS) if word >> place & 1)
