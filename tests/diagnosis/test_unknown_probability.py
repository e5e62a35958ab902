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
#: The map that a diagnosis has unless it is given another.
LEARNED = Options().unknown_map
MAPS = pytest.mark.parametrize("probability", [UnknownMap(), LEARNED], ids=["plain", "in use"])


@MAPS
@given(low=ODDS, high=ODDS, fraction=FRACTIONS)
def test_more_evidence_makes_it_no_less_likely(probability, low, high, fraction):
    low, high = sorted((low, high))
    assert probability(low, fraction) <= probability(high, fraction)


@MAPS
@given(odds=ODDS, low=FRACTIONS, high=FRACTIONS)
def test_what_effects_predict_makes_it_no_likelier(probability, odds, low, high):
    low, high = sorted((low, high))
    assert probability(odds, low) >= probability(odds, high)


@MAPS
def test_both_arguments_matter(probability):
    assert probability(-20.0, 0.5) < probability(20.0, 0.5)
    assert probability(0.0, 0.9) < probability(0.0, 0.1)


@pytest.mark.parametrize("fraction", [None, float("nan")])
def test_without_a_fraction_the_odds_alone_decide(fraction):
    """Whatever a fraction weighs."""
    values = [UnknownMap(0.3, 0.5, weight)(4.0, fraction) for weight in (0.0, 5.0, 50.0)]
    assert values == pytest.approx([1 / (1 + np.exp(-0.3 - 0.5 * np.arcsinh(2.0)))] * 3)


def test_logit_is_the_stated_sum():
    p = UnknownMap(0.2, 0.4, 6.0)(3.0, 0.8)
    assert np.log(p / (1 - p)) == pytest.approx(0.2 + 0.4 * np.arcsinh(1.5) + 6.0 * (0.5 - 0.8))


def test_fraction_that_makes_it_far_worse_weighs_as_half():
    """A gap that is ten times as large is no further from an explanation than one that is half as large again."""
    assert UnknownMap()(0.0, -10.0) == UnknownMap()(0.0, -0.5)
