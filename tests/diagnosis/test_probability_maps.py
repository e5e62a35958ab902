"""Probabilities learned from campaigns: of unknown and of the first entry, by evidence and by what
is predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.options import Options, UnknownFigures, UnknownMap, first_entry_probability

from benchmarks.diagnosis_maps import likeliest

ODDS = st.floats(-200, 200)
FRACTIONS = st.floats(-0.5, 1.0)
LEFT = st.floats(0.0, 100.0)
PAIRS_OF_ODDS, PAIRS_OF_FRACTIONS = (
    st.tuples(values, values).map(sorted) for values in (ODDS, FRACTIONS)
)
#: The map that a diagnosis has unless it is given another.
LEARNED = Options().unknown_map
MAPS = pytest.mark.parametrize("probability", [UnknownMap(), LEARNED], ids=["plain", "in use"])


@MAPS
@given(odds=PAIRS_OF_ODDS, fractions=PAIRS_OF_FRACTIONS, left=st.tuples(LEFT, LEFT).map(sorted))
def test_evidence_and_what_is_left_make_it_no_less_likely_and_predictions_no_likelier(
    probability, odds, fractions, left
):
    figures = UnknownFigures(odds[0], fractions[0], left[0])
    assert probability(figures) <= probability(replace(figures, log_odds=odds[1]))
    assert probability(figures) >= probability(replace(figures, fraction=fractions[1]))
    assert probability(figures) <= probability(replace(figures, remaining_gap=left[1]))


@MAPS
@given(
    odds=ODDS,
    fraction=FRACTIONS,
    sizes=st.tuples(st.floats(0, 1), st.floats(0, 1)).map(sorted),
    beside=PAIRS_OF_ODDS,
)
def test_wrong_laws_and_what_is_unexplained_beside_the_likeliest_effects_make_it_no_less_likely(
    probability, odds, fraction, sizes, beside
):
    figures = UnknownFigures(odds, fraction, 1.0, discrepancy=sizes[0], beside=beside[0])
    assert probability(figures) <= probability(replace(figures, discrepancy=sizes[1]))
    assert probability(figures) <= probability(replace(figures, beside=beside[1]))


@MAPS
def test_odds_and_fraction_matter(probability):
    assert probability(UnknownFigures(-20.0, 0.5, 2.0)) < probability(
        UnknownFigures(20.0, 0.5, 2.0)
    )
    assert probability(UnknownFigures(0.0, 0.9, 2.0)) < probability(UnknownFigures(0.0, 0.1, 2.0))


@pytest.mark.parametrize(
    ("fraction", "left"), [(None, None), (None, 1.0), (float("nan"), 1.0), (0.5, float("nan"))]
)
def test_without_figures_held_out_the_odds_alone_decide(fraction, left):
    """Whatever the figures weigh."""
    figures = UnknownFigures(4.0, fraction, left)
    probabilities = [UnknownMap(0.3, 0.5, weight, weight)(figures) for weight in (0.0, 5.0, 50.0)]
    assert probabilities == pytest.approx([1 / (1 + np.exp(-0.3 - 0.5 * np.arcsinh(2.0)))] * 3)


def test_logit_is_the_stated_sum():
    weights = UnknownMap(0.2, 0.4, 6.0, 0.5, 0.7, 0.3)
    p = weights(UnknownFigures(3.0, 0.6, 2.0))
    assert np.log(p / (1 - p)) == pytest.approx(
        0.2 + 0.4 * np.arcsinh(1.5) + 6.0 * (0.5 - 0.6) + 0.5 * np.log(2.0)
    )
    p = weights(UnknownFigures(3.0, 0.6, 2.0, 0.25, discrepancy=0.4, beside=5.0))
    assert np.log(p / (1 - p)) == pytest.approx(
        0.2
        + 0.4 * np.arcsinh(1.5)
        + 0.75 * 6.0 * (0.5 - 0.6)
        + 0.5 * np.log(2.0)
        + 0.7 * 0.4
        + 0.3 * np.arcsinh(2.5)
    )
    # A gap that is ten times as large is no further from an explanation than one that is half as
    # large again.
    assert UnknownMap()(UnknownFigures(0.0, -10.0, 1.0)) == UnknownMap()(
        UnknownFigures(0.0, -0.5, 1.0)
    )


@MAPS
@given(odds=ODDS, fraction=FRACTIONS, left=LEFT, none=st.floats(0.0, 0.5))
def test_campaign_that_is_explained_where_it_was_not_fitted_is_not_unknown(
    probability, odds, fraction, left, none
):
    """At most twice what is left: of a campaign explained to .95, .10."""
    assert probability(UnknownFigures(odds, fraction, left)) <= 2 * (1 - fraction) + 1e-12
    assert (
        probability(UnknownFigures(200.0, 0.95, 100.0, discrepancy=1.0, beside=100.0))
        <= 0.1 + 1e-12
    )
    # Where no effect may act, the fraction says as much less.
    assert (
        probability(UnknownFigures(odds, fraction, left, none))
        <= none + 2 * (1 - none) * (1 - fraction) + 1e-12
    )


@MAPS
@given(odds=ODDS, fraction=FRACTIONS, left=LEFT)
def test_where_no_effect_acts_the_fraction_says_nothing(probability, odds, fraction, left):
    figures = UnknownFigures(odds, fraction, left, none=1.0)
    assert probability(figures) == pytest.approx(probability(UnknownFigures(odds, 0.5, left)))


ONE, TWO = ("gun.blow_by",), ("gun.blow_by", "gun.valve_flow")


@given(fractions=PAIRS_OF_FRACTIONS)
def test_first_entry_is_likelier_with_predictions_and_less_so_with_several_effects(fractions):
    least = first_entry_probability(ONE, fractions[0])
    assert 0 < least <= first_entry_probability(ONE, fractions[1]) < 1
    assert first_entry_probability(TWO, fractions[0]) < least


@pytest.mark.parametrize("fraction", [-0.5, 0.3, 1.0])
def test_no_effect_predicts_nothing_so_that_the_fraction_says_nothing_of_it(fraction):
    assert first_entry_probability((), fraction) == first_entry_probability((), None)


def test_likeliest_weights_are_those_that_drew_the_answers():
    # Truth: a logit of known weights, and 20,000 answers drawn from it; a prior so wide that it
    # says nothing.
    rng = np.random.default_rng(1)
    weights = np.array([0.5, -1.2])
    x = np.column_stack([np.ones(20_000), rng.standard_normal(20_000)])
    y = (rng.random(20_000) < 1 / (1 + np.exp(-x @ weights))).astype(float)
    assert likeliest(x, y, np.zeros(2), np.full(2, 100.0)) == pytest.approx(weights, abs=0.06)
    rng = np.random.default_rng(2)
    x, y = rng.standard_normal((50, 2)), (rng.random(50) < 0.5).astype(float)
    counts = rng.integers(1, 4, 50)
    prior = np.zeros(2), np.ones(2)
    repeated = likeliest(np.repeat(x, counts, axis=0), np.repeat(y, counts), *prior)
    assert likeliest(x, y, *prior, counts) == pytest.approx(repeated)
