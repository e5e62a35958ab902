"""Columns that are time: by what laboratories and instruments call it."""

from __future__ import annotations

import pytest
from pyroshock.ingest.readers.contents import is_time_name, name_and_unit, time_scale

TIMES = {
    "t": 1.0,
    "Time": 1.0,
    "time_s": 1.0,
    "t_ms": 1e-3,
    "Zeit": 1.0,
    "Zeit [ms]": 1e-3,
    "Zeit in ms": 1e-3,
    "Zeit/ms": 1e-3,
    "Zeitachse [s]": 1.0,
    "Temps": 1.0,
    "Temps (ms)": 1e-3,
    "temps, s": 1.0,
    "Tiempo (us)": 1e-6,
    "Tempo (s)": 1.0,
    "Tijd [s]": 1.0,
    "Czas [ms]": 1e-3,
    "Время [мс]": 1e-3,
    "Time [days]": None,  # a unit that is not read is asked for, never taken as seconds
    "时间": 1.0,
    "時間 (ms)": 1e-3,
    "시간 [us]": 1e-6,
    "(ms)": 1e-3,
    "[s]": 1.0,
    "ms": 1e-3,
    "seconds": 1.0,
    "t [ms]": 1e-3,
    "Time (min)": 60.0,
    "Time (h)": 3600.0,
    "X_Value": 1.0,
    "Elapsed Time": 1.0,
    "Elapsed  time (s)": 1.0,
    "Rel. Zeit [s]": 1.0,
    "timestamp": 1.0,
    "Time Stamp [ns]": 1e-9,
}


@pytest.mark.parametrize("label", TIMES)
def test_time_in_any_language(label):
    name, unit = name_and_unit(label)
    assert is_time_name(name)
    assert time_scale(name, unit) == TIMES[label]


CHANNELS = (
    "force", "temperature", "Temp", "trigger", "a_ms2", "Kraft [N]", "rise time", "contact_time",
    "acc (top)", "s", "m",
    "Timer", "min force", "Zeitung", "h [mm]", "count", "tide",
)  # fmt: skip


@pytest.mark.parametrize("label", CHANNELS)
def test_channels_are_no_time(label):
    assert not is_time_name(name_and_unit(label)[0])
