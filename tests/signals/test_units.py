"""Units: what a laboratory writes becomes SI once, and what is not understood is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.app.common.frames import parse_quantity
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.units import SI_UNITS, USUAL_FACTORS, UnitError, registry, to_si


@pytest.mark.parametrize(
    ("quantity", "gains"),
    [
        (
            "acceleration",
            {
                "g": 9.80665,
                "gn": 9.80665,
                "mg": 9.80665e-3,
                "m/s2": 1.0,
                "m/s²": 1.0,
                "m/s^2": 1.0,
                "mm/s2": 1e-3,
            },
        ),
        (
            "acceleration",
            dict.fromkeys(("g's", "g pk", "G"), 9.80665) | {"µg": 9.80665e-6, "Gal": 0.01},
        ),
        (
            "acceleration",
            dict.fromkeys(("ms-2", "m s-2", "m s^-2", "m·s⁻²", "ms⁻²", "m/s/s", "m/sec^2"), 1.0),
        ),
        ("force", {"N": 1.0, "Newtons": 1.0, "kN": 1e3, "lbf": 4.4482216152605}),
        (
            "force",
            {"kg*m/s**2": 1.0, "kg m s^-2": 1.0, "kg*m/s²": 1.0, "m**3*kg/m**2/s**(2)": 1.0},
        ),  # powers of names
        ("pressure", {"bar": 1e5, "psi": 6894.757293168, "MPa": 1e6}),
        ("displacement", {"mm": 1e-3}),
        ("strain", {"um/m": 1e-6, "%": 1e-2}),
        ("voltage", {"mV": 1e-3}),
    ],
)
def test_unit_has_its_factor(quantity, gains):
    assert {unit: to_si(unit, quantity) for unit in gains} == {
        unit: (pytest.approx(gain, rel=1e-9), 0.0) for unit, gain in gains.items()
    }
    assert to_si("degC", "temperature") == (pytest.approx(1.0), pytest.approx(273.15))


def test_unit_of_another_quantity_an_unknown_one_and_endless_powers_are_refused():
    """pint reckons powers of numbers exactly: campaign.toml held an ingest as long as it liked."""
    for unit, quantity in (
        ("kg", "acceleration"),
        ("m", "force"),
        ("s", "pressure"),
        ("V", "force"),
    ):
        with pytest.raises(UnitError, match=f"'{unit}' does not measure {quantity}"):
            to_si(unit, quantity)
    with pytest.raises(UnitError, match=r"'loudness'.*force, acceleration"):
        to_si("N", "loudness")
    powers = (
        "10**100000000",
        "9**9**9**9",
        "N**9**9**9**9",
        "(9)^99999999 N",
        "9²²²²²² N",
        "N**999999999",
        "N" * 2000,
    )
    for unit in powers:
        with pytest.raises(UnitError, match="unit"):
            to_si(unit, "force")


@given(
    st.floats(-1e6, 1e6),
    st.sampled_from([(unit, si) for si, units in USUAL_FACTORS.items() for unit in units]),
    st.sampled_from(sorted(USUAL_FACTORS)),
)
@settings(max_examples=300, deadline=None)
def test_usual_units_convert_as_pint_converts_them(number, usual, other):
    """To the last bit, and none is taken for a unit of another dimension."""
    unit, si_unit = usual
    pint_names = {"g": "gram" if si_unit == "kg" else "standard_gravity"}
    pint_names |= dict.fromkeys(("m/s2", "m/s²", "m/s^2"), "m/s**2") | {"1": "dimensionless"}
    pint_names["Newtons"] = "newton"

    def in_pint(name):
        return registry().Quantity(number, pint_names.get(name, name))

    expected = in_pint(unit).to(pint_names.get(si_unit, si_unit)).magnitude
    assert parse_quantity(f"{number!r} {unit}", si_unit, "size") == expected
    assert USUAL_FACTORS[si_unit][si_unit] == 1
    is_compatible = in_pint(unit).is_compatible_with(pint_names.get(other, other))
    assert (unit in USUAL_FACTORS[other]) == (
        is_compatible or (unit == "g" and other in ("kg", "m/s2"))
    )


@given(st.text(max_size=20), st.sampled_from(sorted(SI_UNITS)))
@settings(max_examples=300)
def test_any_text_is_a_finite_factor_or_refused(unit, quantity):
    try:
        gain, offset = to_si(unit, quantity)
    except UnitError:
        return
    assert isinstance(gain, float)
    assert isinstance(offset, float)


def test_calibration_of_the_thesis_and_recorded_numbers_stay_as_they_are():
    """0.5621 V/bar and 0.3624 V (section 2.2.1): 2 bar read 1.4866 V."""
    sensor = Sensor("pressure", "pressure", "bar", sensitivity=0.5621, offset_v=0.3624)
    channel = Channel(sensor, np.array([0.3624, 0.3624 + 0.5621, 1.4866]), 1e3)
    np.testing.assert_allclose(channel.si, [0, 1e5, 2e5], atol=1e-6)
    recorded = np.array([1, -2, 32767], dtype=np.int16)
    sensor = Sensor("a", "acceleration", "g", range=100.0)
    channel = Channel(sensor, recorded, 1e3)
    np.testing.assert_allclose(channel.si, recorded * 9.80665)
    assert channel.recorded is recorded
    assert channel.recorded.tolist() == [1, -2, 32767]
    assert sensor.range_si == pytest.approx(980.665)
