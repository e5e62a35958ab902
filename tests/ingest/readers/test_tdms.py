"""What TDMS properties say of time, scale and unit: each is used, or the channel is refused with
the property."""

from __future__ import annotations

import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from pyroshock.ingest.readers import ReadingOptions, RecordingError, open_recording

NOON = np.datetime64("2026-03-02T12:00:00.000000", "us")
FORCE = np.arange(100.0)
STEP = {"wf_increment": 2e-5}


def us(count):
    return np.timedelta64(count, "us")


@pytest.fixture
def written(tmp_path):
    """Writes one segment a list of channels (name, samples, properties); gives the path."""

    def write(*segments, file=None, group=None):
        path = tmp_path / "shot.tdms"
        with TdmsWriter(path) as writer:
            for number, channels in enumerate(segments):
                parts = [
                    ChannelObject("bench", name, values, properties)
                    for name, values, properties in channels
                ]
                above = (
                    [RootObject(file or {}), GroupObject("bench", group or {})]
                    if number == 0
                    else []
                )
                writer.write_segment([*above, *parts])
        return path

    return write


def facts(path, name="force", options=None):
    with open_recording(path, options or ReadingOptions()) as recording:
        info = recording.info(name)
        return info.sampling_rate_hz, info.start_s, info.header.get("time_gaps")


def refusal(path, name="force", options=None):
    with (
        pytest.raises(RecordingError) as error,
        open_recording(path, options or ReadingOptions()) as recording,
    ):
        recording.info(name)
    return str(error.value)


@pytest.mark.parametrize(
    ("properties", "rate", "start"),
    [
        ({"wf_increment": 0.02, "wf_xunit_string": "ms", "wf_start_offset": -5.0}, 50000, -0.005),
        ({"wf_increment": 20.0, "wf_xunit_string": "us", "wf_xname": "Zeit"}, 50000, 0),
        ({"wf_increment": 20000, "wf_xunit_string": "ns"}, 50000, 0),
        ({"wf_increment": 2e-5, "wf_xunit_string": "s", "wf_xname": "Time"}, 50000, 0),
        ({"wf_increment": 2e-5, "wf_xunit_string": "", "wf_xname": "Time"}, 50000, 0),
        ({"wf_increment": 2e-5, "wf_xname": "Temps"}, 50000, 0),
        ({"wf_increment": 2e-5 / 60, "wf_xunit_string": "min"}, 50000, 0),
        ({"Sampling_Rate": 50000}, 50000, 0),
        ({"wf_increment": 2e-5, "fs": 50000.0}, 50000, 0),
    ],
)
def test_x_axis_in_its_unit(written, properties, rate, start):
    rate_read, start_read, _ = facts(written([("force", FORCE, properties)]))
    assert rate_read == pytest.approx(rate, rel=1e-9) and start_read == pytest.approx(start)


@pytest.mark.parametrize(
    ("properties", "reason"),
    [
        (
            {"wf_increment": 25.0, "wf_xunit_string": "Hz"},
            "wf_xunit_string = 'Hz', which is no time",
        ),
        (
            {"wf_increment": 25.0, "wf_xname": "Frequency"},
            "wf_xname = 'Frequency' and wf_xunit_string = ''",
        ),
        (
            {"wf_increment": 1.0, "wf_xname": "Angle", "wf_xunit_string": "deg"},
            "wf_xname = 'Angle'",
        ),
        ({"wf_increment": 0.1, "wf_xunit_string": "mm"}, "wf_xunit_string = 'mm'"),
        ({"wf_increment": -1.0}, "wf_increment = -1.0; expected a step above 0"),
        (
            {"wf_increment": 2e-5, "fs": 51200.0},
            "a wf_increment of 50000 Hz and states a sampling rate of 51200",
        ),
        ({"wf_increment": 2e-5, "Sample Rate": 1000.0}, "the field 'Sample Rate' = 1000.0"),
        ({"wf_increment": 2e-5, "Gain": 2.0}, "the field 'Gain' = 2.0"),
        (
            {"wf_increment": 2e-5, "Scale_Coeff_c0": 168610.0},
            "the field 'Scale_Coeff_c0' = 168610.0",
        ),
        ({"wf_increment": 2e-5, "NI_function_type": "spectrum"}, "NI_function_type = 'spectrum'"),
        (
            {"wf_increment": 2e-5, "unit_string": "N", "Unit": "lbf"},
            "unit_string = 'N' and unit = 'lbf'",
        ),
    ],
)
def test_what_changes_a_number_is_refused(written, properties, reason):
    assert reason in refusal(written([("force", FORCE, properties), ("acc", FORCE, STEP)]))


def test_properties_of_ordinary_files_pass(written):
    """As LabVIEW, DAQmx, FlexLogger and DIAdem write them."""
    channel = {
        **STEP, "wf_start_time": NOON, "wf_start_offset": 0.0, "wf_samples": 1, "wf_xname": "Time",
        "wf_xunit_string": "s", "wf_time_pref": "relative", "unit_string": "V",
        "NI_UnitDescription": "Volts",
        "NI_ChannelName": "Dev1/ai0", "minimum": -1.0, "maximum": 99.0, "monotony": "not monotone",
        "novaluekey": "No", "displaytype": "Numeric", "description": "", "Gain": 1.0, "Offset": 0,
        "Sensor sensitivity": 10.2, "Range": 10.0, "Coupling": "AC", "Sample Rate": 50000.0,
        "Date": "2026-03-02",
    }  # fmt: skip
    file = {
        "name": "shot",
        "Author": "Ana",
        "DateTime": NOON,
        "Test start": "12:00",
        "Unit Under Test": "STM-2",
    }
    path = written(
        [("force", FORCE, channel)], file=file, group={"description": "Calibration due 2027"}
    )
    with open_recording(path) as recording:
        assert recording.info("force").unit == "V"
        assert np.array_equal(recording.read("force"), FORCE)


@pytest.mark.parametrize(
    ("unit", "description"), [("m/s^2", "m/s2"), ("g", "Acceleration"), ("V", "Volts"), ("N", "")]
)
def test_description_of_the_unit_that_does_not_contradict_passes(written, unit, description):
    path = written(
        [("force", FORCE, {**STEP, "unit_string": unit, "NI_UnitDescription": description})]
    )
    with open_recording(path) as recording:
        assert recording.info("force").unit == unit


def test_field_of_the_file_is_refused_and_can_be_called_harmless(written):
    path = written([("force", FORCE, STEP)], file={"Scale factor": 4.448})
    assert "the file has the field 'Scale factor' = 4.448" in refusal(path)
    assert facts(path, options=ReadingOptions(harmless_fields=("scale *",)))[0] == 50000


def test_scales_are_applied_as_npTDMS_does(written):
    """NI: scaled = raw * slope + intercept; a scale of the group holds for its channels."""
    scale = {
        "NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled",
        "NI_Scale[0]_Scale_Type": "Linear",
        "NI_Scale[0]_Linear_Slope": 0.5, "NI_Scale[0]_Linear_Y_Intercept": -1.0,
        "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
    }  # fmt: skip
    raw = np.arange(100, dtype=np.int16)
    for path in (
        written([("force", raw, {**STEP, **scale})]),
        written([("force", raw, STEP)], group=scale),
    ):
        with open_recording(path) as recording:
            assert np.array_equal(recording.read("force"), raw * 0.5 - 1.0)
    done = written([("force", raw, {**STEP, **scale, "NI_Scaling_Status": "scaled"})])
    with open_recording(done) as recording:
        assert np.array_equal(recording.read("force"), raw)


@pytest.mark.parametrize("late_us", [20, 4000, 61_000_000])
def test_start_time_and_offset_add_up(written, late_us):
    later = {**STEP, "wf_start_time": NOON + us(late_us), "wf_start_offset": -0.001}
    path = written([("force", FORCE, {**STEP, "wf_start_time": NOON}), ("acc", FORCE, later)])
    assert facts(path)[1] == 0.0
    assert facts(path, "acc")[1] == pytest.approx(late_us * 1e-6 - 0.001, abs=1e-12)


def test_channel_without_start_time_cannot_be_compared(written):
    zero = np.datetime64("1904-01-01T00:00:00", "us")  # LabVIEW's time stamp that was never set
    for properties in (STEP, {**STEP, "wf_start_time": zero}):
        path = written(
            [("force", FORCE, {**STEP, "wf_start_time": NOON}), ("acc", FORCE, properties)]
        )
        assert facts(path)[1] == 0.0
        assert "'acc' has no wf_start_time, and 'force' has one" in refusal(path, "acc")
        assert facts(path, "acc", ReadingOptions(harmless_fields=("wf_start_time",)))[1] == 0.0


def test_channels_that_all_lack_a_start_time_start_together(written):
    path = written([("force", FORCE, STEP), ("acc", FORCE, {**STEP, "wf_start_offset": 0.004})])
    assert (facts(path)[1], facts(path, "acc")[1]) == (0.0, 0.004)


def test_time_stamps_that_contradict_are_refused(written):
    stamps = NOON + us(25) * np.arange(100)
    path = written([("Time", stamps, {}), ("force", FORCE, STEP), ("acc", FORCE, {})])
    assert "wf_increment of 50000 Hz, and the time stamps 'Time' beside it are 40000 Hz" in refusal(
        path
    )
    assert facts(path, "acc")[0] == 40000
    start = {"wf_increment": 2.5e-5, "wf_start_time": NOON + us(700)}
    assert "by wf_start_time and at" in refusal(
        written([("Time", stamps, {}), ("force", FORCE, start)])
    )


def test_time_stamps_with_a_gap_or_of_uneven_steps(written):
    count = np.r_[np.arange(50), np.arange(150, 200)]
    path = written([("Time", NOON + us(20) * count, {}), ("force", FORCE, {"unit_string": "N"})])
    assert facts(path) == (50000, 0.0, [[50, 100]])
    uneven = NOON + np.cumsum(np.where(np.arange(100) < 40, 20, 25)).astype("m8[us]")
    assert "its time has two rates, 50000 Hz" in refusal(
        written([("Time", uneven, {}), ("force", FORCE, {})])
    )


def test_time_stamps_place_channels_on_the_clock_of_the_waveforms(written):
    stamps = NOON + us(4000) + us(20) * np.arange(60)
    path = written(
        [
            ("Time", stamps, {}),
            ("slow", FORCE[:60], {}),
            ("force", FORCE, {**STEP, "wf_start_time": NOON}),
        ]
    )
    assert facts(path, "slow")[:2] == (50000, pytest.approx(0.004))


def test_numeric_time_beside_a_waveform_is_compared(written):
    path = written([("Time", np.arange(100) / 40000, {}), ("force", FORCE, STEP)])
    assert "states 50000 Hz, which the time beside it contradicts: it gives 40000 Hz" in refusal(
        path
    )
    assert (
        facts(written([("Time", np.arange(100) / 50000, {}), ("force", FORCE, STEP)]))[0] == 50000
    )


def test_writes_with_starts_of_their_own(written):
    first = ("force", FORCE, {**STEP, "wf_start_time": NOON})
    again = (
        "force",
        FORCE,
        {**STEP, "wf_start_time": NOON},
    )  # repeated by some writers, and not moved on
    following = ("force", FORCE, {**STEP, "wf_start_time": NOON + us(2000)})
    late = ("force", FORCE, {**STEP, "wf_start_time": NOON + us(5000)})
    early = ("force", FORCE, {**STEP, "wf_start_time": NOON + us(1000)})
    assert facts(written([first], [again])) == (50000, 0.0, None)
    assert facts(written([first], [following])) == (50000, 0.0, None)
    assert facts(written([first], [late])) == (50000, 0.0, [[100, 150]])
    assert "starts again 0.001 s after its start, at sample 100" in refusal(
        written([first], [early])
    )


@pytest.mark.parametrize(
    ("name", "value"),
    [("wf_increment", 1e-5), ("unit_string", "lbf"), ("NI_Scale[0]_Linear_Slope", 3.0)],
)
def test_property_that_changes_within_the_file_is_refused(written, name, value):
    start = {**STEP, "unit_string": "N", "NI_Scale[0]_Linear_Slope": 2.0}
    path = written([("force", FORCE, start)], [("force", FORCE, {**start, name: value})])
    assert f"has {name} = {start[name]!r} up to sample 100 and {value!r} from there on" in refusal(
        path
    )
