"""Field cases 01 to 04: absolute starts, x axes in ms or in hertz, and time stamps of TDMS
files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from nptdms import TdmsFile
from pyroshock.ingest.readers import RecordingError, open_recording

INPUTS = Path(__file__).parent / "inputs"
STARTS = INPUTS / "01-tdms-start-times"
STAMPS = INPUTS / "03-tdms-timestamps"


def test_channels_start_on_one_clock():
    """The event is at 12:00:00.010; the acceleration's record begins 4 ms after the force's."""
    with open_recording(STARTS / "hit.tdms") as recording:
        force, acceleration = recording.info("force"), recording.info("acceleration_1")
        peak_s = force.start_s + np.argmax(recording.read("force")) / force.sampling_rate_hz
        moved = np.flatnonzero(np.abs(recording.read("acceleration_1")) > 1e-6)
        onset_s = acceleration.start_s + moved[0] / acceleration.sampling_rate_hz
    assert acceleration.start_s - force.start_s == 0.004
    assert peak_s == pytest.approx(0.01025, abs=1e-5)
    assert onset_s == pytest.approx(0.010, abs=3e-5)


@pytest.mark.parametrize(
    "name", ["hit.tdms", "campaign/recordings/offset.tdms", "campaign/recordings/starttime.tdms"]
)
def test_starts_are_those_of_nptdms(name):
    channels = TdmsFile.read(STARTS / name)["bench"].channels()
    first = {
        channel.name: channel.time_track(absolute_time=True, accuracy="ns")[0]
        for channel in channels
    }
    with open_recording(STARTS / name) as recording:
        starts = {channel.name: channel.start_s for channel in recording.channels}
    origin = min(first.values())
    assert starts == {
        name: (time - origin) / np.timedelta64(1, "s") for name, time in first.items()
    }


def test_increment_in_ms():
    with open_recording(INPUTS / "02-tdms-x-in-ms" / "hit.tdms") as recording:
        assert recording.info("acceleration_1").sampling_rate_hz == 51200


@pytest.mark.parametrize("name", ["hit.tdms", "hit-no-increment.tdms"])
def test_time_stamps_are_a_clock_and_no_obstacle(name):
    with open_recording(STAMPS / name) as recording:
        assert [channel.name for channel in recording.channels] == ["acceleration_1"]
        assert recording.info("acceleration_1").sampling_rate_hz == 50000
        samples = recording.read("acceleration_1")
    assert np.array_equal(samples, TdmsFile.read(STAMPS / name)["bench"]["acceleration_1"][:])


def test_series_over_frequency_is_no_recording():
    with pytest.raises(
        RecordingError, match="wf_xname = 'Frequency' and wf_xunit_string = 'Hz', which is no time"
    ):
        open_recording(INPUTS / "04-tdms-spectrum" / "fft.tdms")
