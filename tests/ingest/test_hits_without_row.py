"""Every hit that a recording shows is stored, or told with its time and its peak."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from pyroshock.ingest.pulses import find_hits
from support.records.campaigns import (
    FS_HZ,
    Blow,
    force_record,
    hammer_campaign,
    hammer_rows,
    recording_name,
    write_recording,
    write_runs,
)
from support.stores.stores import pyroshock

#: Three hits of known time, peak and width.
THREE = (Blow(0.05, 1000.0, 0.8e-3), Blow(0.2, 1500.0, 0.8e-3), Blow(0.35, 900.0, 0.8e-3))


def report_of(folder, url, made, rows):
    write_runs(folder, rows)
    write_recording(folder / recording_name(1), {"force": force_record(made, np.random.default_rng(3))})
    result = pyroshock("ingest", folder, "--db", url, "--jobs", "1", "--json")
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout), result.stderr


def told_hits(finding):
    """(time in s, peak in N) of each hit that a message names."""
    found = re.findall(r"([\d.]+) N at ([\d.]+) s", finding["message"])
    return [(pytest.approx(float(time), abs=1e-3), pytest.approx(float(peak), rel=0.01)) for peak, time in found]


def left_out(report):
    return [f for f in report["findings"] if f["check"] == "hit-without-row"]


def test_third_hit_of_two_rows_is_told(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", 1)
    report, told = report_of(folder, sqlite_url, THREE, hammer_rows(1, 2))
    assert report["impacts"] == 2
    (finding,) = left_out(report)
    assert finding["recording"] == recording_name(1)
    assert finding["severity"] == "warning"  # 900 N beside 1000 N: which is whose is a guess
    assert "3 hits" in finding["message"]
    assert "2 rows" in finding["message"]
    assert told_hits(finding) == [(0.3504, 900.0)]
    assert "warning: hit-without-row (1)" in told


def test_hits_beside_the_one_of_a_reported_velocity_are_told(sqlite_url, tmp_path):
    """A velocity belongs to one hit, so that the row cannot count on."""
    folder = hammer_campaign(tmp_path / "c", 1)
    rows = [{**hammer_rows(1, 1)[0], "impact_velocity_m_s": 1.0}]
    report, _ = report_of(folder, sqlite_url, THREE, rows)
    assert report["impacts"] == 1
    (finding,) = left_out(report)
    assert told_hits(finding) == [(0.0504, 1000.0), (0.3504, 900.0)]


def test_small_hit_is_a_note(sqlite_url, tmp_path):
    """A touch far below the hits that have rows is worth knowing, and casts no doubt on them."""
    folder = hammer_campaign(tmp_path / "c", 1)
    made = (THREE[0], THREE[1], Blow(0.35, 200.0, 0.8e-3))
    report, _ = report_of(folder, sqlite_url, made, hammer_rows(1, 2))
    assert [f["severity"] for f in left_out(report)] == ["note"]


@pytest.mark.parametrize("hits", [1, 3])
def test_as_many_rows_as_hits_have_nothing_to_tell(sqlite_url, tmp_path, hits):
    folder = hammer_campaign(tmp_path / "c", 1)
    report, _ = report_of(folder, sqlite_url, THREE[:hits], hammer_rows(1, hits))
    assert report["impacts"] == hits
    assert left_out(report) == []


def test_touch_before_the_hit_is_told(sqlite_url, tmp_path):
    """Within a tenth of a second two contacts are one impact; the smaller one is told also where it came first."""
    folder = hammer_campaign(tmp_path / "c", 1)
    early, hit = Blow(0.05, 500.0, 0.8e-3), Blow(0.09, 1000.0, 0.8e-3)
    report, _ = report_of(folder, sqlite_url, (early, hit), hammer_rows(1, 1))
    assert report["impacts"] == 1
    (finding,) = [f for f in report["findings"] if f["check"] == "double-hit"]
    assert told_hits(finding) == [(0.0504, 500.0)]
    assert "before" in finding["message"]


def test_ringing_before_the_hit_is_no_touch():
    """A band-limited impulse rings before its peak (sin x / x: 12.8 % upwards, 21.7 % downwards)."""
    time = np.arange(-2000, 2000)
    (pulse,) = find_hits(1000.0 * np.sinc(time / 4.0), FS_HZ).pulses
    assert pulse.peak_force_n == pytest.approx(1000.0)
    assert pulse.earlier_touches == ()
