"""Field case 16: time as clock, ISO date and time, seconds or nanoseconds since 1970, and minutes.
Right: 100 kHz."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording

RATE_HZ, SAMPLES = 100_000.0, 500
START = dt.datetime(2026, 3, 2, 12, 3, 45, tzinfo=dt.UTC)
VALUES = np.round(387.351 * np.sin(np.arange(SAMPLES) / 9), 4)
MOMENTS = [START + dt.timedelta(microseconds=10 * i) for i in range(SAMPLES)]
MIDNIGHT = [
    dt.datetime(2026, 2, 28, 23, 59, 59, 998_000, dt.UTC) + dt.timedelta(microseconds=10 * i)
    for i in range(SAMPLES)
]


def _text(heading, cells, delimiter=",", decimal="."):
    numbers = (f"{value:.4f}".replace(".", decimal) for value in VALUES)
    return (
        heading
        + "\n"
        + "".join(f"{cell}{delimiter}{n}\n" for cell, n in zip(cells, numbers, strict=True))
    )


def _spelled(form, moments=MOMENTS):
    return [moment.strftime(form) for moment in moments]


FILES = {
    "clock": _text("Time,acceleration_1 (g)", _spelled("%H:%M:%S.%f")),
    "clock over midnight": _text("Time,acceleration_1 (g)", _spelled("%H:%M:%S.%f", MIDNIGHT)),
    "half days": _text("Time,acceleration_1 (g)", _spelled("%I:%M:%S.%f %p", MIDNIGHT)),
    "minutes and seconds": _text("Time,acceleration_1 (g)", _spelled("%M:%S.%f")),
    "ISO, decimal comma": _text(
        "Time;acceleration_1 (g)", _spelled("%Y-%m-%dT%H:%M:%S,%f"), ";", ","
    ),
    "ISO, UTC": _text("Timestamp,acceleration_1 (g)", _spelled("%Y-%m-%dT%H:%M:%S.%fZ", MIDNIGHT)),
    "ISO, offset": _text("Timestamp,acceleration_1 (g)", _spelled("%Y-%m-%d %H:%M:%S.%f+02:00")),
    "German": _text(
        "Zeit;acceleration_1 (g)", _spelled("%d.%m.%Y %H:%M:%S,%f", MIDNIGHT), ";", ","
    ),
    "date and time": _text(
        "Date,Time,acceleration_1 (g)", _spelled("%m/%d/%Y,%H:%M:%S.%f", MIDNIGHT)
    ),
    "blanks": _text("Date Time acceleration_1", _spelled("%Y-%m-%d %H:%M:%S.%f"), " "),
    "epoch": _text(
        "Time (s),acceleration_1 (g)", [f"{1772452800 + i / 1e5:.6f}" for i in range(SAMPLES)]
    ),
    "epoch in ns": _text(
        "time_ns,acceleration_1 (g)", [1772452800000000000 + 10_000 * i for i in range(SAMPLES)]
    ),
    "minutes": _text("Time (min),acceleration_1 (g)", [f"{i / 6e6:.10f}" for i in range(SAMPLES)]),
}


@pytest.mark.parametrize("name", FILES)
def test_the_rate_is_right(tmp_path, name):
    path = tmp_path / "hit.csv"
    path.write_text(FILES[name])
    with open_recording(path) as recording:
        (channel,) = recording.channels
        assert channel.name == "acceleration_1"
        assert channel.sampling_rate_hz == pytest.approx(RATE_HZ, rel=1e-9)
        np.testing.assert_array_equal(recording.read("acceleration_1"), VALUES)
        if "epoch" not in name and name != "minutes":
            assert channel.start_s == 0.0
            assert channel.header["first_sample_at"] in FILES[name].replace(",", " ") + FILES[name]


def test_a_change_to_summer_time_and_a_damaged_clock_are_refused(tmp_path):
    path = tmp_path / "hit.csv"
    path.write_text(FILES["clock"].replace("12:03:45.0025", "13:03:45.0025"))
    with pytest.raises(RecordingError, match=r"time does not increase|uneven|gap|longer"):
        open_recording(path)
    path.write_text(FILES["clock"].replace("12:03:45.002500", "12:03:45.0025s"))
    with pytest.raises(
        RecordingError, match=r"line 251 of the samples has the time '12:03:45.0025s'; expected"
    ):
        open_recording(path)
