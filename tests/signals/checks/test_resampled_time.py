"""A record that was put on an even grid says so, as gravely as the interpolation errs."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.channel import Channel, Sensor
from pyroshock.signals.checks import run_checks
from pyroshock.signals.checks.resampled_time import check_resampled_time


def channel_with(**header):
    return Channel(Sensor("acc", "acceleration", "m/s2"), np.zeros(8), 58000.0, 0.0, header)


@pytest.mark.parametrize(
    ("share", "severity"), [(0.0, "note"), (0.01, "note"), (0.09, "warning"), (0.11, "reject")]
)
def test_severity_follows_the_error(share, severity):
    facts = {
        "samples": 8,
        "shortest_step_s": 1.7e-5,
        "longest_step_s": 2.5e-5,
        "error_share_of_peak": share,
    }
    (finding,) = check_resampled_time(channel_with(resampled_time=facts), ())
    assert (finding.check, finding.severity, finding.evidence) == (
        "resampled-time",
        severity,
        facts,
    )
    assert (
        f"at most {100 * share:.2g} % of the peak" in finding.message
        and "58000 Hz" in finding.message
    )
    assert finding in run_checks(channel_with(resampled_time=facts), ())


def test_even_record_has_no_finding():
    assert check_resampled_time(channel_with(), ()) == []
