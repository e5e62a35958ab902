"""Files of arrays: what stands beside the samples is used, or the channels that it concerns are
refused by its name."""

from __future__ import annotations

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording
from scipy.io import savemat

WAVE = np.round(1000.0 * np.sin(np.arange(1000) / 30.0))
FS_HZ = 10_000.0
TIMES_S = np.arange(1000) / FS_HZ


def npz(path, **arrays):
    np.savez(path.with_suffix(".npz"), **arrays)
    return path.with_suffix(".npz")


def mat(path, **arrays):
    savemat(path.with_suffix(".mat"), arrays)
    return path.with_suffix(".mat")


def structure(path, **arrays):
    savemat(path.with_suffix(".mat"), {"shot": arrays})
    return path.with_suffix(".mat")


def hdf5(path, **arrays):
    with h5py.File(path.with_suffix(".h5"), "w") as file:
        for name, value in arrays.items():
            file["shot/" + name] = value
    return path.with_suffix(".h5")


WRITERS = pytest.mark.parametrize("write", [npz, mat, structure, hdf5])


def channels(path, **options):
    with open_recording(path, ReadingOptions(**options)) as recording:
        return {c.name: (c.sampling_rate_hz, c.start_s, c.unit) for c in recording.channels}


@WRITERS
def test_texts_beside_the_samples_are_their_units(write, tmp_path):
    path = write(
        tmp_path / "a", force=WAVE, t=TIMES_S * 1e3, t_unit="ms", force_unit="kN", operator="Ana"
    )
    assert channels(path) == {"force": (FS_HZ, 0.0, "kN")}
    path = write(tmp_path / "b", force=WAVE, fs=FS_HZ, unit="kN")
    assert channels(path) == {"force": (FS_HZ, 0.0, "kN")}
    with pytest.raises(RecordingError, match="'t' is in 'furlong'; expected one of s, ms"):
        channels(write(tmp_path / "c", force=WAVE, t=TIMES_S, time_unit="furlong"))
    with pytest.raises(
        RecordingError, match="'t_ms' is in 'ms' by its name, in 's' by 'time_unit'"
    ):
        channels(write(tmp_path / "d", force=WAVE, t_ms=TIMES_S, time_unit="s"))


@WRITERS
@pytest.mark.parametrize(
    "beside", [{"gain": 10.0}, {"offset_v": 0.2}, {"scale": 0.25}, {"dt": 2e-4}, {"t0": 1.0}]
)
def test_a_scalar_that_may_change_a_number_is_refused(write, beside, tmp_path):
    ((name, value),) = beside.items()
    path = write(tmp_path / "a", force=WAVE, fs=FS_HZ, **beside)
    with pytest.raises(
        RecordingError, match=f"'force' has the field '{name}' = {value}.*--harmless-field"
    ):
        channels(path)
    assert list(channels(path, harmless_fields=(name,))) == ["force"]


@WRITERS
def test_scalars_that_say_nothing_of_the_numbers_are_no_obstacle(write, tmp_path):
    path = write(
        tmp_path / "a",
        force=WAVE,
        fs=FS_HZ,
        gain=1.0,
        dt=1e-4,
        temperature=21.5,
        shot=7,
        offset_v=0.0,
    )
    assert list(channels(path)) == ["force"]


@WRITERS
def test_a_scalar_of_one_channel_costs_that_channel_alone(write, tmp_path):
    path = write(tmp_path / "a", force=WAVE, acceleration=WAVE, fs=FS_HZ, force_gain=10.0)
    assert list(channels(path)) == ["acceleration"]


def test_a_mask_beside_the_samples_is_no_matter_of_taste(tmp_path):
    with pytest.raises(RecordingError, match=r"force_mask = 1; it marks samples"):
        channels(npz(tmp_path / "a", force=WAVE, fs=FS_HZ, force_mask=np.arange(1000) == 5))
    assert "force" in channels(
        npz(tmp_path / "b", force=WAVE, fs=FS_HZ, force_mask=np.zeros(1000, bool))
    )


@pytest.mark.parametrize(
    "times", [np.datetime64("2026-03-01T10:00:00", "us") + (TIMES_S * 1e6).round().astype("m8[us]"),
              (TIMES_S * 1e9).round().astype("m8[ns]")],
)  # fmt: skip
def test_dates_and_durations_are_time(times, tmp_path):
    assert channels(npz(tmp_path / "a", force=WAVE, time=times)) == {"force": (FS_HZ, 0.0, None)}
    table = pa.table({"force": pa.array(WAVE), "time": pa.array(times)})
    pq.write_table(table, tmp_path / "a.parquet")
    assert channels(tmp_path / "a.parquet") == {"force": (FS_HZ, 0.0, None)}
    frame = pd.DataFrame({"force": WAVE}, index=pd.Index(times))
    frame.to_parquet(tmp_path / "b.parquet")
    assert channels(tmp_path / "b.parquet") == {"force": (FS_HZ, 0.0, None)}
    structured = np.empty(1000, dtype=[("time", times.dtype), ("force", "f8")])
    structured["time"], structured["force"] = times, WAVE
    np.save(tmp_path / "a.npy", structured)
    assert channels(tmp_path / "a.npy") == {"force": (FS_HZ, 0.0, None)}


class TestPacked:
    """Against hand arithmetic: value = stored * scale_factor + add_offset."""

    @pytest.fixture
    def packed(self, tmp_path):
        def write(stored, **attributes):
            with h5py.File(tmp_path / "a.h5", "w") as file:
                file["force"] = stored
                file.attrs["fs"] = FS_HZ
                file["force"].attrs.update(attributes)
            with open_recording(tmp_path / "a.h5") as recording:
                return recording.read("force"), recording.read("force", 10, 20)

        return write

    def test_scale_and_offset(self, packed):
        values, part = packed(WAVE.astype(np.int16), scale_factor=0.25, add_offset=-3.0)
        np.testing.assert_array_equal(values, WAVE * 0.25 - 3.0)
        np.testing.assert_array_equal(part, values[10:20])

    @pytest.mark.parametrize(
        ("attributes", "lost"),
        [
            ({"_FillValue": np.int16(-999)}, WAVE == -999),
            ({"missing_value": np.array([-999, -998], np.int16)}, np.isin(WAVE, (-999, -998))),
            ({"valid_min": np.int16(-500)}, WAVE < -500),
            ({"valid_max": np.int16(500)}, WAVE > 500),
            ({"valid_range": np.array([-500, 500], np.int16)}, np.abs(WAVE) > 500),
        ],
    )
    def test_fills_and_limits_are_of_stored_numbers(self, packed, attributes, lost):
        values, _ = packed(WAVE.astype(np.int16), scale_factor=2.0, **attributes)
        np.testing.assert_array_equal(np.isnan(values), lost)
        np.testing.assert_array_equal(values[~lost], 2.0 * WAVE[~lost])

    def test_bits_without_a_sign(self, packed):
        values, _ = packed(np.arange(1000).astype(np.uint8).view(np.int8), _Unsigned="true")
        np.testing.assert_array_equal(values, np.arange(1000) % 256)

    def test_what_is_no_packing_is_refused(self, packed):
        with pytest.raises(RecordingError, match="scale_factor = 'a quarter'; expected a number"):
            packed(WAVE, scale_factor="a quarter")
        with pytest.raises(
            RecordingError, match="cell_methods = 'time: mean'; the samples are computed"
        ):
            packed(WAVE, cell_methods="time: mean")

    def test_samples_without_packing_keep_their_type(self, packed):
        values, _ = packed(WAVE.astype(np.float32), long_name="contact force", units="N")
        assert values.dtype == np.float32


class TestHdf5Axes:
    def write(self, path, step_s, unit, name="t_fast"):
        with h5py.File(path, "w") as file:
            for dataset, axis, step, size in (
                ("force", name, step_s, 1000),
                ("slow", "t_slow", 1e-2, 100),
            ):
                file[dataset] = WAVE[:size]
                file[axis] = np.arange(size) * step + 0.5
                file[axis].attrs["units"] = unit
                file[axis].make_scale(axis)
                file[dataset].dims[0].attach_scale(file[axis])
        return path

    def test_each_data_set_has_the_time_of_its_dimension_scale(self, tmp_path):
        channel_infos = channels(self.write(tmp_path / "a.h5", 1e-4, "s"))
        assert channel_infos["force"] == (FS_HZ, 0.5, None) and channel_infos["slow"] == (
            100.0,
            0.5,
            None,
        )

    def test_a_scale_that_is_no_time_is_refused(self, tmp_path):
        with pytest.raises(
            RecordingError, match="'force' is over 't_fast' in 'Hz', which is no time"
        ):
            channels(self.write(tmp_path / "a.h5", 10.0, "Hz"))

    def test_seconds_since_a_date_are_seconds(self, tmp_path):
        path = self.write(tmp_path / "a.h5", 0.1, "milliseconds since 2026-01-01 00:00:00")
        assert channels(path)["force"][0] == FS_HZ

    def test_enumerations_bits_and_unwritten_pieces_are_refused(self, tmp_path):
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file.attrs["fs"] = FS_HZ
            file["force"] = WAVE
            file.create_dataset(
                "state", data=np.arange(1000) % 2, dtype=h5py.enum_dtype({"off": 0, "on": 1})
            )
        with open_recording(tmp_path / "a.h5") as recording:
            assert [channel.name for channel in recording.channels] == ["force"]
            with pytest.raises(RecordingError, match="'state' is an enumeration"):
                recording.read("state")
        with h5py.File(tmp_path / "b.h5", "w") as file:
            file.attrs["fs"] = FS_HZ
            file.create_dataset("force", (4000,), "f8", chunks=(500,))[:1000] = WAVE
        with pytest.raises(RecordingError, match="'force' was never written in 6 of its 8 pieces"):
            channels(tmp_path / "b.h5")


class TestParquet:
    def test_an_index_without_a_name_is_held_against_the_rate(self, tmp_path):
        frame = pd.DataFrame({"force": WAVE}, index=TIMES_S)
        frame.to_parquet(tmp_path / "a.parquet")
        assert channels(tmp_path / "a.parquet", sampling_rate_hz=FS_HZ) == {
            "force": (FS_HZ, 0.0, None)
        }
        with pytest.raises(
            RecordingError, match=r"has a sampling rate of 10000\.0 Hz, and 5000\.0 Hz is given"
        ):
            channels(tmp_path / "a.parquet", sampling_rate_hz=5000.0)
        with pytest.raises(RecordingError, match="no sampling rate"):
            channels(tmp_path / "a.parquet")

    def test_a_range_that_is_named_time_is_time(self, tmp_path):
        frame = pd.DataFrame({"force": WAVE}, index=pd.RangeIndex(0, 100_000, 100, name="time_us"))
        frame.to_parquet(tmp_path / "a.parquet")
        assert channels(tmp_path / "a.parquet") == {"force": (FS_HZ, 0.0, None)}

    def test_metadata_that_may_change_a_number_and_decimals_are_refused(self, tmp_path):
        schema = pa.schema(
            [pa.field("force", pa.float64(), metadata={"unit": "V", "scale": "0.25"})],
            {"fs": "10000"},
        )
        pq.write_table(pa.table({"force": WAVE}, schema=schema), tmp_path / "a.parquet")
        with pytest.raises(RecordingError, match=r"'force' has the field 'scale' = '0\.25'"):
            channels(tmp_path / "a.parquet")
        table = pa.table({"force": pa.array(WAVE).cast(pa.decimal128(10, 2)), "time": TIMES_S})
        pq.write_table(table, tmp_path / "b.parquet")
        with pytest.raises(
            RecordingError, match=r"'force' is of the type decimal128\(10, 2\); save it as float64"
        ):
            channels(tmp_path / "b.parquet")
