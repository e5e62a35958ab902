"""Arguments of `ps.srs` (field case 43): units of an index, masks, records as rows, rates as
texts."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest

RATE_HZ = 20_000.0
TIMES_S = np.arange(4000) / RATE_HZ
RECORD = 1000.0 * np.exp(-200.0 * TIMES_S) * np.sin(2 * np.pi * 900.0 * TIMES_S)
LINES = [500.0, 1000.0, 2000.0]
RIGHT = ps.srs(RECORD, RATE_HZ, frequencies=LINES).to_numpy()


@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("time_ms", 1e3),
        ("t [us]", 1e6),
        ("Zeit (ms)", 1e3),
        ("time_s", 1.0),
        ("time", 1.0),
        (None, 1.0),
        ("t_ns", 1e9),
    ],
)
def test_the_name_of_an_index_carries_its_unit(name, scale):
    series = pd.Series(RECORD, index=pd.Index(TIMES_S * scale, name=name))
    np.testing.assert_allclose(ps.srs(series, frequencies=LINES), RIGHT, rtol=1e-6)


def test_an_index_that_is_no_time_is_refused():
    series = pd.Series(RECORD, index=pd.Index(TIMES_S * 10.0, name="distance_mm"))
    with pytest.raises(
        ps.InvalidValueError, match="the index is called 'distance_mm', which is no time"
    ):
        ps.srs(series, frequencies=LINES)
    np.testing.assert_allclose(ps.srs(series, RATE_HZ, frequencies=LINES), RIGHT)


def test_masked_samples_are_refused():
    masked = np.ma.masked_array(RECORD, np.arange(4000) == 7)
    with pytest.raises(ps.InvalidValueError, match=r"1 samples are masked.*fill them"):
        ps.srs(masked, RATE_HZ, frequencies=LINES)
    whole = np.ma.masked_array(RECORD, np.zeros(4000, bool))
    np.testing.assert_allclose(ps.srs(whole, RATE_HZ, frequencies=LINES), RIGHT)


def test_records_as_rows_are_refused_with_the_cure():
    with pytest.raises(
        ps.InvalidValueError, match=r"shape \(3, 4000\), more records than samples.*acceleration.T"
    ):
        ps.srs(np.tile(RECORD, (3, 1)), RATE_HZ, frequencies=LINES)
    assert ps.srs(np.tile(RECORD, (3, 1)).T, RATE_HZ, frequencies=LINES).shape == (3, 3)


@pytest.mark.parametrize("rate", ["20 kHz", "20kHz", "20000", "20000 Hz", 20_000])
def test_a_rate_may_be_a_text_with_its_unit(rate):
    np.testing.assert_allclose(ps.srs(RECORD, rate, frequencies=LINES), RIGHT)


@pytest.mark.parametrize("rate", ["20 mm", "fast", 0.0, -1.0, "nan"])
def test_what_is_no_rate_is_refused(rate):
    with pytest.raises(ps.InvalidValueError, match="rate"):
        ps.srs(RECORD, rate, frequencies=LINES)
