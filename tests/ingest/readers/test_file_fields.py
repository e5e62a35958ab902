"""No field that may change the meaning of a number is passed over, and no remark refuses a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.ingest.readers import READERS, ReadingOptions, RecordingError, open_recording
from pyroshock.ingest.readers.field_rules import Treatment, harmless, refused, used
from pyroshock.ingest.readers.file_fields import refuse_unread_fields, unread_field

RULES = (
    used("fs", "the sampling rate"),
    harmless("Sensor*", "about the sensor"),
    refused("gain*", "apply the gain and save again", 1, "none"),
)

MEANINGFUL = {
    "scale_factor": 0.5,
    "add_offset": 3.0,
    "_FillValue": -9999,
    "missing_value": 9.9e37,
    "Gain": 2,
    "ScaleFactor": "0.01",
    "Conversion factor": 4.448,
    "Units": "lbf",
    "Sample rate": 1000.0,
    "dt": 1e-3,
    "Sampling Interval (ms)": 0.02,
    "Trigger Delay": 0.004,
    "start_time": 0.25,
    "Polarity": "inverted",
    "Slope": np.array([1.5]),
    "polynomial": [0.0, 2.0, 0.1],
    "Lost samples": 12,
}

REMARKS = {
    "operator": "Ana",
    "Calibration date": "2026-03-01",
    "Unit Under Test": "STM-2",
    "scale_factor": 1.0,
    "add_offset": 0,
    "Gain": "",
    "Units": "N",
    "Sample rate": 51200.0,
    "Sample rate [kHz]": 51.2,
    "dt": 1 / 51200,
    "Polarity": "normal",
    "Start time": "2026-11-28 12:00:00.004",
    "recorded": np.datetime64("2026-11-28T12:00:00.004", "ns"),
    "start time": np.datetime64("2026-11-28T12:00:00.004", "ns"),
    "Axis": "Z",
    "Cutoff frequency": 20000.0,
    "crest factor": 4.2,
    "restitution coefficient": 0.7,
    "test step": 3,
    "IEPE bias": 11.2,
    "sensitivity": 10.2,  # the samples are in newtons
    "Sensitivity unit": "mV/N",
    "Lost samples": 0,
}


@pytest.mark.parametrize("name", MEANINGFUL)
def test_unknown_field_with_meaning_is_named(name):
    reason = unread_field(
        RULES[:1], {"fs": 51200.0, name: MEANINGFUL[name]}, unit="N", rate_hz=51200.0
    )
    assert reason is not None and repr(name) in reason and "--harmless-field" in reason


@pytest.mark.parametrize("name", REMARKS)
def test_remark_passes(name):
    assert unread_field(RULES[:1], {name: REMARKS[name]}, unit="N", rate_hz=51200.0) is None


def test_rule_of_the_format_goes_first():
    assert (
        unread_field(RULES, {"fs": 1.0, "Sensor gain": 4.0, "gain": 1, "gain 2": " None"}) is None
    )
    assert unread_field(RULES, {"Gain 2": 3.0}) == "has Gain 2 = 3.0; apply the gain and save again"


def test_message_names_file_place_field_and_value():
    with pytest.raises(
        RecordingError, match=r"^a\.h5: 'force' has gain = 2\.0; apply the gain and save again$"
    ):
        refuse_unread_fields(Path("a.h5"), RULES, {"gain": 2.0}, "'force'")


def test_laboratory_says_that_a_field_is_harmless():
    options = ReadingOptions(harmless_fields=("trigger *", "GAIN"))
    assert unread_field(RULES, {"Trigger delay": 0.1, "gain": 2.0}, options) is None


def test_sensitivity_beside_samples_in_volts_is_no_remark():
    assert unread_field((), {"sensitivity": 10.2}, unit="V") is not None


def with_chunk(path: Path, name: bytes, content: bytes = b"\1\2\3\4") -> Path:
    """The WAV file with one chunk more before its end."""
    import struct

    raw = path.read_bytes() + name + struct.pack("<I", len(content)) + content
    path.write_bytes(raw[:4] + struct.pack("<I", len(raw) - 8) + raw[8:])
    return path


@pytest.mark.parametrize(
    ("chunk", "is_read"), [(b"bext", True), (b"iXML", True), (b"JUNK", True), (b"cali", False)]
)
def test_chunks_of_wav(tmp_path, chunk, is_read):
    from scipy.io import wavfile

    path = tmp_path / "hit.wav"
    wavfile.write(path, 51200, np.zeros(100, np.float32))
    if is_read:
        with open_recording(with_chunk(path, chunk)) as recording:
            assert np.array_equal(recording.read("ch1"), np.zeros(100))
        return
    with pytest.raises(
        RecordingError, match="the file has cali = 'a chunk of 4 bytes'; a calibration is stated"
    ):
        open_recording(with_chunk(path, chunk))


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.format)
def test_every_reader_says_what_becomes_of_its_fields(reader):
    """Names differ, reasons are sentences, and a refused field says what to do."""
    assert reader.fields
    names = [rule.name for rule in reader.fields]
    assert len(set(names)) == len(names)
    assert all(len(rule.reason) > 1 and not rule.reason.endswith(".") for rule in reader.fields)
    assert any(rule.treatment is Treatment.USED for rule in reader.fields)


#: Formats whose fields have names of the writer's choice: how a recording of a recipe gets one
#: more.
def add_tdms(path: Path, name: str, value: float) -> None:
    from nptdms import RootObject, TdmsFile, TdmsWriter

    properties = {**TdmsFile.read(path).properties, name: value}
    with TdmsWriter(path, mode="a") as writer:
        writer.write_segment([RootObject(properties)])


def add_lvm(path: Path, name: str, value: float) -> None:
    head, end, rest = path.read_text(encoding="utf-8").partition("***End_of_Header***")
    path.write_text(f"{head}{name}\t{value}\n{end}{rest}", encoding="utf-8", newline="\r\n")


FREE_FIELDS = {"tdms": add_tdms, "lvm": add_lvm}


@pytest.mark.parametrize("recipe", FREE_FIELDS)
def test_field_that_changes_numbers_refuses_a_recording(tmp_path, make_recording, recipe):
    path = tmp_path / f"hit.{recipe}"
    make_recording(recipe, path)
    FREE_FIELDS[recipe](path, "Scale factor", 1.0)
    with open_recording(path):
        pass
    FREE_FIELDS[recipe](path, "Amplifier gain", 10.0)
    with pytest.raises(
        RecordingError, match=rf"^hit\.{recipe}: the file has the field 'Amplifier gain' = '?10\.0"
    ):
        open_recording(path)
    with open_recording(path, ReadingOptions(harmless_fields=("amplifier *",))):
        pass
