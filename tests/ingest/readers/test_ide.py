"""`.ide` of enDAQ and Slam Stick recorders, written with the maker's own schema."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording
from pyroshock.ingest.readers.ide import refuse_cut


def test_without_its_library_the_reason_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "idelib", None)
    path = tmp_path / "shot.ide"
    path.write_bytes(b"\x1a\x45\xdf\xa3\x80")
    with pytest.raises(RecordingError, match=r"idelib, which is not installed; pip install 'pyroshock\[ide\]'"):
        open_recording(path)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"RIFF", "does not start as an EBML file"),
        (b"\x1a\x45\xdf\xa3\x82\x00", "is cut: 6 bytes, and an element ends at byte 7"),
        (b"\x1a\x45\xdf\xa3\x80\x00\x80", "no whole element starts at byte 5"),
        (b"\x1a\x45\xdf\xa3\x80\xa1", "no whole element starts at byte 5"),
    ],
)
def test_elements_that_are_not_whole_are_refused(tmp_path, content, reason):
    (tmp_path / "shot.ide").write_bytes(content)
    with pytest.raises(RecordingError, match=rf"^shot\.ide: .*{reason}"):
        refuse_cut(tmp_path / "shot.ide")


def test_whole_elements_are_taken(tmp_path):
    # lengths of one byte, of two, and none
    (tmp_path / "shot.ide").write_bytes(b"\x1a\x45\xdf\xa3\x81x" + b"\xa1\x40\x03xyz" + b"\xec\x80")
    refuse_cut(tmp_path / "shot.ide")


@pytest.fixture
def shot(make_recording, tmp_path):
    """A file and what it holds; `scaled` writes another time scale into it."""
    pytest.importorskip("idelib", reason="the extra [ide] is not installed")
    path = tmp_path / "shot.ide"
    return path, make_recording("ide", path)


def scaled(path, expression):
    content = path.read_bytes()
    assert content.count(b"1.0/50000") == 1
    path.write_bytes(content.replace(b"1.0/50000", expression))


def test_the_recorder_is_told_in_the_header_and_a_time_scale_can_be_a_number(shot):
    path, truth = shot
    with open_recording(path) as recording:
        header = recording.info("force").header
        assert (header["ProductName"], header["RecorderSerial"], header["sensor"]) == ("Slam Stick C", 428, "Load cell")
        np.testing.assert_array_equal(recording.read("force", 5, 9), truth.channels["force"][5:9])
    scaled(path, b"  0.00004")
    with open_recording(path) as recording:
        assert recording.info("force").sampling_rate_hz == 25_000.0


@pytest.mark.parametrize("expression", [b"9**9**9*9", b"().__x__ ", b"1.0/0.000", b"exp(1)/20"])
def test_a_time_scale_is_never_run(shot, expression):
    scaled(shot[0], expression)
    with pytest.raises(RecordingError, match=r"^shot\.ide: .*is no number and no ratio of two"):
        open_recording(shot[0])
