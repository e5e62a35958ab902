"""Every method by which a plan's design is made. A new one is a function and its entry here: the
command line, the pages, the JSON API, jobs and the Python API offer what stands in `METHODS`, with
the options that stand beside it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..space import Space
from .base import Design, SurfaceWords, TwoLevelWords
from .factorial import factorial, subset
from .imported import read_table
from .optimal import optimal
from .pydoe import Alpha, Exchange, Face, LhsCriterion, OptimalCriterion
from .response_surface import box_behnken, central_composite
from .space_filling import halton, latin_hypercube, sobol
from .two_level import fractional_factorial, plackett_burman

OptionValue = str | int | float


@dataclass(frozen=True)
class Option:
    """A setting of one method. `kind` is the type of its value; `default` None: the method
    decides."""

    name: str
    help: str
    default: OptionValue | None = None
    kind: type[str] | type[int] | type[float] = str
    choices: tuple[str, ...] = ()

    def value(self, given: object) -> OptionValue:
        """The value in the option's type. Raises `ValueError` naming the option, the value and what
        was expected."""
        try:
            value = self.kind(str(given).strip())
        except ValueError:
            expected = "a whole number" if self.kind is int else "a number"
            raise ValueError(f"{self.name} is {given!r}; expected {expected}") from None
        if self.choices and value not in self.choices:
            raise ValueError(f"{self.name} is {given!r}; expected one of {', '.join(self.choices)}")
        return value


@dataclass(frozen=True)
class DesignRequest:
    """What may be asked of a design; each method takes of it what it needs.

    `runs`: how many; `table`: a CSV file with a column per factor; `options`: those of the method,
    by name.
    """

    runs: int | None
    table: Path | None
    rng: np.random.Generator
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def wanted_runs(self) -> int:
        """Raises `ValueError` where none are wanted."""
        if self.runs is None or self.runs < 1:
            raise ValueError(f"runs is {self.runs}; expected 1 or more")
        return self.runs


@dataclass(frozen=True)
class DesignMethod:
    """`function` takes the space, the request and the options as keywords. `takes` is what it needs
    of the request."""

    title: str
    help: str
    function: Callable[..., Design]
    takes: tuple[str, ...] = ()  #: "runs", "table"
    options: Sequence[Option] = ()
    repeats: bool = (
        False  #: treatments may come twice: centre points, or levels that points are rounded to
    )
    example: str = ""  #: of the command line

    @property
    def centre_points(self) -> bool:
        """Whether centre points can be added: the design has none of its own, and is no table."""
        return "table" not in self.takes and all(option.name != "centre" for option in self.options)

    def checked(self, given: Mapping[str, Any]) -> dict[str, OptionValue]:
        """Options with their values in their types, those without a value left out.

        Raises `ValueError` for one that the method has not, naming those that it has.
        """
        options_by_name = {option.name: option for option in self.options}
        for name in given:
            if name not in options_by_name:
                expected = ", ".join(options_by_name) or "none"
                raise ValueError(f"unknown option {name!r}; the method has: {expected}")
        stated = {name: value for name, value in given.items() if value is not None and value != ""}
        return {name: options_by_name[name].value(value) for name, value in stated.items()}

    def make(self, space: Space, request: DesignRequest) -> Design:
        """The design, not yet in order of run. Its `method` names the options that are not the
        usual ones.

        Raises `ValueError` for what the method lacks and for what it cannot do; an
        `imported.ImportedDesign` keeps its own order and numbers.
        """
        options = self.checked(request.options)
        design = self.function(space, request, **options)
        usual = {option.name: option.default for option in self.options}
        changed = [f"{name}={value}" for name, value in options.items() if value != usual[name]]
        return replace(design, method=" ".join([design.method, *changed]))


def _of_space(design: Callable[..., Design]) -> Callable[..., Design]:
    """A function of the space and options, as a method's."""
    return lambda space, _request, **options: design(space, **options)


def _of_runs(design: Callable[..., Design]) -> Callable[..., Design]:
    """A function of the space, the number of runs, `rng` and options, as a method's."""
    return lambda space, request, **options: design(
        space, request.wanted_runs, request.rng, **options
    )


def _hypercube(
    space: Space, n: int, rng: np.random.Generator, criterion: str = "balance"
) -> Design:
    if criterion != "balance":
        return latin_hypercube(space, n, rng, criterion)
    from .lhs import balance_levels

    return balance_levels(space, n, rng)


def _import(space: Space, request: DesignRequest) -> Design:
    if request.table is None:
        raise ValueError("no table to import; expected a CSV file with a column per factor")
    return read_table(request.table, space)


_LEVELS = Option(
    "levels", "Set the number of values of each continuous factor, at equal distances.", 3, int
)
_TWO_LEVEL_WORDS = Option(
    "categorical",
    "Say what to do with a factor of three or more words without order, as the design has "
    "two levels: refuse it, or take the first and the last word.",
    "refuse",
    choices=get_args(TwoLevelWords),
)
_SURFACE_WORDS = Option(
    "categorical",
    "Say what to do with a factor of words without order: refuse it, or "
    "repeat the whole design at each word.",
    "refuse",
    choices=get_args(SurfaceWords),
)

METHODS: Mapping[str, DesignMethod] = {
    "lhs": DesignMethod(
        "Latin hypercube",
        "Make a Latin hypercube: each level, and each pair of levels, occurs "
        "as often as any other.",
        _of_runs(_hypercube),
        ("runs",),
        [
            Option(
                "criterion",
                "Choose the hypercube by the balance of levels, pairs and "
                "triples, or by one of pyDOE3's criteria.",
                "balance",
                choices=("balance", *get_args(LhsCriterion)),
            )
        ],
        repeats=True,
        example="plan lhs spring --runs 24 --seed 1 --out spring.csv",
    ),
    "sobol": DesignMethod(
        "Sobol' sequence",
        "Take points of a scrambled Sobol' sequence, for continuous factors. Powers of two "
        "are the best numbers of runs.",
        _of_runs(sobol),
        ("runs",),
        repeats=True,
        example="plan sobol spring --runs 64 --range tank_pressure_bar=0.8:6 --seed 1",
    ),
    "halton": DesignMethod(
        "Halton sequence",
        "Take points of a shifted Halton sequence, for continuous factors and any number of runs.",
        _of_runs(halton),
        ("runs",),
        repeats=True,
        example="plan halton spring --runs 50 --range tank_pressure_bar=0.8:6 --seed 1",
    ),
    "factorial": DesignMethod(
        "full factorial",
        "Take every feasible treatment, in an order with few changeovers.",
        _of_space(factorial),
        options=[_LEVELS],
        example="plan factorial hammer --kind hammer",
    ),
    "subset": DesignMethod(
        "generalized subset design",
        "Take a balanced part of all treatments, for factors with any number of levels.",
        _of_space(subset),
        options=[
            Option("reduction", "Take one in this number of all treatments.", 2, int),
            _LEVELS,
        ],
        example="plan subset spring --reduction 3",
    ),
    "fractional-factorial": DesignMethod(
        "two-level fractional factorial",
        "Take two levels of each factor and a part of their combinations, which gives the "
        "main effects of many factors in few runs.",
        _of_space(fractional_factorial),
        options=[
            Option(
                "generators",
                "Give a word for each factor, such as 'a b c ab ac'. "
                "[default: the fewest runs of the resolution]",
            ),
            Option(
                "resolution",
                "Set the resolution: with 3, main effects are aliased with pairs; with 4, pairs "
                "with pairs; with 5, neither.",
                4,
                int,
            ),
            _TWO_LEVEL_WORDS,
        ],
        example="plan fractional-factorial screening --resolution 4 --categorical first-last",
    ),
    "plackett-burman": DesignMethod(
        "Plackett-Burman design",
        "Take two levels of each factor; the number of runs is the next "
        "multiple of four above the number of factors.",
        _of_space(plackett_burman),
        options=[_TWO_LEVEL_WORDS],
        example="plan plackett-burman screening --categorical first-last",
    ),
    "central-composite": DesignMethod(
        "central composite design",
        "Take corners, star points and centre points, for a quadratic "
        "surface over ordered and continuous factors.",
        _of_space(central_composite),
        options=[
            Option(
                "face",
                "Place the star points on the faces of the range (ccf), at its ends with a smaller "
                "cube (cci), or at alpha times a cube that you choose (ccc).",
                "ccf",
                choices=get_args(Face),
            ),
            Option(
                "alpha",
                "Choose the distance of the star points: for orthogonal blocks, or for the same "
                "variance in all directions.",
                "orthogonal",
                choices=get_args(Alpha),
            ),
            Option(
                "centre",
                "Set the number of centre points beside "
                "the cube, and as many beside the star points.",
                4,
                int,
            ),
            Option(
                "cube",
                "Set the share of the range that the cube takes, with --face ccc.",
                0.5,
                float,
            ),
            _SURFACE_WORDS,
        ],
        repeats=True,
        example="plan central-composite surface --range tank_pressure_bar=1:6 --range "
        "bullet_mass_kg=0.2:0.6 --categorical cross",
    ),
    "box-behnken": DesignMethod(
        "Box-Behnken design",
        "Take midpoints of edges and centre points, for a quadratic surface "
        "without runs at the corners of the range.",
        _of_space(box_behnken),
        options=[
            Option(
                "centre", "Set the number of centre points. [default: the usual number]", None, int
            ),
            _SURFACE_WORDS,
        ],
        repeats=True,
        example="plan box-behnken surface --categorical cross",
    ),
    "optimal": DesignMethod(
        "optimal design",
        "Choose the runs that serve a stated model best from all feasible treatments.",
        _of_runs(optimal),
        ("runs",),
        [
            Option(
                "criterion",
                "Choose what is optimised: D takes the determinant of the information, A the "
                "variance of the coefficients, I the variance of predictions.",
                "D",
                choices=get_args(OptimalCriterion),
            ),
            Option(
                "degree",
                "Set the degree of the model: 1 has main effects, 2 has "
                "squares and interactions, too.",
                1,
                int,
            ),
            Option(
                "exchange",
                "Choose the exchange algorithm of pyDOE3.",
                "detmax",
                choices=get_args(Exchange),
            ),
            _LEVELS,
        ],
        example="plan optimal spring --runs 24 --seed 1",
    ),
    "import": DesignMethod(
        "a table of your own",
        "Read a design that somebody else has made from a CSV table, and keep its order.",
        _import,
        ("table",),
        repeats=True,
        example="plan lhs spring --runs 12 --out table.csv\nplan import own table.csv",
    ),
}


def get_method(name: str) -> DesignMethod:
    """Raises `ValueError` that names those there are."""
    if name not in METHODS:
        raise ValueError(f"method is {name!r}; expected one of {', '.join(METHODS)}")
    return METHODS[name]
