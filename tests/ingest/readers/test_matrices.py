"""Matrices, files of one array, and structures: columns and fields are channels."""

from __future__ import annotations

import io
import pickle
import struct
import tracemalloc

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from scipy.io import savemat

TABLE = np.random.default_rng(5).normal(size=(50, 3))
NAMED = ReadingOptions(("force [N]", "acc", "laser"), 51200.0)
RATE_ALONE = ReadingOptions(sampling_rate_hz=51200.0)


def _write_mat73(path, table):
    """MATLAB stores the transposed matrix."""
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("data", data=table.T).attrs["MATLAB_class"] = np.bytes_(b"double")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def _write_hdf5(path, table):
    with h5py.File(path, "w") as file:
        file["data"] = table


WRITERS = {
    "npy": (".npy", np.save),
    "npy by columns": (".npy", lambda path, table: np.save(path, np.asfortranarray(table))),
    "npz": (".npz", lambda path, table: np.savez(path, data=table)),
    "mat": (".mat", lambda path, table: savemat(path, {"data": table})),
    "mat73": (".mat", _write_mat73),
    "hdf5": (".h5", _write_hdf5),
}


@pytest.fixture(params=WRITERS)
def write(request, tmp_path):
    suffix, writer = WRITERS[request.param]

    def write(table):
        writer(tmp_path / f"shot{suffix}", table)
        return tmp_path / f"shot{suffix}"

    return write


@pytest.mark.parametrize("lies", [False, True], ids=["n x k", "k x n"])
class TestMatrix:
    def test_columns_have_names_or_numbers_and_can_be_the_time(self, write, lies):
        with open_recording(write(TABLE.T if lies else TABLE), NAMED) as recording:
            facts = [(c.name, c.unit, c.samples, c.sampling_rate_hz) for c in recording.channels]
            assert facts == [
                ("force", "N", 50, 51200.0),
                ("acc", None, 50, 51200.0),
                ("laser", None, 50, 51200.0),
            ]
            for number, name in enumerate(("force", "acc", "laser")):
                np.testing.assert_array_equal(recording.read(name), TABLE[:, number])
                np.testing.assert_array_equal(recording.read(name, 3, 9), TABLE[3:9, number])
        with open_recording(write(TABLE.T if lies else TABLE), RATE_ALONE) as recording:
            assert [c.name for c in recording.channels] == ["data_1", "data_2", "data_3"]
            np.testing.assert_array_equal(recording.read("data_2"), TABLE[:, 1])
        table = np.column_stack([np.arange(50) / 51.2, TABLE])
        options = ReadingOptions(("time [ms]", "a", "b", "c"))
        with open_recording(write(table.T if lies else table), options) as recording:
            assert [(c.name, c.sampling_rate_hz) for c in recording.channels] == [
                (n, 51200.0) for n in "abc"
            ]
            np.testing.assert_array_equal(recording.read("c"), TABLE[:, 2])


def test_a_matrix_without_a_rate_and_two_that_the_names_fit_are_refused(write, tmp_path):
    with pytest.raises(RecordingError, match=r"has no sampling rate; .*sampling_rate_hz under"):
        open_recording(write(TABLE))
    np.savez(tmp_path / "shot.npz", a=TABLE, b=TABLE)
    with pytest.raises(
        RecordingError, match="3 columns are named, and 'a', 'b' have as many; expected one"
    ):
        open_recording(tmp_path / "shot.npz", NAMED)


class TestNpy:
    @pytest.mark.parametrize("dtype", ["i2", ">i2", "f4", "f8"])
    def test_a_vector_keeps_its_numbers(self, tmp_path, dtype):
        values = (TABLE[:, 0] * 1000).astype(dtype)
        np.save(tmp_path / "shot.npy", values)
        with open_recording(
            tmp_path / "shot.npy", ReadingOptions(("force [N]",), 51200.0)
        ) as recording:
            assert recording.info("force").unit == "N"
            np.testing.assert_array_equal(recording.read("force"), values)
        with open_recording(tmp_path / "shot.npy", RATE_ALONE) as recording:
            np.testing.assert_array_equal(recording.read("data", 3, 7), values[3:7])

    def test_named_fields_are_channels(self, tmp_path):
        rows = np.zeros(50, [("time", "f8"), ("force", "f4"), ("counts", "i2")])
        rows["time"], rows["force"], rows["counts"] = (
            np.arange(50) / 1000,
            TABLE[:, 0],
            np.arange(50),
        )
        np.save(tmp_path / "shot.npy", rows)
        with open_recording(tmp_path / "shot.npy") as recording:
            facts = [(c.name, c.dtype, c.sampling_rate_hz) for c in recording.channels]
            assert facts == [("force", "<f4", 1000.0), ("counts", "<i2", 1000.0)]
            np.testing.assert_array_equal(recording.read("force"), rows["force"])

    def test_a_pickle_is_not_run(self, tmp_path):
        class Bomb:
            def __reduce__(self):
                return (pytest.fail, ("unpickled",))

        np.save(tmp_path / "shot.npy", np.array([Bomb()], dtype=object))
        with pytest.raises(RecordingError, match="holds Python objects, which are not read"):
            open_recording(tmp_path / "shot.npy", RATE_ALONE)
        (tmp_path / "shot.npy").write_bytes(pickle.dumps(TABLE))
        with pytest.raises(RecordingError, match=r"^shot\.npy: damaged"):
            open_recording(tmp_path / "shot.npy", RATE_ALONE)

    @pytest.mark.parametrize(
        ("table", "options", "reason"),
        [
            (
                TABLE,
                ReadingOptions(("a", "b"), 1.0),
                r"2 columns are named \(a, b\), and its shape is \(50, 3\)",
            ),
            (
                TABLE[:, 0],
                ReadingOptions(("a", "b"), 1.0),
                r"2 columns are named \(a, b\), and its shape is \(50,\)",
            ),
            (
                TABLE[:3],
                RATE_ALONE,
                r"'data' has shape \(3, 3\); expected more samples than channels",
            ),
            (np.zeros((5, 5, 5)), RATE_ALONE, r"has shape \(5, 5, 5\)"),
            (np.zeros((2000, 1500), "i1"), RATE_ALONE, "has 1500 columns; expected at most 1024"),
            (TABLE + 1j, RATE_ALONE, "is complex"),
        ],
    )
    def test_what_is_no_recording_is_refused(self, tmp_path, table, options, reason):
        np.save(tmp_path / "shot.npy", table)
        with pytest.raises(RecordingError, match=rf"^shot\.npy: .*{reason}"):
            open_recording(tmp_path / "shot.npy", options)

    def test_a_header_of_four_gigabytes_takes_no_memory(self, tmp_path):
        np.save(tmp_path / "shot.npy", TABLE)
        content = (tmp_path / "shot.npy").read_bytes()
        (tmp_path / "shot.npy").write_bytes(
            content[:6] + b"\x02\x00" + struct.pack("<I", 0xFFFFFFF0) + content[10:]
        )
        tracemalloc.start()
        try:
            with pytest.raises(RecordingError, match=r"^shot\.npy: damaged"):
                open_recording(tmp_path / "shot.npy", RATE_ALONE)
            assert tracemalloc.get_traced_memory()[1] < 1e7
        finally:
            tracemalloc.stop()

    @pytest.mark.parametrize("shape", ["(2305843009213693952,)", "(50, 4)", "(-5,)"])
    def test_another_shape_than_the_file_holds_is_refused(self, tmp_path, shape):
        content = io.BytesIO()
        np.save(content, TABLE)
        raw = content.getvalue().replace(b"(50, 3)", shape.encode().ljust(7)[: max(7, len(shape))])
        # the header's length grows with the shape
        grown = len(raw) - len(content.getvalue())
        raw = raw[:8] + struct.pack("<H", struct.unpack("<H", raw[8:10])[0] + grown) + raw[10:]
        (tmp_path / "shot.npy").write_bytes(raw)
        with pytest.raises(RecordingError, match=r"^shot\.npy: has \d+ bytes; shape"):
            open_recording(tmp_path / "shot.npy", RATE_ALONE)


@given(
    shape=st.tuples(st.integers(2, 40), st.integers(1, 5)).filter(
        lambda shape: shape[0] > shape[1]
    ),
    by_columns=st.booleans(),
    dtype=st.sampled_from(["f8", ">f4", "i2", "u1"]),
    bounds=st.tuples(st.integers(-50, 50), st.integers(-50, 50)),
)
def test_slices_of_columns_are_slices_of_the_matrix(
    tmp_path_factory, shape, by_columns, dtype, bounds
):
    table = np.arange(shape[0] * shape[1]).reshape(shape).astype(dtype)
    path = tmp_path_factory.mktemp("npy") / "shot.npy"
    np.save(path, np.asfortranarray(table) if by_columns else table)
    names = tuple(f"c{i}" for i in range(shape[1]))
    with open_recording(path, ReadingOptions(names, 1000.0)) as recording:
        for number, name in enumerate(names):
            np.testing.assert_array_equal(
                recording.read(name, *bounds), table[slice(*bounds), number]
            )


@pytest.mark.parametrize("compressed", [False, True], ids=["plain", "compressed"])
class TestStructures:
    def test_fields_are_channels_with_the_clock_beside_them(self, tmp_path, compressed):
        shot = {
            "fs": 51200.0,
            "force": TABLE[:, 0],
            "acc": TABLE[:, 1].astype("f4"),
            "operator": "Ana",
        }
        savemat(tmp_path / "shot.mat", {"shot": shot}, do_compression=compressed, oned_as="column")
        with open_recording(tmp_path / "shot.mat") as recording:
            facts = {c.name: (c.dtype, c.sampling_rate_hz) for c in recording.channels}
            assert facts == {"force": ("<f8", 51200.0), "acc": ("<f4", 51200.0)}
            for name in ("force", "shot.force", "shot/force"):
                np.testing.assert_array_equal(recording.read(name), TABLE[:, 0])
        shot = {"time": np.arange(50) / 1000 - 0.01, "bench": {"force": TABLE[:, 0]}}
        savemat(tmp_path / "shot.mat", {"shot": shot}, do_compression=compressed)
        with open_recording(tmp_path / "shot.mat") as recording:
            assert recording.info("shot.bench.force").sampling_rate_hz == 1000
            assert recording.info("force").start_s == -0.01
        parts = {"fs": 1000.0, "a": {"force": TABLE[:, 0]}, "b": {"force": TABLE[:, 1]}}
        savemat(tmp_path / "shot.mat", parts, do_compression=compressed)
        with open_recording(tmp_path / "shot.mat") as recording:
            assert [c.name for c in recording.channels] == ["a/force", "b/force"]
            np.testing.assert_array_equal(recording.read("b.force"), TABLE[:, 1])
        savemat(
            tmp_path / "shot.mat", {"shot": {"y": TABLE, "note": {}}}, do_compression=compressed
        )
        with open_recording(tmp_path / "shot.mat", NAMED) as recording:
            np.testing.assert_array_equal(recording.read("laser"), TABLE[:, 2])

    def test_fields_that_are_no_numbers_are_refused_and_rows_left_alone(self, tmp_path, compressed):
        cells = np.empty(2, dtype=object)
        cells[:] = [TABLE, "x"]
        shot = {
            "fs": 1000.0,
            "force": TABLE[:, 0],
            "wave": TABLE[:, 0] + 1j,
            "cells": cells,
            "none": np.empty(0),
        }
        savemat(tmp_path / "shot.mat", {"shot": shot}, do_compression=compressed)
        with open_recording(tmp_path / "shot.mat") as recording:
            assert [c.name for c in recording.channels] == ["force"]
            for name, reason in (
                ("shot.wave", "complex"),
                ("cells", "an object"),
                ("none", "empty"),
            ):
                with pytest.raises(RecordingError, match=f"{name.split('.')[-1]}' is {reason}"):
                    recording.read(name)
        rows = np.zeros((1, 2), dtype=[("force", object)])
        rows["force"] = [[TABLE[:, 0], TABLE[:, 1]]]
        contents = {"rows": rows, "fs": 1000.0, "force": TABLE[:, 2]}
        savemat(tmp_path / "shot.mat", contents, do_compression=compressed)
        with open_recording(tmp_path / "shot.mat") as recording:
            np.testing.assert_array_equal(recording.read("force"), TABLE[:, 2])
            with pytest.raises(RecordingError, match="'rows' is a MATLAB struct"):
                recording.read("rows")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (struct.pack("<II", 9, 400), struct.pack("<II", 9, 0xFFFFFFF0)),
        (struct.pack("<II", 9, 400), struct.pack("<II", 77, 400)),
        (struct.pack("<ii", 1, 50), struct.pack("<ii", 1, 2**30)),
        (struct.pack("<ii", 1, 50), struct.pack("<ii", 1, -50)),
        (struct.pack("<HHI", 5, 4, 6), struct.pack("<HHI", 5, 4, 0)),
        (struct.pack("<HHI", 5, 4, 6), struct.pack("<HHI", 5, 4, 0x7FFFFFFF)),
    ],
)
def test_a_false_count_within_a_structure_is_refused(tmp_path, old, new):
    path = tmp_path / "shot.mat"
    savemat(path, {"shot": {"fs": 1000.0, "force": TABLE[:, 0]}})
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))
    with pytest.raises(
        RecordingError, match=r"^shot\.mat: .*structure does not hold what it declares"
    ):
        open_recording(path)


def test_a_text_without_dimensions_is_refused(tmp_path):
    """Found by fuzzing: scipy ended the process."""
    path = tmp_path / "shot.mat"
    savemat(path, {"fs": 1000.0, "force": TABLE[:, 0]})
    flags, dimensions = struct.pack("<IIII", 6, 8, 4, 0), struct.pack("<II", 5, 0)
    name, text = struct.pack("<II4sI", 1, 4, b"note", 0), struct.pack("<HH4s", 16, 4, b"13.0")
    body = flags + dimensions + name + text
    path.write_bytes(path.read_bytes() + struct.pack("<II", 14, len(body)) + body)
    with pytest.raises(
        RecordingError, match=r"^shot\.mat: 'note' has 0 dimensions; expected two or more"
    ):
        open_recording(path)
