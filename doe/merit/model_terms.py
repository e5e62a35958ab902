"""What a model of a design's factors can and cannot tell apart: the terms of the model, how far two
of them go together, how much that widens their errors, and the power with which the effect of each
factor is seen.

A term is a main effect or an interaction of two factors ("a*b"). Levels that no run has are left
out. A continuous factor is taken by its linear effect, every other one by the differences of its
levels.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats, Levels
from ..space import Space
from .space_filling import main_effects

#: Singular values below this share of the largest are rounding.
_RANK = 1e-9
#: The effect for which power is shown where nobody names one, in standard deviations of a run.
USUAL_EFFECT = 2.0
#: Chance of calling an effect real that is none.
USUAL_ALPHA = 0.05


@dataclass(frozen=True)
class ModelTerm:
    """One term of a model; `columns` (n, degrees of freedom) are centred, `axes` are the indices of
    its factors."""

    name: str
    axes: tuple[int, ...]
    columns: Floats

    @property
    def main(self) -> bool:
        """Whether it is a main effect."""
        return len(self.axes) == 1


def axis_words(name: str) -> str:
    """The name of an axis within that of an interaction: one of several factors stands in
    brackets."""
    return f"({name})" if "+" in name else name


def main_terms(space: Space, treatments: Levels) -> list[ModelTerm]:
    """The main effects of treatments (n, axes) in effect coding; an axis with one level in use has
    none.

    Raises `ValueError` for rows that are no treatments of the space.
    """
    rows = space.checked(treatments)
    terms = []
    for index, axis in enumerate(space.axes):
        levels, coded = np.unique(rows[:, index], return_inverse=True)
        if len(levels) < 2:
            continue
        if axis.continuous:
            ends = levels[0] + levels[-1]
            columns = ((2.0 * rows[:, index] - ends) / (levels[-1] - levels[0]))[:, None]
        else:
            columns = main_effects(coded[:, None], [len(levels)])[:, 1:]
        terms.append(ModelTerm(axis.name, (index,), columns - columns.mean(axis=0)))
    return terms


def interaction_terms(main: Sequence[ModelTerm]) -> list[ModelTerm]:
    """Interactions of every two main effects: the products of their columns."""
    terms = []
    for a, b in itertools.combinations(main, 2):
        columns = (a.columns[:, :, None] * b.columns[:, None, :]).reshape(len(a.columns), -1)
        name = f"{axis_words(a.name)}*{axis_words(b.name)}"
        terms.append(ModelTerm(name, a.axes + b.axes, columns - columns.mean(axis=0)))
    return terms


def term_correlations(terms: Sequence[ModelTerm]) -> Floats:
    """How far each two terms go together, (terms, terms) from 0 to 1: 1 where one hides the other
    wholly.

    It is the root of the mean squared canonical correlation of their columns, over the columns of
    the smaller term. Between terms of one column it is the absolute correlation, as a correlation
    map of design software shows it (Jones and Nachtsheim, Journal of Quality Technology 43, 2011).
    It depends on no coding of the levels.
    """
    bases = [_basis(term.columns) for term in terms]
    result = np.eye(len(terms))
    for a, b in itertools.combinations(range(len(terms)), 2):
        smaller = min(bases[a].shape[1], bases[b].shape[1])
        shared = float(((bases[a].T @ bases[b]) ** 2).sum())
        result[a, b] = result[b, a] = min(1.0, np.sqrt(shared / smaller)) if smaller else 0.0
    return result


def _basis(columns: Floats) -> Floats:
    """Orthonormal columns that span the same space."""
    singular_vectors, values, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(
        singular_vectors[:, values > _RANK * max(1.0, values.max(initial=0.0))], dtype=np.float64
    )


def variance_inflation(terms: Sequence[ModelTerm]) -> list[float]:
    """By how much the other terms widen the variance of each one: 1 where it is orthogonal to them,
    infinite where they hide it.

    It is the generalised variance inflation factor to the power 1/(degrees of freedom) (Fox and
    Monette, Journal of the American Statistical Association 87, 1992); for a term of one column it
    is the usual factor 1 / (1 - R^2).
    """
    columns = np.hstack([term.columns for term in terms]) if terms else np.zeros((1, 0))
    if not terms or _rank(columns) < columns.shape[1]:
        return [_inflation_beside(terms, index) for index in range(len(terms))]
    scaled = columns / np.linalg.norm(columns, axis=0)
    correlation = scaled.T @ scaled
    places = _places(terms)
    whole = np.linalg.slogdet(correlation)[1]
    inflation = []
    for place in places:
        others = np.setdiff1d(np.arange(columns.shape[1]), place)
        own = np.linalg.slogdet(correlation[np.ix_(place, place)])[1]
        rest = np.linalg.slogdet(correlation[np.ix_(others, others)])[1] if len(others) else 0.0
        inflation.append(float(np.exp((own + rest - whole) / len(place))))
    return inflation


def _inflation_beside(terms: Sequence[ModelTerm], index: int) -> float:
    """Where the model is singular: of the terms that the others do not hide; infinite for one that
    they do."""
    others = [term.columns for place, term in enumerate(terms) if place != index]
    own = _basis(terms[index].columns)
    if own.shape[1] < terms[index].columns.shape[1]:
        return float("inf")
    beside = _basis(np.hstack(others)) if others else np.zeros((len(own), 0))
    shared = np.linalg.svd(beside.T @ own, compute_uv=False) if beside.shape[1] else np.zeros(0)
    free = 1.0 - np.minimum(1.0, shared) ** 2
    if (free < _RANK).any():
        return float("inf")
    return float(np.exp(-np.log(free).sum() / own.shape[1]))


def _rank(columns: Floats) -> int:
    return int(_basis(columns).shape[1])


def _places(terms: Sequence[ModelTerm]) -> list[NDArray[np.int64]]:
    """The columns of each term in the matrix of all."""
    ends = np.cumsum([0, *(term.columns.shape[1] for term in terms)])
    return [np.arange(start, end) for start, end in itertools.pairwise(ends)]


@dataclass(frozen=True)
class TermPower:
    """What a design can see of one main effect, in a model of all main effects."""

    term: str
    levels: int  #: in use
    columns: int  #: of the model: one less than the levels, one for a continuous factor
    variance_inflation: float  #: 1 is best
    power: float  #: chance that the effect asked for is called real; 0 where it cannot be estimated
    #: that is seen with a chance of 80 %, in standard deviations of a run; may be infinite
    smallest_effect: float
    #: of a design as good as this one, for a power of 80 %; None where it has no estimate
    runs_needed: int | None


def main_effect_power(
    space: Space, treatments: Levels, effect: float = USUAL_EFFECT, alpha: float = USUAL_ALPHA
) -> list[TermPower]:
    """The power of each main effect of treatments (n, axes).

    `effect` is the difference of the means of two levels (of the ends, for a continuous factor)
    over the standard deviation of the response of one run; the other levels lie in the middle
    between the two, and the two are those that the design compares worst. The test is F, in a model
    of all main effects, at the level `alpha` (Montgomery, section 3.7; noncentrality as in
    Design-Expert, whose usual effect is two standard deviations, too). Raises `ValueError` for an
    effect that is not above 0, an alpha outside 0 to 1, and rows that are no treatments.
    """
    if not effect > 0 or not np.isfinite(effect):
        raise ValueError(f"effect is {effect}; expected a number of standard deviations above 0")
    if not 0 < alpha < 1:
        raise ValueError(f"alpha is {alpha}; expected a chance between 0 and 1")
    terms = main_terms(space, treatments)
    inflation = variance_inflation(terms)
    if not terms:
        return []
    columns = np.hstack([term.columns for term in terms])
    residual = len(columns) - 1 - columns.shape[1]
    estimable = _rank(columns) == columns.shape[1] and residual > 0
    inverse: Floats = np.empty((0, 0))
    if estimable:
        inverse = np.asarray(np.linalg.inv(columns.T @ columns), dtype=np.float64)
    powers = []
    for term, place, factor in zip(terms, _places(terms), inflation, strict=True):
        degrees = len(place)
        levels = len(np.unique(space.checked(treatments)[:, term.axes[0]]))
        if not estimable:
            powers.append(TermPower(term.name, levels, degrees, factor, 0.0, float("inf"), None))
            continue
        unit = _worst_noncentrality(inverse[np.ix_(place, place)], degrees)
        chance = _power(unit * effect**2, degrees, residual, alpha)
        smallest = _smallest(unit, degrees, residual, alpha)
        needed = _runs_needed(unit * effect**2 / len(columns), degrees, columns.shape[1] + 1, alpha)
        powers.append(TermPower(term.name, levels, degrees, factor, chance, smallest, needed))
    return powers


def _worst_noncentrality(covariance: Floats, degrees: int) -> float:
    """Of a difference of one standard deviation between two levels, those that are compared
    worst."""
    information = np.linalg.inv(covariance)
    if degrees == 1:  # two levels, or the ends of a range, at -1 and 1
        return float(information[0, 0]) / 4
    smallest = np.inf
    for a, b in itertools.combinations(range(degrees + 1), 2):
        effects = np.zeros(degrees + 1)
        effects[a], effects[b] = 0.5, -0.5
        smallest = min(smallest, float(effects[:-1] @ information @ effects[:-1]))
    return smallest


def _power(noncentrality: float, degrees: int, residual: int, alpha: float) -> float:
    from scipy import stats

    critical = stats.f.isf(alpha, degrees, residual)
    return float(np.clip(stats.ncf.sf(critical, degrees, residual, noncentrality), 0.0, 1.0))


#: The power that `TermPower.smallest_effect` has, as design software asks for it.
ENOUGH_POWER = 0.8


def _smallest(unit: float, degrees: int, residual: int, alpha: float) -> float:
    """The effect in standard deviations whose power is `ENOUGH_POWER`."""
    from scipy.optimize import brentq

    def short(effect: float) -> float:
        return _power(unit * effect**2, degrees, residual, alpha) - ENOUGH_POWER

    high = 1.0
    while short(high) < 0:
        high *= 2
        if high > 1e6:
            return float("inf")
    return float(brentq(short, 0.0, high, xtol=1e-6))


def _runs_needed(noncentrality_of_run: float, degrees: int, coefficients: int, alpha: float) -> int:
    """The fewest runs, each with the same share of the noncentrality, whose power is
    `ENOUGH_POWER`."""

    def enough(runs: int) -> bool:
        return (
            _power(noncentrality_of_run * runs, degrees, runs - coefficients, alpha) >= ENOUGH_POWER
        )

    low, high = coefficients, coefficients + 1
    while not enough(high):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high
