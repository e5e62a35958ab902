"""`pyroshock.srs`: arrays, Series and DataFrames in; the same numbers as pyYeti out."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest

with np.printoptions():  # parts of pyyeti set the print options of all
    from pyyeti import srs as peer

RATE = 50_000.0


@pytest.fixture(scope="module")
def record():
    time = np.arange(2000) / RATE
    return pd.Series(
        1e3 * np.exp(-400 * time) * np.sin(2 * np.pi * 1500 * time), index=pd.Index(time, name="time_s"), name="a1"
    )


def test_the_same_as_pyyeti(record):
    lines = np.geomspace(100, 4000, 12)
    ours = ps.srs(record.to_numpy(), RATE, q=10, frequencies=lines)
    theirs = peer.srs(record.to_numpy(), RATE, lines, 10, ic="zero", peak="abs", stype="absacce")
    np.testing.assert_allclose(ours.to_numpy(), theirs, rtol=0.02)
    assert ours.index.name == "frequency_hz"


def test_a_series_has_its_time_and_unit_and_a_frame_a_column_for_each_record(record):
    pd.testing.assert_series_equal(
        ps.srs(record), ps.srs(record.to_numpy(), RATE), check_names=False, check_index=True, rtol=1e-9
    )
    assert ps.srs(record).name == "a1"
    frame = pd.DataFrame({"x": record, "y": 2 * record})
    spectra = ps.srs(frame, frequencies="200:3200:3")
    assert list(spectra.columns) == ["x", "y"]
    np.testing.assert_allclose(spectra["y"], 2 * spectra["x"])
    np.testing.assert_allclose(spectra["x"], ps.srs(record, frequencies="200:3200:3"))
    with_unit = record.copy()
    with_unit.attrs["unit"] = "m/s2"
    assert ps.srs(with_unit).attrs["unit"] == "m/s2"
    assert ps.srs(record, damping_ratio=0.05).attrs["q"] == pytest.approx(10)


@pytest.mark.parametrize(
    ("given", "rate", "words"),
    [
        (np.ones((2, 2, 2)), RATE, "has the shape"),
        (np.arange(10.0), None, "rate is missing"),
        (pd.Series(np.arange(10.0)), None, "only counts the samples"),
        (pd.Series(np.arange(3.0), index=[0.0, 1.0, 5.0]), None, "not even"),
        (pd.Series(np.arange(3.0), index=list("abc")), None, "no time in s"),
        (np.array([1.0, np.nan, 2.0]), RATE, "nan|finite|number"),
    ],
)
def test_what_cannot_be_used_is_refused(given, rate, words):
    with pytest.raises(ps.InvalidValueError, match=words):
        ps.srs(given, rate)
