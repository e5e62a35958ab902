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
TIMES = np.arange(64) / 51200


def save_hdf5(path, arrays):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values


CONTAINERS = {
    ".npz": lambda path, arrays: np.savez(path, **arrays),
    ".mat": savemat,
    ".h5": save_hdf5,
}


@pytest.fixture(params=CONTAINERS)
def save(request, tmp_path):
    """`save(name=array, ...)` writes them in one of the formats that hold named arrays of any
    shape."""

    def write(**arrays):
        path = tmp_path / f"recording{request.param}"
        CONTAINERS[request.param](path, arrays)
        return path

    return write


@pytest.mark.parametrize(
    ("arrays", "reason"),
    [
        *(({"fs": rate, "force": WAVE}, r"recording\.\w+: .*expected")
          for rate in (np.nan, np.inf, 0.0, -51200.0, [51200.0, 48000.0], 1 + 2j)),
        ({"force": WAVE}, "'force' has no sampling rate; expected fs in hertz, or a time vector"),
        ({"fs": 51200.0}, "holds no channel"),
        ({"fs": 51200.0, "force": WAVE + 1j}, "'force' is complex"),
        ({"fs": 48000.0, "t": TIMES, "force": WAVE},
         r"states two sampling rates, 48000\.0 Hz and 51200\.0 Hz"),
        *(({"time": times, "force": WAVE}, "time does not increase at sample")
          for times in (TIMES[::-1], np.where(np.arange(64) == 9, np.nan, TIMES), TIMES * 0)),
    ],
)  # fmt: skip
def test_a_file_without_one_rate_and_a_channel_is_refused(save, arrays, reason):
    with pytest.raises(RecordingError, match=reason):
        open_recording(save(**arrays))


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (WAVE + 1j, "is complex; expected real numbers"),
        (WAVE > 0, "is (logical; expected real|a logical array; save it with double)"),
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


def test_vectors_of_any_lie_and_length_are_channels_but_for_that_of_their_time(save):
    for shape in ((64,), (1, 64), (64, 1)):
        with open_recording(save(fs=51200.0, force=WAVE.reshape(shape))) as recording:
            np.testing.assert_array_equal(recording.read("force", 3, 9), WAVE[3:9])
    with open_recording(save(fs=51200.0, force=WAVE, acceleration=WAVE[:50])) as recording:
        assert {c.name: c.samples for c in recording.channels} == {"force": 64, "acceleration": 50}
        assert recording.read("acceleration").size == 50
    with open_recording(save(t=TIMES, force=WAVE, acceleration=WAVE[:50])) as recording:
        assert recording.info("force").sampling_rate_hz == 51200
        with pytest.raises(RecordingError, match="has 50 samples, its time vector 64"):
            recording.read("acceleration")
    times = np.delete(np.arange(67), [40, 41, 42]) / 51200
    with open_recording(save(time=times, force=WAVE)) as recording:
        assert recording.info("force").header["time_gaps"] == [[40, 3]]


def pickled(path):
    np.savez(path, fs=51200.0, force=np.array([1.0, None], dtype=object), allow_pickle=True)


def cells(path):
    savemat(
        path,
        {"fs": 51200.0, "force": np.array([WAVE, "words"], dtype=object), "acceleration": WAVE},
    )


def flipped(path):
    np.savez(path, fs=51200.0, force=WAVE)
    content = bytearray(path.read_bytes())
    content[content.index(WAVE[20].tobytes())] ^= 1
    path.write_bytes(content)


def external(path):
    with h5py.File(path, "w") as file:
        file["fs"] = 51200.0
        file.create_dataset(
            "force", (64,), "f8", external=[(str(path.with_name("raw.bin")), 0, 512)]
        )


def holes(path):
    counts = pd.array([1, None, 3], dtype="Int16")
    pd.DataFrame({"fs": [51200.0] * 3, "force": counts}).to_parquet(path)


def twice(path):
    path.write_text("time,force,force\n0,1,2\n0.1,3,4\n")


def late(path, start_s):
    """It was stored, and every time of the channel was NaN."""
    with h5py.File(path, "w") as file:
        file["force"] = WAVE
        file["force"].attrs.update({"fs": 51200.0, "start_s": start_s})


def short(path):
    """libhdf5 gave the samples where all were asked for, and zeros for a part of them."""
    save_hdf5(path, {"fs": 51200.0, "force": WAVE})
    content, size = path.read_bytes(), (WAVE.nbytes).to_bytes(8, "little")
    assert content.count(size) == 1
    path.write_bytes(content.replace(size, (WAVE.nbytes // 2).to_bytes(8, "little")))


def version_4(path):
    """It was read by other rules than it had been checked by: a name of gigabytes took the
    memory."""
    savemat(path, {"fs": 51200.0, "force": WAVE})
    path.write_bytes(b"\0" + path.read_bytes()[1:])


@pytest.mark.parametrize(
    ("name", "write", "reason"),
    [
        ("pickled.npz", pickled, "'force' is an object"),
        ("cells.mat", cells, "'force' is a MATLAB cell"),
        ("flipped.npz", flipped, "CRC"),
        ("external.h5", external, "'force' keeps its samples in another file"),
        ("holes.parquet", holes, "'force' lacks 1 values"),
        ("twice.csv", twice, "has 2 channels called 'force'"),
        (
            "nan.h5",
            lambda path: late(path, np.nan),
            "'force' starts at nan s; expected a finite time",
        ),
        (
            "inf.h5",
            lambda path: late(path, np.inf),
            "'force' starts at inf s; expected a finite time",
        ),
        ("short.h5", short, r"'force' has 256 bytes; its shape \(64,\) needs 512"),
        ("four.mat", version_4, "is not a MATLAB file of version 5"),
        ("shot.xlsx", lambda path: None, r"shot\.xlsx: no reader for \.xlsx; known: \.mat, \.csv"),
    ],
)
def test_a_file_that_is_not_what_it_seems_is_refused(tmp_path, name, write, reason):
    write(tmp_path / name)
    with pytest.raises(RecordingError, match=reason), open_recording(tmp_path / name) as recording:
        recording.read("force")


def test_a_library_warning_about_the_file_is_a_refusal(tmp_path, monkeypatch):
    savemat(tmp_path / "doubtful.mat", {"fs": 51200.0, "force": WAVE})

    def doubt(*_, **__):
        warnings.warn("did not fully consume the compressed contents", UserWarning, stacklevel=1)

    monkeypatch.setattr("scipy.io.loadmat", doubt)
    with pytest.raises(RecordingError, match="did not fully consume"):
        open_recording(tmp_path / "doubtful.mat")


def test_a_unit_that_is_no_utf_8_can_be_printed(tmp_path):
    path = tmp_path / "latin.h5"
    with h5py.File(path, "w") as file:
        file["force"] = WAVE
        file["force"].attrs.update({"fs": 51200.0, "unit": "QN"})
    path.write_bytes(path.read_bytes().replace(b"QN", b"\xb5N"))  # micro, in Latin-1
    with open_recording(path) as recording:
        assert recording.info("force").unit == "?N"
