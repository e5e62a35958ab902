"""The search over sets of effects: on linear problems it finds those that act, and no others."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.inference.model_search import (
    NONE_PRIOR,
    WINDOW,
    ModelLibrary,
    fit_sets,
    search,
    set_prior,
)
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.inference.subset_fit import no_effects, with_evidence
from pyroshock.parallel.phases import WHOLE
from support.records.linear_problems import linear_law, linear_problem

SHAPE = (12, 1)
ACTING = ("gun.linear_1", "gun.linear_4")


def problem_of(sizes: dict[str, float], seed: int = 0, effects: int = 6) -> InferenceProblem:
    """Effects with unlike responses of some tolerances."""
    rng, noise = np.random.default_rng(seed), 0.3
    responses = 4 * rng.standard_normal((effects, *SHAPE))
    gap = noise * rng.standard_normal(SHAPE)
    for name, size in sizes.items():
        gap = gap + size * responses[int(name[-1])]
    return linear_problem(responses, gap, noise**2 * np.eye(SHAPE[0]))


@pytest.mark.parametrize("seed", [0, 1])
def test_best_set_is_that_of_the_effects_that_act_and_none_of_noise(seed):
    library = search(problem_of(dict(zip(ACTING, (1.0, -0.7), strict=True)), seed))
    assert set(library.best().effects) == set(ACTING)
    assert search(problem_of({}, seed)).best().laws == ()


def test_progress_is_told_within_the_search_and_never_falls():
    progress_calls: list[tuple[int, int, str]] = []
    search(
        problem_of(dict(zip(ACTING, (1.0, -0.7), strict=True))),
        lambda done, total, what: progress_calls.append((done, total, what)),
    )
    steps = [done for done, _, _ in progress_calls]
    assert steps == sorted(steps)
    assert {total for _, total, _ in progress_calls} == {WHOLE}
    assert steps[0] == 0 and len(set(steps)) >= 5 and 80 <= steps[-1] <= WHOLE
    assert {"all effects at once", "exchanges of effects"} <= {what for *_, what in progress_calls}


def test_effects_that_only_together_pay_are_in_the_best_set():
    """Two responses of which the gap is the difference: alone each of them makes it larger."""
    rng = np.random.default_rng(3)
    common = 10 * np.ones(SHAPE)
    away = rng.standard_normal((2, *SHAPE))
    away -= away.mean(axis=1, keepdims=True)
    responses = np.array(
        [common + 2 * away[0], common + 2 * away[1], 4 * rng.standard_normal(SHAPE)]
    )
    gap = responses[0] - responses[1]
    problem = linear_problem(responses, gap, 0.01 * np.eye(SHAPE[0]))
    assert set(search(problem).best().effects) == {"gun.linear_0", "gun.linear_1"}


def test_search_finds_the_best_of_all_sets():
    """All 2^5 of them fitted one by one."""
    problem = problem_of(
        {"gun.linear_0": 0.5, "gun.linear_2": -0.4, "gun.linear_4": 0.15}, seed=7, effects=5
    )
    library = search(problem)
    everything = ModelLibrary(problem)
    everything.add([no_effects(problem)])
    sets = [
        names for size in range(1, 6) for names in itertools.combinations(problem.effects, size)
    ]
    fit_sets(problem, everything, sets)
    assert len(everything.fits) == 32
    assert set(library.best().effects) == set(everything.best().effects)
    assert library.log_joint(library.best()) == pytest.approx(
        everything.log_joint(everything.best()), abs=0.1
    )


def test_sets_that_do_the_same_are_compared_by_the_same_background():
    """The second of two effects with one response was fitted with the background that has nothing
    in it."""
    rng, noise = np.random.default_rng(11), 0.3
    response = 4 * rng.standard_normal(SHAPE)
    smooth = np.linspace(-2, 2, SHAPE[0])[:, None]
    problem = linear_problem(
        np.array([response, response]), response + smooth, noise**2 * np.eye(SHAPE[0])
    )
    plain = noise**2 * np.eye(SHAPE[0])
    object.__setattr__(
        problem.blocks[0], "covariances", np.stack([plain, plain + smooth @ smooth.T])
    )
    library = ModelLibrary(problem)
    library.add([no_effects(problem)])
    fit_sets(problem, library, [["gun.linear_0"], ["gun.linear_1"]])
    first, second = (library.fits[f"gun.linear_{i}/size",] for i in (0, 1))
    assert first.errors[0].background == 1
    worse = with_evidence(
        problem, replace(second, errors=(replace(second.errors[0], background=0),))
    )
    library.fits["gun.linear_1/size",] = worse
    assert worse.log_evidence < first.log_evidence - 5
    library.compare_backgrounds()
    assert library.fits["gun.linear_1/size",].log_evidence == pytest.approx(
        first.log_evidence, abs=1e-6
    )


def test_weights_are_the_tempered_joint_s_within_occams_window():
    library = search(problem_of(dict(zip(ACTING, (1.0, -0.7), strict=True))))
    weighted = library.weights()
    joint = np.array([library.log_joint(fit) for fit, _ in weighted])
    share = np.array([weight for _, weight in weighted])
    assert share.sum() == pytest.approx(1.0)
    assert np.all(np.diff(share) <= 0)
    np.testing.assert_allclose(
        np.log(share) - np.log(share[0]), library.temper * (joint - joint[0]), atol=1e-9
    )
    assert joint.min() > joint.max() - WINDOW
    left_out = [fit for fit in library.fits.values() if fit not in [kept for kept, _ in weighted]]
    assert all(library.log_joint(fit) <= joint.max() - WINDOW for fit in left_out)
    # Also those that do not look promising at any of their usual starts.
    problem = problem_of({"gun.linear_0": 3.0})
    library = search(problem)
    assert all((law.key,) in library.fits for law in problem.laws)


@pytest.mark.parametrize("count", [1, 6, 40])
def test_none_is_as_likely_before_whatever_the_number_of_effects(count):
    prior = set_prior([linear_law(i) for i in range(count)])
    assert sum(off for _, off in prior.values()) == pytest.approx(np.log(NONE_PRIOR))


def test_prior_of_one_effect_is_a_probability_with_its_odds():
    for on, off in set_prior([linear_law(i) for i in range(6)]).values():
        assert np.exp(on) + np.exp(off) == pytest.approx(1.0)
    # An effect whose kind says that it is three times as likely has three times the odds.
    prior = set_prior([linear_law(0), linear_law(1), linear_law(2, prior_odds=3.0)])
    odds = {name: np.exp(on - off) for name, (on, off) in prior.items()}
    assert odds["gun.linear_2"] == pytest.approx(3 * odds["gun.linear_0"])
    assert odds["gun.linear_1"] == pytest.approx(odds["gun.linear_0"])
    assert sum(off for _, off in prior.values()) == pytest.approx(np.log(NONE_PRIOR))
    assert set_prior([]) == {}
    problem = problem_of({})
    library = search(problem)
    fit_sets(problem, library, [["gun.linear_3"]])
    prior = set_prior(problem.laws)
    fit = library.fits[("gun.linear_3/size",)]
    others = sum(off for name, (_, off) in prior.items() if name != "gun.linear_3")
    assert library.log_set_prior(fit) == pytest.approx(prior["gun.linear_3"][0] + others)


def test_likelier_or_polished_fit_of_the_same_laws_stays():
    problem = problem_of(dict(zip(ACTING, (1.0, -0.7), strict=True)))
    library = ModelLibrary(problem, {(): no_effects(problem)})
    fit_sets(problem, library, [["gun.linear_1"]])
    key = ("gun.linear_1/size",)
    fit = library.fits[key]
    library.add([replace(fit, log_evidence=fit.log_evidence - 1)])
    assert library.fits[key] is fit
    library.add([likelier := replace(fit, log_evidence=fit.log_evidence + 1)])
    assert library.fits[key] is likelier
    # The evidence of the rough one is from derivatives that may be of another place.
    library = ModelLibrary(problem, {(): no_effects(problem)})
    fit_sets(problem, library, [["gun.linear_1"]])
    fit = library.fits.pop(key)
    assert fit.polished
    library.add([replace(fit, polished=False, log_evidence=fit.log_evidence + 5)])
    library.add([fit])
    assert library.fits[key] is fit
