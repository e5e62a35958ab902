"""The converter writes whole counts times a step, and nothing beyond its range."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.virtualbench.sensors.build import SensorBuild
from pyroshock.virtualbench.sensors.chain import calibrated, converted, counts, written

FORCE = SensorBuild("force", "force", "N", 1000.0, bits=16)
TANK = SensorBuild("tank", "pressure", "bar", 16.0, 1e5, bits=16, sensitivity=0.5621, offset_v=0.3624)


@given(st.integers(-(2**15), 2**15 - 1), st.floats(-0.49, 0.49))
def test_value_within_half_a_step_is_its_count(count, within):
    assert counts(np.array([(count + within) * FORCE.step]), FORCE)[0] == count


@given(st.sampled_from([8, 16, 24]), st.floats(1e-3, 1e6), st.data())
def test_written_numbers_are_their_counts_again(bits, full_scale, data):
    """A float32 holds 24 bits: no two counts fall together."""
    sensor = SensorBuild("s", "force", "N", full_scale, bits=bits)
    code = data.draw(st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
    assert round(float(converted(np.array([code * sensor.step]), sensor)[0]) / sensor.step) == code


def test_value_beyond_the_range_is_clipped_zero_has_no_sign_and_nan_no_code():
    codes = counts(np.array([-1e9, -1000.0, 999.99, 1000.0, np.inf]), FORCE)
    assert codes.tolist() == [-32768, -32768, 32767, 32767, 32767]
    values = converted(np.array([-1e-9, -0.0, 0.0]), FORCE)
    assert values.dtype == np.float32
    assert not np.signbit(values).any()
    with pytest.raises(ValueError, match="sample 1 is NaN"):
        counts(np.array([0.0, np.nan]), FORCE)


def test_pressure_is_written_in_the_volts_of_the_calibration():
    """Thesis, section 2.2.1: 0.5621 V/bar and 0.3624 V at rest."""
    volts = written(np.array([0.0, 4e5]), TANK)
    assert volts == pytest.approx([0.3624, 0.3624 + 4 * 0.5621])
    assert calibrated(volts, TANK) == pytest.approx([0.0, 4e5], abs=1e-6)
    assert TANK.step == 10 / 2**15


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"full_scale": 0.0}, "full_scale is 0.0"),
        ({"bits": 25}, "bits is 25; expected 2 to 24"),
        ({"noise": -1.0}, "noise is -1.0"),
        ({"sensitivity": 0.0}, "sensitivity is 0"),
    ],
)
def test_instrument_that_cannot_be_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        SensorBuild(**{"name": "s", "quantity": "force", "unit": "N", "full_scale": 1.0, **change})
