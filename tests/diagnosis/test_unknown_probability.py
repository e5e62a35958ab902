"""The probability of unknown grows with the evidence for it, and with what the effects leave where held out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.options import Options
from pyroshock.diagnosis.unknown_probability import UnknownMap

ODDS = st.floats(-200, 200)
FRACTIONS = st.floats(-0.5, 1.0)
LEFT = st.floats(0.0, 100.0)
#: The map that a diagnosis has unless it is given another.
LEARNED = Options().unknown_map
MAPS = pytest.mark.parametrize("probability", [UnknownMap(), LEARNED], ids=["plain", "in use"])


@MAPS
@given(low=ODDS, high=ODDS, fraction=FRACTIONS, left=LEFT)
def test_more_evidence_makes_it_no_less_likely(probability, low, high, fraction, left):
    low, high = sorted((low, high))
    assert probability(low, fraction, left) <= probability(high, fraction, left)


@MAPS
@given(odds=ODDS, low=FRACTIONS, high=FRACTIONS, left=LEFT)
def test_what_effects_predict_makes_it_no_likelier(probability, odds, low, high, left):
    low, high = sorted((low, high))
    assert probability(odds, low, left) >= probability(odds, high, left)


@MAPS
@given(odds=ODDS, fraction=FRACTIONS, low=LEFT, high=LEFT)
def test_more_that_is_left_makes_it_no_less_likely(probability, odds, fraction, low, high):
    low, high = sorted((low, high))
    assert probability(odds, fraction, low) <= probability(odds, fraction, high)


@MAPS
def test_odds_and_fraction_matter(probability):
    assert probability(-20.0, 0.5, 2.0) < probability(20.0, 0.5, 2.0)
    assert probability(0.0, 0.9, 2.0) < probability(0.0, 0.1, 2.0)


@pytest.mark.parametrize(("fraction", "left"), [(None, None), (None, 1.0), (float("nan"), 1.0), (0.5, float("nan"))])
def test_without_figures_held_out_the_odds_alone_decide(fraction, left):
    """Whatever the figures weigh."""
    values = [UnknownMap(0.3, 0.5, weight, weight)(4.0, fraction, left) for weight in (0.0, 5.0, 50.0)]
    assert values == pytest.approx([1 / (1 + np.exp(-0.3 - 0.5 * np.arcsinh(2.0)))] * 3)


def test_logit_is_the_stated_sum():
    p = UnknownMap(0.2, 0.4, 6.0, 1.5)(3.0, 0.8, 2.0)
    assert np.log(p / (1 - p)) == pytest.approx(0.2 + 0.4 * np.arcsinh(1.5) + 6.0 * (0.5 - 0.8) + 1.5 * np.log(2.0))


def test_fraction_that_makes_it_far_worse_weighs_as_half():
    """A gap that is ten times as large is no further from an explanation than one that is half as large again."""
    assert UnknownMap()(0.0, -10.0, 1.0) == UnknownMap()(0.0, -0.5, 1.0)


@MAPS
@given(odds=ODDS, fraction=FRACTIONS, left=LEFT)
def test_where_no_effect_acts_the_fraction_says_nothing(probability, odds, fraction, left):
    assert probability(odds, fraction, left, 1.0) == pytest.approx(probability(odds, 0.5, left))


def test_fraction_counts_as_far_as_an_effect_is_likely():
    p = UnknownMap(0.2, 0.4, 6.0, 1.5)(3.0, 0.8, 2.0, 0.25)
    expected = 0.2 + 0.4 * np.arcsinh(1.5) + 0.75 * 6.0 * (0.5 - 0.8) + 1.5 * np.log(2.0)
    assert np.log(p / (1 - p)) == pytest.approx(expected)
