"""Clock and calendar times as the first column of a recording."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from pyroshock.ingest.readers.clock_times import elapsed_seconds, is_clock_text


def _moments(start, step_us, count, form):
    moments = [start + dt.timedelta(microseconds=step_us * i) for i in range(count)]
    return [moment.strftime(form) for moment in moments]


@pytest.mark.parametrize(
    "form",
    [
        "%H:%M:%S.%f",
        "%H:%M:%S,%f",
        "%Y-%m-%dT%H:%M:%S.%fZ",
        "%Y-%m-%d %H:%M:%S.%f+02:00",
        "%Y/%m/%d %H:%M:%S.%f",
        "%d.%m.%Y %H:%M:%S,%f",
        "%m/%d/%Y %I:%M:%S.%f %p",
        "%M:%S.%f",
    ],
)
def test_every_spelling_gives_the_same_seconds(form):
    cells = _moments(dt.datetime(2024, 5, 1, 12, 3, 59, 999_950, tzinfo=dt.UTC), 10, 12, form)
    assert all(map(is_clock_text, cells))
    np.testing.assert_array_equal(elapsed_seconds(cells), [float(i) / 100_000 for i in range(12)])


@pytest.mark.parametrize(
    "form", ["%H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%f", "%d/%m/%Y %H:%M:%S.%f", "%m/%d/%Y %H:%M:%S.%f"]
)
def test_midnight_is_passed(form):
    cells = _moments(dt.datetime(2024, 5, 12, 23, 59, 59, 999_950, tzinfo=dt.UTC), 10, 12, form)
    np.testing.assert_allclose(np.diff(elapsed_seconds(cells)), 1e-5, rtol=1e-9)


def test_a_date_may_stand_in_a_column_of_its_own():
    clocks = ["23:59:59.9", "00:00:00.0", "00:00:00.1"]
    for dates in (
        ["2024-02-28", "2024-02-29", "2024-02-29"],
        ["31.01.2024", "01.02.2024", "01.02.2024"],
    ):
        np.testing.assert_allclose(elapsed_seconds(clocks, dates), [0, 0.1, 0.2], rtol=1e-9)


def test_offsets_from_utc_are_taken_off():
    cells = ["2024-03-31T01:59:59.5+01:00", "2024-03-31T03:00:00.0+02:00"]
    assert elapsed_seconds(cells).tolist() == [0.0, 0.5]
    assert elapsed_seconds([cell[:-6] for cell in cells]).tolist() == [0.0, 3600.5]


@pytest.mark.parametrize(
    "text", ["force", "1.5", "12", "2.5-3", "1:2", "12:03:45.1x", "192.168.1.1", ""]
)
def test_other_text_is_no_clock(text):
    assert not is_clock_text(text)


def test_what_is_no_time_or_has_two_meanings_is_named():
    with pytest.raises(
        ValueError, match=r"^line 2 of the samples has the time 'late'; expected one such as '12"
    ):
        elapsed_seconds(["12:00:00", "late"])
    with pytest.raises(ValueError, match=r"'12:75:00' is no time of day"):
        elapsed_seconds(["12:75:00"])
    with pytest.raises(
        ValueError, match=r"dates from 01/02/2024 to 03/02/2024 can be read in two ways"
    ):
        elapsed_seconds(["12:00:00", "12:00:00"], ["01/02/2024", "03/02/2024"])
