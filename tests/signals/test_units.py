"""Units: what a laboratory writes becomes SI once, and what is not understood is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.units import SI_UNITS, UnitError, to_si


@pytest.mark.parametrize(
    ("unit", "quantity", "gain"),
    [
        ("g", "acceleration", 9.80665),
        ("gn", "acceleration", 9.80665),
        ("mg", "acceleration", 9.80665e-3),
        ("m/s2", "acceleration", 1.0),
        ("m/s²", "acceleration", 1.0),
        ("m/s^2", "acceleration", 1.0),
        ("mm/s2", "acceleration", 1e-3),
        ("N", "force", 1.0),
        ("Newtons", "force", 1.0),
        ("kN", "force", 1e3),
        ("lbf", "force", 4.4482216152605),
        ("bar", "pressure", 1e5),
        ("psi", "pressure", 6894.757293168),
        ("MPa", "pressure", 1e6),
        ("mm", "displacement", 1e-3),
        ("um/m", "strain", 1e-6),
        ("%", "strain", 1e-2),
        ("mV", "voltage", 1e-3),
    ],
)
def test_unit_has_its_factor(unit, quantity, gain):
    assert to_si(unit, quantity) == (pytest.approx(gain, rel=1e-9), 0.0)


def test_celsius_has_an_offset():
    gain, offset = to_si("degC", "temperature")
    assert (gain, offset) == (pytest.approx(1.0), pytest.approx(273.15))


@pytest.mark.parametrize(
    ("unit", "quantity"), [("kg", "acceleration"), ("m", "force"), ("s", "pressure"), ("V", "force")]
)
def test_unit_of_another_quantity_is_refused(unit, quantity):
    with pytest.raises(UnitError, match=f"'{unit}' does not measure {quantity}"):
        to_si(unit, quantity)


@given(st.text(max_size=20), st.sampled_from(sorted(SI_UNITS)))
@settings(max_examples=300)
def test_any_text_is_a_finite_factor_or_refused(unit, quantity):
    try:
        gain, offset = to_si(unit, quantity)
    except UnitError:
        return
    assert isinstance(gain, float)
    assert isinstance(offset, float)


def test_unknown_quantity_lists_the_known():
    with pytest.raises(UnitError, match=r"'loudness'.*force, acceleration"):
        to_si("N", "loudness")


def test_transducer_calibration_of_the_thesis():
    """0.5621 V/bar and 0.3624 V (section 2.2.1): 2 bar read 1.4866 V."""
    sensor = Sensor("pressure", "pressure", "bar", sensitivity=0.5621, offset_v=0.3624)
    channel = Channel(sensor, np.array([0.3624, 0.3624 + 0.5621, 1.4866]), 1e3)
    np.testing.assert_allclose(channel.si, [0, 1e5, 2e5], atol=1e-6)


def test_recorded_numbers_stay_as_they_are():
    recorded = np.array([1, -2, 32767], dtype=np.int16)
    channel = Channel(Sensor("a", "acceleration", "g"), recorded, 1e3)
    np.testing.assert_allclose(channel.si, recorded * 9.80665)
    assert channel.recorded is recorded
    assert channel.recorded.tolist() == [1, -2, 32767]


def test_range_is_converted_without_the_sensors_offset():
    assert Sensor("a", "acceleration", "g", range=100.0).range_si == pytest.approx(980.665)


@pytest.mark.parametrize(
    "unit", ["10**100000000", "9**9**9**9", "N**9**9**9**9", "(9)^99999999 N", "9²²²²²² N", "N**999999999", "N" * 2000]
)
def test_unit_that_takes_for_ever_to_reckon_is_refused(unit):
    """pint reckons powers of numbers exactly: campaign.toml held an ingest as long as it liked."""
    with pytest.raises(UnitError, match="unit"):
        to_si(unit, "force")


@pytest.mark.parametrize(
    ("unit", "gain"), [("kg*m/s**2", 1.0), ("kg m s^-2", 1.0), ("kg*m/s²", 1.0), ("m**3*kg/m**2/s**(2)", 1.0)]
)
def test_powers_of_names_are_read(unit, gain):
    assert to_si(unit, "force") == (gain, 0.0)
