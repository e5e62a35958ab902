"""Two effects for two others: on linear problems the screening is exact, and the search finds what
it plants."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pyroshock.diagnosis.inference.exchanges_of_two import exchanges_of_two
from pyroshock.diagnosis.inference.model_search import (
    ModelLibrary,
    _exchange,
    _exchange_two,
    fit_sets,
)
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.inference.subset_fit import no_effects
from support.records.linear_problems import linear_problem

SHAPE, NOISE = (16, 1), 0.3


def problem_of(seed: int = 0, effects: int = 6) -> InferenceProblem:
    rng = np.random.default_rng(seed)
    responses = 3 * rng.standard_normal((effects, *SHAPE))
    gap = responses[4] - 0.7 * responses[5] + NOISE * rng.standard_normal(SHAPE)
    return linear_problem(responses, gap, NOISE**2 * np.eye(SHAPE[0]))


def library_of(problem: InferenceProblem, *sets: tuple[str, ...]) -> ModelLibrary:
    library = ModelLibrary(problem, {(): no_effects(problem)})
    fit_sets(problem, library, sets)
    return library


def names(*numbers: int) -> tuple[str, ...]:
    return tuple(f"gun.linear_{number}" for number in numbers)


def fit_of(library: ModelLibrary, effects: tuple[str, ...]):
    return next(fit for fit in library.fits.values() if set(fit.effects) == set(effects))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_screening_ranks_sets_of_a_linear_problem_as_their_evidence_does(seed):
    problem = problem_of(seed)
    current = fit_of(library_of(problem, names(0, 1)), names(0, 1))
    starts = [(law, u) for law in problem.laws for u in law.starts()]
    screened = exchanges_of_two(problem, current, starts, 200)
    scores = {frozenset(law.id for law in one.laws): one.score for one in screened}
    # Two for one and for two, one for two, and two more.
    others = names(2, 3, 4, 5)
    expected = {frozenset(pair) for pair in itertools.combinations(others, 2)}
    expected |= {
        frozenset((old, *pair)) for old in names(0, 1) for pair in itertools.combinations(others, 2)
    }
    expected |= {frozenset((*names(0, 1), *pair)) for pair in itertools.combinations(others, 2)}
    expected |= {frozenset([name]) for name in others}
    assert set(scores) == expected
    assert max(scores, key=scores.__getitem__) == frozenset(names(4, 5))
    # A score is the evidence of a fit, up to one constant, where no step was shortened.
    library = library_of(problem, *(tuple(sorted(key)) for key in expected))
    near = [key for key in expected if {*names(4, 5)} <= key]
    evidence = [fit_of(library, tuple(key)).log_evidence for key in near]
    offsets = np.array([scores[key] for key in near]) - evidence
    assert np.ptp(offsets) < 0.3, offsets


def hill_problem() -> InferenceProblem:
    """Effects 0 and 1 do together what 2 and 3 do, but for a part that only the latter have; one of
    each is far off."""
    rng = np.random.default_rng(5)
    basis = np.linalg.qr(rng.standard_normal((SHAPE[0], 6)))[0].T[:, :, None]
    first, second, apart, own = 8 * basis[0], 8 * basis[1], 40 * basis[2], 4 * basis[3]
    half = (first + second) / 2
    responses = np.array(
        [first, second, half + apart, half - apart + own, 3 * basis[4], 3 * basis[5]]
    )
    gap = responses[2] + responses[3] + NOISE * rng.standard_normal(SHAPE)
    return linear_problem(responses, gap, NOISE**2 * np.eye(SHAPE[0]))


def test_pair_beyond_a_hill_is_found_by_two_exchanges_at_once_and_not_by_single_ones():
    problem = hill_problem()
    library = library_of(
        problem, *((name,) for name in problem.effects), names(0, 1), names(0, 1, 4)
    )
    _exchange(problem, library)
    assert set(library.best().effects) == set(names(0, 1))
    before = library.log_joint(library.best())
    _exchange_two(problem, library)
    assert set(library.best().effects) == set(names(2, 3))
    assert library.log_joint(library.best()) > before + 50
