"""Quantities, spectra and frames of the library: numbers in SI, units that go along, the numbers of
pyYeti."""

from __future__ import annotations

import math
import re

import numpy as np
import pandas as pd
import pint
import pyroshock as ps
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.common.frames import parse_quantity, si, unit_of
from pyroshock.benchmarks.library import frame_figure
from pyroshock.schema.listings import iter_impacts
from support.stores.large_store import fill


@pytest.mark.parametrize(
    "value", [5e5, "5bar", "5 bar", "0,5 MPa", pint.UnitRegistry().Quantity(5, "bar")]
)
def test_one_pressure_given_five_ways(value):
    assert si(value, "Pa", "tank_pressure") == pytest.approx(5e5)


def test_a_gram_of_pint_is_no_gravity_and_another_dimension_is_refused():
    assert si(pint.UnitRegistry().Quantity(500, "g"), "kg", "bullet_mass") == pytest.approx(0.5)
    assert si("10 g", "m/s**2", "acceleration") == pytest.approx(98.0665)
    with pytest.raises(ValueError, match="expected a unit such as 'bar'"):
        si(pint.UnitRegistry().Quantity(5, "kg"), "Pa", "tank_pressure")


@pytest.mark.parametrize("value", ["5", "5 kg", "", "five bar", math.nan, math.inf, "nan bar"])
def test_what_is_no_pressure_is_refused_by_name(value):
    with pytest.raises(ValueError, match="tank_pressure is"):
        si(value, "Pa", "tank_pressure")


@pytest.mark.parametrize(("number", "si_unit", "name", "meant"), [
    ("5", "Pa", "--tank-pressure", "5bar"), ("500", "Pa", "tank_pressure", "500kPa"),
    ("5e5", "Pa", "--tank-pressure", "5e5Pa"), ("114", "Pa", "--youngs-modulus", "114GPa"),
    ("880", "Pa", "--yield-strength", "880MPa"), ("0.5", "kg", "--bullet-mass", "0.5kg"),
    ("0,5", "kg", "--bullet-mass", "0,5kg"), ("500", "kg", "--bullet-mass", "500g"),
    ("45", "m", "--tip-radius", "45mm"),
    ("0.045", "m", "--tip-radius", "0.045m"), ("8", "m/s", "--velocity", "8m/s"),
    ("2", "s", "--separation", "2ms"),
    ("30", "s", "--timeout", "30s"), ("100", "Hz", "--rate", "100kHz"),
    ("51200", "Hz", "--rate", "51200Hz"),
    ("500", "m/s**2", "--range", "500g"), ("4.4", "kg/m^3", "--density", "4.4g/cm3"),
    ("1", "V", "--reading-u", "1V"),
])  # fmt: skip
def test_a_bare_number_is_refused_with_the_quantity_that_was_probably_meant(
    number, si_unit, name, meant
):
    with pytest.raises(
        ValueError, match=f"expected a number with a unit: did you mean {re.escape(meant)}\\?"
    ):
        parse_quantity(number, si_unit, name)
    assert parse_quantity(meant, si_unit, name) > 0  # what is suggested is understood


@pytest.mark.parametrize("value", [None, [1.0, 2.0], object()])
def test_what_is_no_quantity_is_a_type_error(value):
    with pytest.raises(TypeError, match="tank_pressure is"):
        si(value, "Pa", "tank_pressure")


@given(st.floats(-1e9, 1e9))
def test_numbers_pass_unchanged(number):
    assert si(number, "Pa", "x") == number


# --- spectra: arrays, Series and frames in, the same numbers as pyYeti out ---
with np.printoptions():  # parts of pyyeti set the print options of all
    from pyyeti import srs as peer

RATE = 50_000.0


@pytest.fixture(scope="module")
def decaying_wave():
    time = np.arange(2000) / RATE
    return pd.Series(
        1e3 * np.exp(-400 * time) * np.sin(2 * np.pi * 1500 * time),
        index=pd.Index(time, name="time_s"),
        name="a1",
    )


def test_the_same_as_pyyeti(decaying_wave):
    lines = np.geomspace(100, 4000, 12)
    ours = ps.srs(decaying_wave.to_numpy(), RATE, q=10, frequencies=lines)
    theirs = peer.srs(
        decaying_wave.to_numpy(), RATE, lines, 10, ic="zero", peak="abs", stype="absacce"
    )
    np.testing.assert_allclose(ours.to_numpy(), theirs, rtol=0.02)
    assert ours.index.name == "frequency_hz"


def test_a_series_has_its_time_and_unit_and_a_frame_a_column_for_each_record(decaying_wave):
    pd.testing.assert_series_equal(
        ps.srs(decaying_wave),
        ps.srs(decaying_wave.to_numpy(), RATE),
        check_names=False,
        check_index=True,
        rtol=1e-9,
    )
    assert ps.srs(decaying_wave).name == "a1"
    spectra = ps.srs(
        pd.DataFrame({"x": decaying_wave, "y": 2 * decaying_wave}), frequencies="200:3200:3"
    )
    assert list(spectra.columns) == ["x", "y"]
    np.testing.assert_allclose(spectra["y"], 2 * spectra["x"])
    np.testing.assert_allclose(spectra["x"], ps.srs(decaying_wave, frequencies="200:3200:3"))
    with_unit = decaying_wave.copy()
    with_unit.attrs["unit"] = "m/s2"
    assert ps.srs(with_unit).attrs["unit"] == "m/s2"
    assert ps.srs(decaying_wave, damping_ratio=0.05).attrs["q"] == pytest.approx(10)


@pytest.mark.parametrize(("given", "rate", "words"), [
    (np.ones((2, 2, 2)), RATE, "has the shape"),
    (np.arange(10.0), None, "rate is missing"),
    (pd.Series(np.arange(10.0)), None, "only counts the samples"),
    (pd.Series(np.arange(3.0), index=[0.0, 1.0, 5.0]), None, "not even"),
    (pd.Series(np.arange(3.0), index=list("abc")), None, "no time in s"),
    (np.array([1.0, np.nan, 2.0]), RATE, "nan|finite|number"),
])  # fmt: skip
def test_what_cannot_be_used_is_refused(given, rate, words):
    with pytest.raises(ps.InvalidValueError, match=words):
        ps.srs(given, rate)


# --- frames at the size and of the types that an analysis counts on ---
@pytest.fixture(scope="module")
def large_store(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('large') / 'lab.db'}"
    fill(url, 3000)
    with ps.open(url) as store:
        yield store


def test_many_impacts_are_those_of_the_listing_and_absent_figures_are_numbers(large_store):
    frame = large_store.impacts()
    numbers = [name for name in frame.columns if frame.attrs["units"].get(name)]
    assert {"peak_acceleration_m_s2", "peak_force_n", "tip_radius_m"} <= set(numbers)
    assert (
        all(frame[name].dtype == "float64" for name in numbers)
        and frame["peak_acceleration_m_s2"].isna().all()
    )
    frame = large_store.impacts()
    with large_store.store.reading() as session:
        listed = list(iter_impacts(session))
    for name in (
        "id",
        "campaign",
        "tip_material",
        "tip_radius_m",
        "peak_force_n",
        "velocity_kind",
        "quality",
    ):
        assert frame[name].tolist() == [row[name] for row in listed]


def test_what_is_not_there_has_its_columns(large_store):
    frame = large_store.impacts(
        where="peak_force_n > 1e12", columns=["id", "tip_material"], sort="tip_radius_m"
    )
    assert frame.empty and list(frame.columns) == ["id", "tip_material"]
    with pytest.raises(ps.NotFoundError, match="no column 'tip_colour'"):
        large_store.impacts(columns=["tip_colour"])
    frame = large_store.shots(columns=["tank_pressure_pa", "predicted_velocity_m_s"])
    assert frame.empty and frame.attrs["units"]["tank_pressure_pa"] == "Pa"
    assert frame_figure(large_store, 1).value.median > 0


@pytest.mark.parametrize("listing", ["impacts", "shots"])
def test_a_limit_counts_at_least_one_row(large_store, listing):
    with pytest.raises(
        ps.InvalidValueError, match="limit is 0; expected a whole number of 1 or more"
    ):
        getattr(large_store, listing)(limit=0, sort="run")


@pytest.mark.parametrize(("column", "unit"), [
    ("peak_force_n", "N"),
    ("impulse_n_s", "N s"),
    ("velocity_change_m_s", "m/s"),
    ("peak_acceleration_m_s2", "m/s2"),
    ("contact_time_s", "s"),
    ("force_n_lower", "N"),
    ("run", ""),
    ("n", ""),
    ("quality", ""),
])  # fmt: skip
def test_a_column_says_its_unit(column, unit):
    assert unit_of(column) == unit
