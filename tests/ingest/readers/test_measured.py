"""Measured records of others, and the campaigns given as examples."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.readers import open_recording


def test_a_modal_hammer_hit_from_labview(real_data):
    """Published with it: 50 kHz, 50030 samples, decimal comma, 195.6 N, +35.5 and -27.8 g."""
    with open_recording(real_data / "ladisk-imac-tutorial" / "acceleration.lvm") as recording:
        assert [(c.unit, c.samples, c.sampling_rate_hz, c.start_s) for c in recording.channels] == [
            ("g", 50030, 50000.0, 0.0),
            ("Newtons", 50030, 50000.0, 0.0),
        ]
        acceleration, force = (recording.read(c.name) for c in recording.channels)
    assert force.max() == pytest.approx(195.6, abs=0.05)
    assert (acceleration.max(), acceleration.min()) == (pytest.approx(35.5, abs=0.05), pytest.approx(-27.8, abs=0.05))
    assert (acceleration[0], force[-1]) == (-0.007387, pytest.approx(force[-1]))


def test_the_example_campaigns_open_with_what_scipy_reads(shared):
    from scipy.io import loadmat

    first = sorted(shared.glob("examples/*/recordings/0001.mat"))
    assert len(first) == 2
    for path in first:
        peer = loadmat(path)
        with open_recording(path) as recording:
            for channel in recording.channels:
                assert channel.sampling_rate_hz == peer["fs"].item()
                np.testing.assert_array_equal(recording.read(channel.name), peer[channel.name].reshape(-1))
            assert {c.name for c in recording.channels} == {n for n in peer if not n.startswith("__")} - {"fs"}
