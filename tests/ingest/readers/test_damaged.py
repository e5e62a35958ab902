"""What no reader may take for a recording, and the one line that says why."""

from __future__ import annotations

import warnings

import h5py
import numpy as np
import pandas as pd
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording
from scipy.io import savemat

WAVE = np.sin(np.arange(64) / 5)


def save_hdf5(path, arrays):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values


CONTAINERS = {".npz": lambda path, arrays: np.savez(path, **arrays), ".mat": savemat, ".h5": save_hdf5}


@pytest.fixture(params=CONTAINERS)
def save(request, tmp_path):
    """`save(name=array, ...)` writes them in one of the formats that hold named arrays of any shape."""

    def write(**arrays):
        path = tmp_path / f"recording{request.param}"
        CONTAINERS[request.param](path, arrays)
        return path

    return write


@pytest.mark.parametrize("rate", [np.nan, np.inf, 0.0, -51200.0, [51200.0, 48000.0], 1 + 2j])
def test_an_impossible_rate_is_refused(save, rate):
    with pytest.raises(RecordingError, match=r"recording\.\w+: .*expected"):
        open_recording(save(fs=rate, force=WAVE))


TIMES = np.arange(64) / 51200


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        ({"force": WAVE}, "'force' has no sampling rate; expected fs in hertz, or a time vector"),
        ({"fs": 51200.0}, "holds no channel"),
        ({"fs": 51200.0, "force": WAVE + 1j}, "'force' is complex"),
        ({"fs": 48000.0, "t": TIMES, "force": WAVE}, r"states two sampling rates, 48000\.0 Hz and 51200\.0 Hz"),
        ({"time": TIMES[::-1], "force": WAVE}, "time does not increase at sample"),
        ({"time": np.where(np.arange(64) == 9, np.nan, TIMES), "force": WAVE}, "time does not increase at sample"),
        ({"time": TIMES * 0, "force": WAVE}, "time does not increase at sample"),
    ],
    ids=["no rate", "rate alone", "no usable channel", "two rates", "time falls", "time has a gap", "time stands"],
)
def test_a_file_without_one_rate_and_a_channel_is_refused(save, arrays, reason):
    with pytest.raises(RecordingError, match=reason):
        open_recording(save(**arrays))


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (WAVE + 1j, "is complex; expected real numbers"),
        (WAVE > 0, "is logical; expected real numbers"),
        (np.empty(0), "is empty"),
        (WAVE.reshape(8, 8), r"has shape \(8, 8\); expected one row or one column"),
    ],
    ids=["complex", "logical", "empty", "matrix"],
)
def test_what_is_no_channel_is_refused_when_asked_for(save, values, reason):
    with open_recording(save(fs=51200.0, force=values, acceleration=WAVE)) as recording:
        assert [channel.name for channel in recording.channels] == ["acceleration"]
        with pytest.raises(RecordingError, match=f"'force' {reason}"):
            recording.read("force")


@pytest.mark.parametrize("shape", [(64,), (1, 64), (64, 1)])
def test_a_row_and_a_column_are_a_vector(save, shape):
    with open_recording(save(fs=51200.0, force=WAVE.reshape(shape))) as recording:
        np.testing.assert_array_equal(recording.read("force", 3, 9), WAVE[3:9])


def test_each_channel_keeps_its_own_length_but_for_that_of_its_time(save):
    with open_recording(save(fs=51200.0, force=WAVE, acceleration=WAVE[:50])) as recording:
        assert {c.name: c.samples for c in recording.channels} == {"force": 64, "acceleration": 50}
        assert recording.read("acceleration").size == 50
    with open_recording(save(t=TIMES, force=WAVE, acceleration=WAVE[:50])) as recording:
        assert recording.info("force").sampling_rate_hz == 51200
        with pytest.raises(RecordingError, match="has 50 samples, its time vector 64"):
            recording.read("acceleration")


def test_missing_samples_in_the_time_vector_are_handed_on(save):
    times = np.delete(np.arange(67), [40, 41, 42]) / 51200
    with open_recording(save(time=times, force=WAVE)) as recording:
        assert recording.info("force").header["time_gaps"] == [[40, 3]]


def test_pickled_arrays_are_never_loaded(tmp_path):
    path = tmp_path / "pickled.npz"
    np.savez(path, fs=51200.0, force=np.array([1.0, None], dtype=object), allow_pickle=True)
    with pytest.raises(RecordingError, match="'force' is an object"):
        open_recording(path)


def test_a_cell_array_is_no_channel(tmp_path):
    path = tmp_path / "cells.mat"
    savemat(path, {"fs": 51200.0, "force": np.array([WAVE, "words"], dtype=object), "acceleration": WAVE})
    with open_recording(path) as recording, pytest.raises(RecordingError, match="'force' is an object"):
        recording.read("force")


def test_a_damaged_sample_of_a_zip_is_refused_by_its_checksum(tmp_path):
    path = tmp_path / "flipped.npz"
    np.savez(path, fs=51200.0, force=WAVE)
    content = bytearray(path.read_bytes())
    content[content.index(WAVE[20].tobytes())] ^= 1
    path.write_bytes(content)
    with pytest.raises(RecordingError, match="CRC"), open_recording(path) as recording:
        recording.read("force")


def test_samples_kept_in_another_file_are_refused(tmp_path):
    path = tmp_path / "external.h5"
    with h5py.File(path, "w") as file:
        file["fs"] = 51200.0
        file.create_dataset("force", (64,), "f8", external=[(str(tmp_path / "raw.bin"), 0, 512)])
    with pytest.raises(RecordingError, match="'force' keeps its samples in another file"):
        open_recording(path)


def test_whole_numbers_with_holes_are_refused(tmp_path):
    path = tmp_path / "holes.parquet"
    counts = pd.array([1, None, 3], dtype="Int16")
    pd.DataFrame({"fs": [51200.0] * 3, "counts": counts}).to_parquet(path)
    with open_recording(path) as recording, pytest.raises(RecordingError, match="'counts' lacks 1 values"):
        recording.read("counts")


def test_two_channels_of_one_name_are_refused(tmp_path):
    path = tmp_path / "twice.csv"
    path.write_text("time,force,force\n0,1,2\n0.1,3,4\n")
    with pytest.raises(RecordingError, match="has 2 channels called 'force'"):
        open_recording(path)


def test_a_library_warning_about_the_file_is_a_refusal(tmp_path, monkeypatch):
    path = tmp_path / "doubtful.mat"
    savemat(path, {"fs": 51200.0, "force": WAVE})

    def doubt(*_, **__):
        warnings.warn("did not fully consume the compressed contents", UserWarning, stacklevel=1)

    monkeypatch.setattr("scipy.io.loadmat", doubt)
    with pytest.raises(RecordingError, match="did not fully consume"):
        open_recording(path)


def test_an_unknown_suffix_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(RecordingError, match=r"shot\.xlsx: no reader for \.xlsx; known: \.mat, \.csv"):
        open_recording(tmp_path / "shot.xlsx")


@pytest.mark.parametrize("start", [np.nan, np.inf])
def test_a_start_that_is_no_time_is_refused(tmp_path, start):
    """It was stored, and every time of the channel was NaN."""
    path = tmp_path / "late.h5"
    with h5py.File(path, "w") as file:
        file["force"] = WAVE
        file["force"].attrs.update({"fs": 51200.0, "start_s": start})
    with pytest.raises(RecordingError, match=f"'force' starts at {start} s; expected a finite time"):
        open_recording(path)


def test_a_data_set_of_other_bytes_than_its_shape_is_refused(tmp_path):
    """libhdf5 gave the samples where all were asked for, and zeros for a part of them."""
    path = tmp_path / "short.h5"
    with h5py.File(path, "w") as file:
        file["fs"] = 51200.0
        file["force"] = WAVE
    content = path.read_bytes()
    size = (WAVE.nbytes).to_bytes(8, "little")
    assert content.count(size) == 1
    path.write_bytes(content.replace(size, (WAVE.nbytes // 2).to_bytes(8, "little")))
    with pytest.raises(RecordingError, match=r"'force' has 256 bytes; its shape \(64,\) needs 512"):
        open_recording(path)


def test_a_unit_that_is_no_utf_8_can_be_printed(tmp_path):
    path = tmp_path / "latin.h5"
    with h5py.File(path, "w") as file:
        file["force"] = WAVE
        file["force"].attrs.update({"fs": 51200.0, "unit": "QN"})
    path.write_bytes(path.read_bytes().replace(b"QN", b"\xb5N"))  # micro, in Latin-1
    with open_recording(path) as recording:
        assert recording.info("force").unit == "?N"


def test_a_matlab_file_that_scipy_takes_for_version_4_is_refused(tmp_path):
    """It was read by other rules than it had been checked by: a name of gigabytes took the memory."""
    path = tmp_path / "four.mat"
    savemat(path, {"fs": 51200.0, "force": WAVE})
    path.write_bytes(b"\0" + path.read_bytes()[1:])
    with pytest.raises(RecordingError, match="is not a MATLAB file of version 5"):
        open_recording(path)
