"""What a valve's profile may say, in a text and in a file."""

from __future__ import annotations

import pytest
from pyroshock.signals.valve_profile import ValveProfile

CLOSING = ValveProfile.parse("0:0,0.1:1,0.12:1,0.16:0")


def test_text_file_and_controller_times_become_points(tmp_path) -> None:
    assert str(CLOSING) == "0:0 0.1:1 0.12:1 0.16:0"
    assert ValveProfile.parse(str(CLOSING)) == CLOSING
    path = tmp_path / "profile.csv"
    path.write_text("time_s,valve_position\n0,0\n0.1,1\n0.12,1\n0.16,0\n", encoding="utf-8")
    assert ValveProfile.read(path) == CLOSING
    assert ValveProfile.of_controller(0.2, 0.5, 0.3) == ValveProfile(
        (0.0, 0.2, 0.5, 0.8), (0.0, 1.0, 1.0, 0.0)
    )
    assert ValveProfile.of_controller(0.2, 0.1, 0.4) == ValveProfile(
        (0.0, 0.1, 0.1 + 0.2), (0.0, 0.5, 0.0)
    )


def test_profiles_that_no_valve_has_are_refused(tmp_path) -> None:
    for text, words in {
        "0:0,0.1": "point '0.1'; expected TIME:POSITION",
        "0:0,0.1:2": "position 2.0 at 0.1 s; expected 0",
        "0.1:0,0.1:1": "0.1 s after 0.1 s; expected times that rise",
        "-1:0": "time -1.0 s; expected 0 or more",
        "": "point ''; expected TIME:POSITION",
    }.items():
        with pytest.raises(ValueError, match=words):
            ValveProfile.parse(text)
    path = tmp_path / "profile.csv"
    for content, words in {
        "time,position\n0,0\n": "columns",
        "time_s,valve_position\n0,shut\n": "line 2",
        "time_s,valve_position\n": "no rows",
    }.items():
        path.write_text(content, encoding="utf-8")
        with pytest.raises(ValueError, match=words):
            ValveProfile.read(path)
    with pytest.raises(ValueError, match="cannot be read"):
        ValveProfile.read(tmp_path / "none.csv")
