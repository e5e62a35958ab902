"""MATLAB objects, sparse matrices and structures, packed HDF5 (field cases 09, 10, 11 and 32)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyroshock as ps
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording

INPUTS = Path(__file__).parent / "inputs"
#: The shock of cases 09 to 11 and that of case 32: peak and trough as written (m/s2).
PEAK, TROUGH = 4738.0663649354265, -4461.28636049166
PEAK_32, TROUGH_32 = 3875.843109250044, -3628.2095514101375


def opened(name: str):
    return open_recording(INPUTS / name)


@pytest.mark.parametrize(
    ("file", "message"),
    [
        (
            "09-mat73-objects/timeseries.mat",
            r"'acceleration_1' is a MATLAB timeseries; save it with struct.* or as a vec",
        ),
        ("09-mat73-objects/table.mat", "'shot' is a MATLAB table; save it with struct"),
        ("09-mat73-objects/duration-time.mat", "'t' is a MATLAB duration; save it"),
        (
            "10-mat73-logical-sparse/logical.mat",
            "'acceleration_1' is a logical array; save it with double",
        ),
        (
            "11-hdf5-packed/gain.h5",
            r"'acceleration_1' has the field 'gain' = 0\.25, .*apply it.*--harmless-field",
        ),
    ],
)
def test_what_holds_no_samples_is_refused_by_name_and_class(file, message):
    with pytest.raises(RecordingError, match=message):
        opened(file)


def test_an_object_beside_the_samples_costs_itself_alone():
    with opened("09-mat73-objects/string-beside.mat") as recording:
        samples = recording.read("acceleration_1")
        assert (samples.size, samples.max(), samples.min()) == (2048, PEAK, TROUGH)
        with pytest.raises(RecordingError, match="'note' is a MATLAB string"):
            recording.read("note")


def test_a_sparse_vector_has_its_zeros():
    with opened("10-mat73-logical-sparse/sparse.mat") as recording:
        samples = recording.read("acceleration_1")
        assert (samples.size, samples.max(), samples.min()) == (2048, PEAK, TROUGH)
        assert np.count_nonzero(samples) == 1791


def test_packed_whole_numbers_are_unpacked():
    with opened("11-hdf5-packed/hit.h5") as recording:
        assert (recording.info("acceleration_1").unit, recording.read("acceleration_1").max()) == (
            "m/s2",
            4738.0,
        )


def test_fill_values_are_no_numbers():
    import h5py

    with (
        opened("11-hdf5-packed/fill.h5") as recording,
        h5py.File(INPUTS / "11-hdf5-packed/fill.h5") as file,
    ):
        values, packed = recording.read("acceleration_1"), file["acceleration_1"]
        attributes = {key: float(v) for key, v in packed.attrs.items() if not isinstance(v, str)}
        stored = packed[()].astype(np.float64)
    fill = attributes["_FillValue"]
    by_hand = stored * attributes["scale_factor"] + attributes.get("add_offset", 0.0)
    assert np.isnan(values[stored == fill]).all() and (stored == fill).any()
    np.testing.assert_array_equal(values[stored != fill], by_hand[stored != fill])


def test_a_campaign_of_a_matlab_timeseries_is_refused_by_its_class(tmp_path):
    with (
        ps.open(tmp_path / "lab.db") as store,
        pytest.raises(ps.PyroshockError, match="is a MATLAB timeseries"),
    ):
        store.ingest(INPUTS / "09-mat73-objects" / "campaign", jobs=1, progress=False)


def test_a_campaign_of_packed_files_has_the_right_peaks_and_sets_uneven_time_aside(tmp_path):
    """Peaks are 4738 m/s2 (483 g) above a rest of nothing, and 2000 N."""
    with ps.open(tmp_path / "lab.db") as store:
        store.ingest(INPUTS / "11-hdf5-packed" / "campaign", jobs=1, progress=False)
        impacts = store.impacts()
    assert impacts["run"].tolist() == [1, 3]
    assert impacts["peak_acceleration_m_s2"].to_numpy() == pytest.approx([4738.0] * 2, rel=2e-3)
    assert impacts["peak_force_n"].to_numpy() == pytest.approx([2000.0] * 2, rel=2e-3)


@pytest.mark.parametrize(
    ("file", "channel", "rate_hz", "start_s", "unit"),
    [
        ("time_in_ms.mat", "acceleration_1", 50_000.0, 0.0, None),
        ("picoscope.mat", "A", 50_000.0, -1e-3, None),
        (
            "testlab.mat",
            "values",
            50_000.0,
            0.0,
            None,
        ),  # its label can be the unit of the display alone
        ("dewesoft.mat", "Data1_AI_1", 50_000.0, 0.0, None),
    ],
)
def test_structures_of_instruments_have_their_rate_start_and_unit(
    file, channel, rate_hz, start_s, unit
):
    with opened(f"32-testlab-mat/{file}") as recording:
        info, samples = recording.info(channel), recording.read(channel)
    assert info.sampling_rate_hz == pytest.approx(rate_hz, rel=1e-9)
    assert (info.start_s, info.unit, samples.size) == (start_s, unit, 2000)
    assert (samples.max(), samples.min()) == pytest.approx((PEAK_32, TROUGH_32), rel=1e-6)


def test_a_step_of_no_stated_unit_is_no_rate():
    with pytest.raises(
        RecordingError, match=r"no sampling rate; expected fs in hertz.*sampling_rate_hz under"
    ):
        opened("32-testlab-mat/dt.mat")
