"""Terms of a model, their correlations, inflation and power, against closed forms and simulated
campaigns."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.designs.two_level import fractional_factorial
from pyroshock.doe.factors import DesignFactor
from pyroshock.doe.merit.model_terms import (
    TermPower,
    interaction_terms,
    main_effect_power,
    main_terms,
    term_correlations,
    variance_inflation,
)
from pyroshock.doe.merit.quality import aliases
from pyroshock.doe.merit.space_filling import main_effects
from pyroshock.doe.space import Space, gun_space, space_of
from scipy import stats

GUN = gun_space()


def _space(*sizes: int) -> Space:
    return space_of("s", "gun", [_factor(f"f{k}", size) for k, size in enumerate(sizes)])


def _factor(name: str, levels: int) -> DesignFactor:
    return DesignFactor(name, name, tuple(f"{name}{k}" for k in range(levels)), None, False, 0)


def _powers(space: Space, rows: NDArray[np.int64], effect: float = 2.0) -> dict[str, TermPower]:
    return {term.term: term for term in main_effect_power(space, rows, effect)}


def test_two_level_factorial_has_the_power_that_design_software_prints() -> None:
    """Three factors in 8 runs, and in 16, for two standard deviations: 57.2 % and 95.6 %."""
    space = _space(2, 2, 2)
    rows = space.all_treatments()
    assert [round(100 * term.power, 1) for term in main_effect_power(space, rows)] == [57.2] * 3
    assert [
        round(100 * term.power, 1) for term in main_effect_power(space, np.tile(rows, (2, 1)))
    ] == [95.6] * 3
    assert {round(term.variance_inflation, 9) for term in main_effect_power(space, rows)} == {1.0}


def test_two_groups_have_the_power_of_the_t_test() -> None:
    """Two groups of m and n runs: noncentrality of t is effect / sqrt(1/m + 1/n) (Montgomery,
    section 2.4)."""
    space, effect = _space(2), 1.3
    rows = np.array([0] * 7 + [1] * 12)[:, None]
    shift, freedom = effect / np.sqrt(1 / 7 + 1 / 12), 17
    edge = stats.t.isf(0.025, freedom)
    expected = stats.nct.sf(edge, freedom, shift) + stats.nct.cdf(-edge, freedom, shift)
    assert _powers(space, rows, effect)["f0"].power == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_power_is_the_share_of_simulated_campaigns_that_see_the_effect(seed: int) -> None:
    """Responses with one effect and unit scatter, tested by residual sums of squares: no formula in
    common."""
    rng = np.random.default_rng(seed)
    rows = balance_levels(GUN, 48, rng).treatments
    sizes = [axis.size for axis in GUN.axes]
    model = main_effects(rows, sizes)
    draws, effect = 4000, 1.2
    for index, name in ((0, "plate_material"), (1, "anvil_material+insulator"), (3, "tip_radius")):
        without = main_effects(np.delete(rows, index, axis=1), np.delete(sizes, index).tolist())
        columns = model.shape[1] - without.shape[1]
        residual = len(rows) - model.shape[1]
        edge = stats.f.isf(0.05, columns, residual)
        seen = []
        for a, b in itertools.combinations(range(sizes[index]), 2):
            shift = effect * ((rows[:, index] == a) * 0.5 - (rows[:, index] == b) * 0.5)
            responses = shift[:, None] + rng.standard_normal((len(rows), draws))
            whole, part = (_residual_squares(matrix, responses) for matrix in (model, without))
            seen.append(np.mean((part - whole) / columns / (whole / residual) > edge))
        power = _powers(GUN, rows, effect)[name].power
        assert power == pytest.approx(
            min(seen), abs=4 * np.sqrt(power * (1 - power) / draws) + 0.01
        )


def _residual_squares(
    matrix: NDArray[np.float64], responses: NDArray[np.float64]
) -> NDArray[np.float64]:
    basis, _ = np.linalg.qr(matrix)
    return np.asarray(((responses - basis @ (basis.T @ responses)) ** 2).sum(axis=0))


@given(st.integers(20, 60), st.integers(0, 50))
@settings(max_examples=15, deadline=None)
def test_smallest_effect_is_seen_four_times_of_five_and_more_runs_see_less(
    runs: int, seed: int
) -> None:
    rows = np.random.default_rng(seed).integers(0, [2, 3, 2], (runs, 3))
    space = _space(2, 3, 2)
    for term in main_effect_power(space, rows):
        again = {
            other.term: other for other in main_effect_power(space, rows, term.smallest_effect)
        }[term.term]
        assert again.power == pytest.approx(0.8, abs=1e-4)
        assert again.runs_needed is not None and abs(again.runs_needed - runs) <= 1
        twice = {other.term: other for other in main_effect_power(space, np.tile(rows, (2, 1)))}[
            term.term
        ]
        assert twice.smallest_effect < term.smallest_effect


def test_inflation_is_that_of_a_regression_on_the_others() -> None:
    rng = np.random.default_rng(3)
    space = _space(2, 2, 2, 2)
    rows = (rng.random((30, 4)) + np.array([0, 0, 0.3, 0]) * rng.random((30, 1)) > 0.5).astype(
        np.int64
    )
    rows[:24, 3] = rows[:24, 0]  # two that go together
    terms = main_terms(space, rows)
    columns = np.hstack([term.columns for term in terms])
    for place, factor in enumerate(variance_inflation(terms)):
        others = np.delete(columns, place, axis=1)
        fit = others @ np.linalg.lstsq(others, columns[:, place], rcond=None)[0]
        share = (fit**2).sum() / (columns[:, place] ** 2).sum()
        assert factor == pytest.approx(1 / (1 - share), rel=1e-9)


def test_inflation_and_correlation_do_not_depend_on_names_of_levels() -> None:
    rng = np.random.default_rng(4)
    space = _space(4, 3, 2)
    rows = rng.integers(0, [4, 3, 2], (40, 3))
    renamed = rows.copy()
    renamed[:, 0] = np.array([2, 0, 3, 1])[rows[:, 0]]
    renamed[:, 1] = np.array([1, 2, 0])[rows[:, 1]]
    first, second = (
        [*main_terms(space, part), *interaction_terms(main_terms(space, part))]
        for part in (rows, renamed)
    )
    np.testing.assert_allclose(variance_inflation(first), variance_inflation(second), rtol=1e-9)
    np.testing.assert_allclose(term_correlations(first), term_correlations(second), atol=1e-9)


def test_correlations_of_a_two_level_design_are_its_aliases() -> None:
    rows = fractional_factorial(GUN, resolution=3, categorical="first-last").treatments
    mains = main_terms(GUN, rows)
    terms = [*mains, *interaction_terms(mains)]
    correlations = term_correlations(terms)
    names = [term.name for term in terms]
    strong = {
        frozenset((names[a], names[b]))
        for a, b in itertools.combinations(range(len(terms)), 2)
        if correlations[a, b] > 1e-9
    }
    named = {
        frozenset(_unbracketed(name) for name in (alias.effect, alias.other))
        for alias in aliases(GUN, rows)
    }
    assert strong == named and strong


def _unbracketed(name: str) -> str:
    return name if "*" in name else name.strip("()")


def test_what_the_others_hide_is_infinitely_inflated_and_has_no_power() -> None:
    space = _space(2, 2, 3)
    rows = np.array(
        [[0, 0, 0], [1, 1, 0], [0, 0, 1], [1, 1, 1], [0, 0, 2], [1, 1, 2], [0, 0, 0], [1, 1, 1]]
    )
    powers = _powers(space, rows)
    assert [np.isinf(powers[name].variance_inflation) for name in ("f0", "f1", "f2")] == [
        True,
        True,
        False,
    ]
    assert {term.power for term in powers.values()} == {0.0}
    assert main_effect_power(space, rows[:1]) == []
    with pytest.raises(ValueError, match="effect is 0; expected"):
        main_effect_power(space, rows, 0)
    with pytest.raises(ValueError, match="alpha is 1; expected"):
        main_effect_power(space, rows, 1.0, alpha=1)
