"""Quantities of the library: numbers in SI, text with a unit, pint's quantities of any registry."""

from __future__ import annotations

import math

import pint
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.common.frames import si


@pytest.mark.parametrize("value", [5e5, "5bar", "5 bar", "0,5 MPa", pint.UnitRegistry().Quantity(5, "bar")])
def test_one_pressure_given_five_ways(value):
    assert si(value, "Pa", "tank_pressure") == pytest.approx(5e5)


def test_a_gram_of_pint_is_no_gravity_and_another_dimension_is_refused():
    assert si(pint.UnitRegistry().Quantity(500, "g"), "kg", "bullet_mass") == pytest.approx(0.5)
    assert si("10 g", "m/s**2", "acceleration") == pytest.approx(98.0665)
    with pytest.raises(ValueError, match="expected a unit such as 'Pa'"):
        si(pint.UnitRegistry().Quantity(5, "kg"), "Pa", "tank_pressure")


@pytest.mark.parametrize("value", ["5", "5 kg", "", "five bar", math.nan, math.inf, "nan bar"])
def test_what_is_no_pressure_is_refused_by_name(value):
    with pytest.raises(ValueError, match="tank_pressure is"):
        si(value, "Pa", "tank_pressure")


@pytest.mark.parametrize("value", [None, [1.0, 2.0], object()])
def test_what_is_no_quantity_is_a_type_error(value):
    with pytest.raises(TypeError, match="tank_pressure is"):
        si(value, "Pa", "tank_pressure")


@given(st.floats(-1e9, 1e9))
def test_numbers_pass_unchanged(number):
    assert si(number, "Pa", "x") == number
