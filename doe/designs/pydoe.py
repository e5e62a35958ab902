"""pyDOE3's designs, imported here and nowhere else: its successor has the same functions, and only
this file would change.

Points of a unit cube lie in [0, 1), coded ones run from -1 (low) over 0 (centre) to 1 (high). Where
pyDOE3 draws, it draws from the generator that it is given.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np

from ...array_types import Floats, Ids

LhsCriterion = Literal["random", "center", "maximin", "centermaximin", "correlation", "lhsmu"]
Face = Literal["ccc", "cci", "ccf"]
Alpha = Literal["orthogonal", "rotatable"]
OptimalCriterion = Literal["D", "A", "I"]
Exchange = Literal["sequential", "simple_exchange", "fedorov", "modified_fedorov", "detmax"]

#: Latin hypercubes that are drawn, of which the best by its criterion is kept.
_DRAWS = 20
#: Share of the candidates' information that is added while a design has too few runs to be judged
#: by its determinant.
_RIDGE = 1e-3


def unit_lhs(n: int, axes: int, rng: np.random.Generator, criterion: str = "maximin") -> Floats:
    """A Latin hypercube in the unit cube, (n, axes): one point in each n-th of each axis.

    (McKay, Beckman and Conover, Technometrics 21, 1979; maximin: Johnson, Moore and Ylvisaker, J.
    Stat. Plan. Inference 26, 1990; lhsmu: Deutsch and Deutsch, J. Stat. Plan. Inference 142, 2012.)
    "random" has no criterion. Raises `ValueError` for `n` or `axes` below 1, and for another
    criterion.
    """
    if n < 1 or axes < 1:
        raise ValueError(f"n is {n!r} and axes {axes!r}; expected at least 1 of each")
    if criterion not in get_args(LhsCriterion):
        raise ValueError(
            f"criterion is {criterion!r}; expected one of {', '.join(get_args(LhsCriterion))}"
        )
    from pyDOE3 import lhs

    if (
        criterion == "random" or n == 1 or (criterion == "correlation" and axes == 1)
    ):  # nothing to choose between
        return np.asarray(lhs(axes, samples=n, seed=rng), dtype=np.float64)
    return np.asarray(
        lhs(axes, samples=n, criterion=criterion, iterations=_DRAWS, seed=rng), dtype=np.float64
    )


def unit_sobol(n: int, axes: int, rng: np.random.Generator) -> Floats:
    """The first `n` points of a scrambled Sobol' sequence, (n, axes) (Owen, J. Complexity 14,
    1998)."""
    from pyDOE3 import sobol_sequence

    with (
        warnings.catch_warnings()
    ):  # of a number of points that is no power of two, which a campaign need not be
        warnings.simplefilter("ignore", UserWarning)
        points = sobol_sequence(n, axes, scramble=True, seed=rng, use_pow_of_2=False)
    return np.asarray(points, dtype=np.float64)


def unit_halton(n: int, axes: int, rng: np.random.Generator) -> Floats:
    """The first `n` points of Halton's sequence (Comm. ACM 7, 1964), shifted at random (Cranley,
    Patterson 1976)."""
    from pyDOE3 import cranley_patterson_shift, halton_sequence

    return np.asarray(cranley_patterson_shift(halton_sequence(n, axes), seed=rng), dtype=np.float64)


def full_factorial(sizes: Sequence[int]) -> Ids:
    """Every combination of level indices, (product of sizes, axes), the last axis fastest."""
    from pyDOE3 import fullfact

    return np.asarray(fullfact(list(sizes)[::-1])[:, ::-1], dtype=np.int64)


def generalized_subset(sizes: Sequence[int], reduction: int) -> Ids:
    """About one in `reduction` of all combinations, balanced (Surowiec et al., Anal. Chem. 89,
    2017), (n, axes).

    Raises `ValueError` where the reduction is too large for the sizes.
    """
    from pyDOE3 import gsd

    return np.asarray(gsd(list(sizes), reduction), dtype=np.int64)


def two_level(generators: str) -> Floats:
    """A two-level (fractional) factorial of generators such as "a b c ab", coded, (2^letters,
    factors).

    (Box, Hunter and Hunter, Statistics for Experimenters, chapter 6.) Raises `ValueError` for
    generators that are none.
    """
    from pyDOE3 import ff2n, fracfact

    words = generators.split()
    if words and all(len(word.strip("+-")) == 1 for word in words):
        letters = [word.lower() for word in words]
        if letters != [chr(ord("a") + index) for index in range(len(letters))]:
            raise ValueError(
                f"generators are {generators!r}; expected "
                f"a letter of its own for each factor: a b c"
            )
        return np.asarray(ff2n(len(letters)), dtype=np.float64)
    try:
        return np.asarray(fracfact(" ".join(words)), dtype=np.float64)
    except (ValueError, IndexError) as error:
        raise ValueError(
            f"generators are {generators!r}; expected such as 'a b c ab ac': {error}"
        ) from error


def plackett_burman(factors: int) -> Floats:
    """Plackett and Burman's two-level design (Biometrika 33, 1946), coded, (multiple of 4 above
    factors, factors)."""
    from pyDOE3 import pbdesign

    try:
        return np.asarray(pbdesign(factors), dtype=np.float64)
    except AssertionError as error:
        raise ValueError(
            f"{factors} factors; pyDOE3 has no Plackett-Burman design of so many"
        ) from error


def central_composite(factors: int, centre: tuple[int, int], alpha: Alpha, face: Face) -> Floats:
    """Cube, centre and star points, coded, (n, factors) (Box and Wilson, J. Royal Stat. Soc. B 13,
    1951).

    `centre`: centre points beside the cube and beside the star. Raises `ValueError` for fewer than
    two factors.
    """
    from pyDOE3 import ccdesign

    if factors < 2:
        raise ValueError(f"{factors} factor; expected two or more for a central composite design")
    return np.asarray(ccdesign(factors, center=centre, alpha=alpha, face=face), dtype=np.float64)


def box_behnken(factors: int, centre: int | None) -> Floats:
    """Midpoints of the cube's edges and centre points, coded, (n, factors) (Technometrics 2, 1960).

    Raises `ValueError` for fewer than three factors.
    """
    from pyDOE3 import bbdesign

    if factors < 3:
        raise ValueError(f"{factors} factors; expected three or more for a Box-Behnken design")
    return np.asarray(bbdesign(factors, center=centre), dtype=np.float64)


def optimal(
    candidates: Floats, n: int, degree: int, criterion: OptimalCriterion, exchange: Exchange
) -> Floats:
    """The `n` of the candidates (k, columns) that serve a polynomial of `degree` best, (n,
    columns).

    (Fedorov, Theory of Optimal Experiments, 1972; Mitchell, Technometrics 16, 1974.) Raises
    `ValueError` where they cannot determine the polynomial.
    """
    from pyDOE3.doe_optimal import build_design_matrix, optimal_design

    terms = build_design_matrix(candidates, degree)
    needed = terms.shape[1]
    if n < needed or np.linalg.matrix_rank(terms) < needed:
        raise ValueError(
            f"{n} runs for a model of {needed} terms; expected {needed} or "
            f"more, and levels that tell them"
        )
    chosen, _ = optimal_design(
        candidates, n, degree, criterion=criterion, method=exchange, alpha=_RIDGE
    )
    if np.linalg.matrix_rank(build_design_matrix(chosen, degree)) < needed:
        raise ValueError(
            f"{exchange} gave {n} runs that do not determine the model; expected more runs"
        )
    return np.asarray(chosen, dtype=np.float64)
