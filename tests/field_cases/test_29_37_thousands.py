"""Field cases 29 and 37: thousands set apart, in records and in runs.csv. Right: the number, or a
refusal."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.folder.runs_table import read_runs
from pyroshock.ingest.readers import RecordingError, open_recording

CAMPAIGN = Path(__file__).parent / "inputs" / "37-runs-thousands" / "campaign"
SAMPLES = 600
FORCE = np.round(1461 * np.sin(np.pi * np.arange(SAMPLES) / SAMPLES) ** 4)
US, GERMAN = ",.", ".,"


def _cell(value, decimals, signs):
    return f"{value:,.{decimals}f}".translate(str.maketrans(",.", signs))


def _record(signs, decimals=0, delimiter=";", time=""):
    head = (
        f"{time or '# fs = 51200'}\n"
        if not time
        else f"time [{time}]{delimiter}force [N]{delimiter}force_2 [N]\n"
    )
    head += "" if time else f"force [N]{delimiter}force_2 [N]\n"
    rows = []
    for i, value in enumerate(FORCE):
        cells = [
            _cell(value, decimals, signs),
            _cell(value / 2 if decimals else value // 2, decimals, signs),
        ]
        if time:
            cells.insert(
                0, _cell(1e5 * i / 1e4, 0, signs) if time == "us" else _cell(i / 1e5, 5, signs)
            )
        rows.append(delimiter.join(f'"{cell}"' if delimiter == "," else cell for cell in cells))
    return head + "\n".join(rows) + "\n"


RECORDS = {
    "whole numbers": _record(US),
    "tab": _record(US, delimiter="\t"),
    "time in us, apart too": _record(US, delimiter="\t", time="us"),
    "quoted": _record(US, delimiter=","),
    "quoted decimals": _record(US, 2, ",", "s"),
    "German": _record(GERMAN, 2, ";", "s"),
    "German whole numbers": _record(GERMAN, 0, ";", "s"),
    "one column": "# fs = 51200\nforce [N]\n"
    + "".join(_cell(value, 0, US) + "\n" for value in FORCE),
}


@pytest.mark.parametrize("name", RECORDS)
def test_a_record_is_read_right(tmp_path, name):
    path = tmp_path / "hit.txt"
    path.write_text(RECORDS[name])
    with open_recording(path) as recording:
        np.testing.assert_array_equal(recording.read("force"), FORCE)
        assert recording.info("force").sampling_rate_hz == (
            1e5 if "time" in RECORDS[name] else 51200.0
        )


def test_german_thousands_alone_are_refused_with_both_readings(tmp_path):
    """0 to 999 bare and 1.461 can be the print of a program that drops zeros, too."""
    path = tmp_path / "hit.txt"
    path.write_text(_record(GERMAN))
    with pytest.raises(
        RecordingError,
        match=r"'1\.\d{3}' can be .* or .*: its point is a decimal sign or .*; give decimal",
    ):
        open_recording(path)


def test_runs_are_read_right(tmp_path):
    rows = read_runs(CAMPAIGN, "gun", lambda name: name)
    assert [row.number("travel_mm") for row in rows] == [1200.0, 1100.0, 885.0]
    assert [row.number("standoff_mm") for row in rows] == [1500.0, 950.0, 2250.0]
    assert [row.number("bullet_mass") for row in rows] == [0.5, 0.5, 0.5]


@pytest.mark.parametrize("spelling", [r"\1 \2", r"\1'\2", r'"\1,\2.0"', "\\1\u202f\\2", r"\1\2"])
def test_other_spellings_are_read(tmp_path, spelling):
    table = re.sub(r'"(\d),(\d{3})"', spelling, (CAMPAIGN / "runs.csv").read_text())
    assert [row.number("travel_mm") for row in _runs(tmp_path, table)] == [1200.0, 1100.0, 885.0]


def test_a_cell_with_two_readings_is_refused_with_both(tmp_path):
    table = (
        (CAMPAIGN / "runs.csv")
        .read_text()
        .replace(",", ";")
        .replace('"1;', '"1,')
        .replace('"2;', '"2,')
    )
    with pytest.raises(
        IngestError, match=r"runs\.csv: row 2: '1,200' can be 1200 or 1\.2: .*; write 1200 or 1\.2$"
    ):
        _runs(tmp_path, table)
    german = (
        table.replace("0.6", "0,6")
        .replace("0.500", "0,5")
        .replace("17.", "17,")
        .replace("16.", "16,")
    )
    assert _runs(tmp_path, german)[0].number("travel_mm") == 1.2


def _runs(folder, table):
    shutil.copytree(CAMPAIGN, folder / "campaign", dirs_exist_ok=True)
    (folder / "campaign" / "runs.csv").write_text(table, encoding="utf-8")
    return read_runs(folder / "campaign", "gun", lambda name: name)
