"""Targets: log-log lines between break points, and CSV files as people write them."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.srs.standards import NASA_STD_7003, within_db
from pyroshock.twin.srs.target import Target, ramps
from pyroshock.twin.srs.target_csv import read_target

G = 9.80665
#: From 50 to 1500 over a decade, dB per octave.
SLOPE = 20 * np.log10(30) / np.log2(10)


def target(
    frequency=(100.0, 1000.0, 10000.0), level=(50.0, 1500.0, 1500.0), upper=6.0, lower=6.0
) -> Target:
    k = len(frequency)
    return Target(np.array(frequency), np.array(level), np.full(k, upper), np.full(k, lower))


def read(tmp_path, text, tolerance=None):
    path = tmp_path / "spec.csv"
    path.write_text(text, encoding="utf-8")
    return read_target(path, tolerance)


def test_levels_between_break_points_are_a_power_law():
    """Six decibels per octave double; break points keep their levels, and outside of them there is
    none."""
    lines = np.geomspace(100, 1000, 9)
    exponent = np.log10(1500 / 50)
    np.testing.assert_allclose(
        target().at(lines).level_m_s2, 50 * (lines / 100) ** exponent, rtol=1e-12
    )
    np.testing.assert_allclose(
        target().at(target().frequency_hz).level_m_s2, [50, 1500, 1500], rtol=1e-12
    )
    made = ramps(100, 10.0, (800, 20 * np.log10(2)), (1600, 0.0))
    np.testing.assert_allclose(made.level_m_s2, [10, 80, 80], rtol=1e-12)
    np.testing.assert_allclose(made.slope_db_per_octave, [20 * np.log10(2), 0], atol=1e-12)
    with pytest.raises(ValueError, match="99 Hz: the target reaches from 100 to 10000 Hz"):
        target().at(np.array([99.0, 200.0]))


def test_tolerance_holds_up_to_the_next_break_point_and_makes_break_points():
    steps = Target(
        np.array([100.0, 1000, 10000]), np.ones(3), np.array([3.0, 6, 9]), np.array([1.0, 2, 3])
    )
    held = steps.at(np.array([100.0, 999, 1000, 9999, 10000]))
    np.testing.assert_array_equal(held.upper_db, [3, 3, 6, 6, 9])
    np.testing.assert_array_equal(held.lower_db, [1, 1, 2, 2, 3])
    made = target().with_tolerance(NASA_STD_7003)
    lines = made.at(np.array([100.0, 2999, 3000, 3001, 10000]))
    np.testing.assert_array_equal(lines.upper_db, [6, 6, 6, 9, 9])
    np.testing.assert_array_equal(lines.lower_db, 6)
    np.testing.assert_allclose(
        made.at(np.array([500.0])).level_m_s2, target().at(np.array([500.0])).level_m_s2
    )


def test_lines_of_a_specification_are_even_on_log_paper_and_those_of_a_table_its_own():
    lines = target(frequency=(100.0, 200.0, 1600.0)).lines(6)
    assert lines.size == 25
    np.testing.assert_allclose(np.diff(np.log2(lines)), 1 / 6, rtol=1e-9)
    own = 100 * 2 ** (np.arange(19) / 6)
    np.testing.assert_array_equal(Target(own, np.ones(19), np.ones(19), np.ones(19)).lines(), own)


def test_what_is_no_target_and_no_text_is_refused(tmp_path):
    for changed, words in (
        ({"frequency": (100.0, 100.0, 200.0)}, "frequency_hz = 100 follows 100"),
        ({"level": (50.0, 0.0, 10.0)}, "level_m_s2 = 0 at point 2"),
        ({"level": (50.0, np.nan, 10.0)}, "level_m_s2 = nan at point 2"),
        ({"lower": -3.0}, "lower_db = -3"),
        ({"frequency": (100.0,)}, "level_m_s2 has shape"),
    ):
        with pytest.raises(ValueError, match=words):
            target(**changed)
    for content in (b"frequency_hz,level_g\n100,\xff\n", "Größe".encode("latin-1"), b"a\0b"):
        (tmp_path / "spec.csv").write_bytes(content)
        with pytest.raises(ValueError, match=r"^spec\.csv: no CSV table in UTF-8: "):
            read_target(tmp_path / "spec.csv")


@pytest.mark.parametrize(
    "text",
    [
        "frequency_hz,level_g,tolerance_db\n100,50,3\n1000,1500,3\n",
        "# from the customer\nFrequency (Hz),Level [g],Tolerance dB\n100,50,3\n\n1000,1500,3\n",
        "frequency_hz;level_g;upper_db;lower_db\n100,0;50,0;3;-3\n1000;1500;3;3\n",
        "f_hz\tmaximax_g\ttolerance_db\tremark\n100\t50\t3\tknee\n1000\t1500\t3\t\n",
        f"frequency_hz,level m/s²,tolerance_db\n100,{50 * G},3\n1000,{1500 * G},3\n",
        f"frequency_hz,level_m_s2,srs_g,tolerance_db\n100,{50 * G},7,3\n1000,{1500 * G},7,3\n",
        f"frequency_hz,level_g,slope_db_per_octave,tolerance_db\n100,50,,3\n1000,,{SLOPE},3\n",
    ],
)
def test_one_target_however_it_is_written(tmp_path, text):
    made = read(tmp_path, text)
    np.testing.assert_allclose(made.frequency_hz, [100, 1000])
    np.testing.assert_allclose(made.level_m_s2, [50 * G, 1500 * G], rtol=1e-12)
    np.testing.assert_array_equal([made.upper_db, made.lower_db], 3.0)


def test_tolerance_given_counts_before_the_file_and_the_file_before_the_standard(tmp_path):
    stated = "frequency_hz,level_g,tolerance_db\n100,50,3\n10000,1500,3\n"
    silent = "frequency_hz,level_g\n100,50\n10000,1500\n"
    assert set(read(tmp_path, stated, within_db(4.0)).upper_db) == {4.0}
    assert set(read(tmp_path, stated).upper_db) == {3.0}
    np.testing.assert_array_equal(read(tmp_path, silent).upper_db, [6, 9, 9])


def test_side_without_a_column_is_free(tmp_path):
    made = read(tmp_path, "frequency_hz,level_g,lower_db\n100,50,0\n1000,1500,0\n")
    assert np.all(np.isinf(made.upper_db)) and np.all(made.lower_db == 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is empty; expected a header"),
        (
            "frequency_hz,level\n100,1\n200,1\n",
            "column 'level' has no unit; expected level_g or level_m_s2",
        ),
        ("frequency_hz,height_g\n100,1\n200,1\n", "no column of levels in frequency_hz, height_g"),
        ("hz,level_g\n100,1\n200,1\n", "no column frequency_hz; it has: hz, level_g"),
        (
            "frequency_hz,level_g,level_m_s2\n100,1,1\n200,1,1\n",
            "level_g and level_m_s2 both give the level",
        ),
        ("frequency_hz,level_g\n100,1\n", "1 rows; expected two break points"),
        (
            "frequency_hz,level_g\n100,1\n200,abc\n",
            "line 3: level_g is 'abc'; expected a positive number",
        ),
        (
            "frequency_hz,level_g\n100,1\n# x\n200,-1\n",
            "line 4: level_g is '-1'; expected a positive number",
        ),
        ("frequency_hz,level_g\n100,1\n200\n", "line 3: 1 fields; expected 2"),
        (
            'frequency_hz,level_g,remark\n100,1,\n200,1,"knee\n300,1,\n',
            "no CSV table in UTF-8: row 4: unexpected end",
        ),
        (
            "frequency_hz,level_g,slope_db_per_octave\n100,,6\n200,,6\n",
            "line 2: a slope without a row above",
        ),
        ("frequency_hz,level_g\n200,1\n100,1\n", "spec.csv: frequency_hz = 100 follows 200"),
        ("frequency_hz,level_g,upper_db\n100,1,-1\n200,1,1\n", "line 2: upper_db is '-1'"),
    ],
)
def test_unreadable_target_is_refused_by_file_line_and_value(tmp_path, text, said):
    with pytest.raises(ValueError, match=r"^spec\.csv") as refused:
        read(tmp_path, text)
    assert said in str(refused.value)
