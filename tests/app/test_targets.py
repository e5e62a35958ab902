"""Uploaded specifications: read as a file is, and refused with file, line and value."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.app.impacts.spectra import MOST_BYTES, MOST_POINTS, source_name, target_from_upload
from pyroshock.twin.srs.target_csv import read_target

SPEC = "frequency_hz,level_g,tolerance_db\n100,5,6\n1000,50,6\n10000,50,9\n"


def test_upload_is_what_the_file_is(tmp_path):
    (tmp_path / "spec.csv").write_text(SPEC, encoding="utf-8")
    file, upload = read_target(tmp_path / "spec.csv"), target_from_upload(SPEC, "spec.csv")
    for name in ("frequency_hz", "level_m_s2", "upper_db", "lower_db"):
        np.testing.assert_array_equal(getattr(upload, name), getattr(file, name))
    assert upload.level_m_s2[0] == pytest.approx(5 * 9.80665)


def test_tolerance_goes_before_the_file_s():
    made = target_from_upload(SPEC.encode(), "spec.csv", "+9/-3dB")
    assert (set(made.upper_db), set(made.lower_db)) == ({9.0}, {3.0})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (SPEC.replace("50,6", "loud,6"), r"spec.csv, line 3: level_g is 'loud'; expected a positive number"),
        (SPEC.replace("1000,", "-1000,"), r"spec.csv, line 3: frequency_hz is '-1000'"),
        (SPEC.replace("10000,", "1e9,"), r"spec.csv: frequency_hz is 1e\+09; expected 0.01 to 1e\+06 Hz"),
        (SPEC.replace(",tolerance_db", ""), r"spec.csv, line 2: 3 fields; expected 2"),
        ("", "spec.csv: is empty"),
        (b"\xff\xfe\x00", "spec.csv: byte 0 is no UTF-8"),
        ("frequency_hz,level_g\n" + "x" * 200_000 + ",1\n2,1\n", "spec.csv: no CSV table"),
        ("frequency_hz,level_g,slope_db_per_octave\n1,1,\n100000,,99999\n", r"line 3: slope_db_per_octave is '99999'"),
        ("#" * (MOST_BYTES + 1), f"{MOST_BYTES + 1} bytes; expected a specification of at most {MOST_BYTES}"),
    ],
    ids=["level", "frequency", "range", "fields", "empty", "encoding", "field", "slope", "size"],
)
def test_what_is_wrong_is_named_with_line_and_value(content, said):
    with pytest.raises(ValueError, match=said):
        target_from_upload(content, "spec.csv")


def test_too_many_points_are_refused():
    rows = "".join(f"{100 + i},1\n" for i in range(MOST_POINTS + 1))
    with pytest.raises(ValueError, match=f"{MOST_POINTS + 1} points; expected at most {MOST_POINTS}"):
        target_from_upload("frequency_hz,level_g\n" + rows, "spec.csv", "6dB")


def test_unknown_tolerance_is_refused():
    with pytest.raises(ValueError, match="tolerance is 'six'"):
        target_from_upload(SPEC, "spec.csv", "six")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ("../../etc/spec.csv", "spec.csv"),
        ("C:\\lab\\spec.csv", "spec.csv"),
        ("a\nb.csv", "ab.csv"),
        ("", "specification"),
    ],
)
def test_name_of_an_upload_is_no_path(given, told):
    assert source_name(given) == told


@given(st.one_of(st.text(max_size=300), st.binary(max_size=300)), st.booleans())
@settings(max_examples=300)
def test_any_content_is_read_or_refused(content, with_header):
    head = "frequency_hz,level_g,slope_db_per_octave,upper_db\n100,1,,3\n"
    if with_header:
        content = head + content if isinstance(content, str) else head.encode() + content
    try:
        target = target_from_upload(content, "spec.csv")
    except ValueError as error:
        assert str(error)
    else:
        assert np.isfinite(target.level_m_s2).all() and target.lines().size >= 1
