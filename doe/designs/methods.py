"""Every way in which a plan's design is made: its title, and the function that makes it. A new one is an entry here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ..space import Space
from .base import Design

Method = Literal["lhs", "factorial", "import"]


@dataclass(frozen=True)
class Wanted:
    """What may be asked of a design. Each way takes of it what it needs, and refuses where that is missing.

    `runs`: how many; `table`: a CSV file with a column per factor.
    """

    runs: int | None
    table: Path | None
    rng: np.random.Generator


@dataclass(frozen=True)
class Way:
    """`make` raises `ValueError` for what it lacks; an `imported.ImportedDesign` keeps its own order and numbers."""

    title: str
    make: Callable[[Space, Wanted], Design]


def _lhs(space: Space, wanted: Wanted) -> Design:
    from .lhs import balanced

    if wanted.runs is None or wanted.runs < 1:
        raise ValueError(f"runs of a Latin hypercube is {wanted.runs}; expected 1 or more")
    return balanced(space, wanted.runs, wanted.rng)


def _factorial(space: Space, _: Wanted) -> Design:
    from .factorial import factorial

    return factorial(space)


def _import(space: Space, wanted: Wanted) -> Design:
    from .imported import read_table

    if wanted.table is None:
        raise ValueError("no table to import; expected a CSV file with a column per factor")
    return read_table(wanted.table, space)


METHODS: Mapping[Method, Way] = {
    "lhs": Way("balanced Latin hypercube", _lhs),
    "factorial": Way("full factorial", _factorial),
    "import": Way("a table of your own", _import),
}


def way_of(method: str) -> Way:
    """Raises `ValueError` that names those there are."""
    for known, way in METHODS.items():
        if known == method:
            return way
    raise ValueError(f"method is {method!r}; expected one of {', '.join(METHODS)}")
