"""A recording in any notation of numbers is read exactly or refused, never as other numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from support.records.written_numbers import tables, text_of

NAMES = ["force [N]", "acc [g]", "acc_2 [g]"]


@settings(max_examples=400, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tables())
def test_a_table_is_read_exactly_or_refused(tmp_path, drawn):
    table, notation, delimiter = drawn
    path = tmp_path / "shot.csv"
    path.write_text(
        "# fs = 51200\n" + text_of(table, notation, delimiter, NAMES[: len(table)]),
        encoding="utf-8",
    )
    for decimal in (None, notation[0]):
        try:
            with open_recording(path, ReadingOptions(decimal=decimal)) as recording:
                for channel, column in zip(recording.channels, table, strict=True):
                    np.testing.assert_array_equal(recording.read(channel.name), column.values)
        except RecordingError as error:
            assert decimal is None, error  # the laboratory's word settles every table


@pytest.mark.parametrize(
    ("lines", "values"),
    [
        ("force [N];acc [g]\n0;0\n999;5\n1,000;7\n1,461;3\n", [0, 999, 1000, 1461]),
        ("force [N]\n0\n999\n1,000\n1,461\n", [0, 999, 1000, 1461]),
        ("force [N];acc [g]\n0,00;0\n999,00;5\n1.000,00;7\n1.461,35;3\n", [0, 999, 1000, 1461.35]),
        ("force [N];acc [g]\n0;0,5\n999;5\n1.004;7\n1.461;3\n", [0, 999, 1004, 1461]),
        (
            'force [N],acc [g]\n"0.00",0\n"999.00",5\n"1,004.50",7\n"-1,461.35",3\n',
            [0, 999, 1004.5, -1461.35],
        ),
        ("force [N]\tacc [g]\n0\t0,5\n999\t5\n1 004,5\t7\n1\u202f461\t3\n", [0, 999, 1004.5, 1461]),
        ("force [N];acc [g]\n0;0.5\n999;5\n1'004.5;7\n1\u2019461;3\n", [0, 999, 1004.5, 1461]),
        ("force [N] acc [g]\n0 0\n999 5\n1,004 7\n1,460 3\n", [0, 999, 1004, 1460]),
        ("force [N];acc [g]\n0;0\n1,250;5\n1,5;7\n2;3\n", [0, 1.25, 1.5, 2]),
        (
            "force [N];acc [g]\n1,250;0,001\n3,125;5,000\n4,500;7,000\n2,125;3,000\n",
            [1.25, 3.125, 4.5, 2.125],
        ),
    ],
)
def test_the_numbers_of_a_file_prove_what_its_signs_mean(tmp_path, lines, values):
    path = tmp_path / "shot.txt"
    path.write_text("# fs = 51200\n" + lines, encoding="utf-8")
    with open_recording(path) as recording:
        assert recording.read("force").tolist() == values


@pytest.mark.parametrize("sign", [",", "."])
def test_two_readings_are_refused_with_both_and_the_laboratory_chooses(tmp_path, sign):
    path = tmp_path / "shot.txt"
    path.write_text(
        f"# fs = 51200\nforce [N];acc [g]\n0;1\n998;5\n1{sign}004;7\n1{sign}461;3\n",
        encoding="utf-8",
    )
    message = (
        rf"'1{sign}004' can be .*1004.*: its (comma|point) is a decimal sign or "
        rf"sets thousands .*; give decimal"
    )
    with pytest.raises(RecordingError, match=message):
        open_recording(path)
    other = "." if sign == "," else ","
    for decimal, peak in ((sign, 998.0), (other, 1461.0)):
        with open_recording(path, ReadingOptions(decimal=decimal)) as recording:
            assert recording.read("force").max() == peak


def test_point_and_comma_as_decimal_signs_of_one_file_are_refused(tmp_path):
    path = Path(tmp_path / "shot.txt")
    path.write_text("# fs = 51200\nforce [N];acc [g]\n0,5;0.5\n1,5;2.25\n")
    with pytest.raises(
        RecordingError, match="numbers with a decimal point and numbers with a decimal comma"
    ):
        open_recording(path)
