"""Several files of one recording: each says when it starts, and their channels are on one clock."""

from __future__ import annotations

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from pyroshock.ingest.readers.recording_files import RecordingFiles

NOON = np.datetime64("2026-03-02T12:00:00.000000", "us")


def write(path, name, start=None):
    properties = {"wf_increment": 2e-5, **({} if start is None else {"wf_start_time": start})}
    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("bench", name, np.arange(100.0), properties)])


@pytest.mark.parametrize(
    ("force", "acceleration", "starts"),
    [
        (NOON, NOON + np.timedelta64(4, "ms"), (0.0, 0.004)),
        (NOON + np.timedelta64(61, "s"), NOON, (61.0, 0.0)),
        (NOON, NOON, (0.0, 0.0)),
        (NOON, None, (0.0, 0.0)),  # nothing is known of the other: they begin together
    ],
)
def test_files_start_by_their_absolute_times(tmp_path, force, acceleration, starts):
    write(tmp_path / "force.tdms", "force", force)
    write(tmp_path / "acc.tdms", "acc", acceleration)
    with RecordingFiles(tmp_path, "acc.tdms;force.tdms").open() as recording:
        assert (recording.info("force").start_s, recording.info("acc").start_s) == starts
        assert {channel.name: channel.start_s for channel in recording.channels} == dict(
            zip(("force", "acc"), starts, strict=True)
        )
