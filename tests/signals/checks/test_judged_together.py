"""The channels of one recording: each event is told once, and a quiet cross-axis is no fault."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.extraction.record_checks import check_recording
from pyroshock.ingest.extraction.recording import hits_of
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.signals.channel import Channel, Sensor

RATE_HZ = 51200.0
N = 12000


def judge(*channels):
    return check_recording(list(channels), hits_of(list(channels), ExtractionSettings(), None))


def channel(name, x, quantity="acceleration", **more):
    units = {"acceleration": "m/s2", "force": "N", "pressure": "Pa"}
    return Channel(Sensor(name, quantity, units[quantity], **more), np.asarray(x), RATE_HZ)


def noise(scale=1.0, seed=0):
    return np.random.default_rng(seed).normal(scale=scale, size=N)


def hit():
    x = noise(0.1)
    x[2000:2060] += 1000.0 * np.sin(np.pi * np.arange(60) / 60.0)
    return channel("force", x, "force")


def ringing(height=1000.0, seed=1):
    t = np.maximum(np.arange(N) - 2000, 0)
    return height * np.exp(-t / 400.0) * np.sin(0.2 * t) + noise(seed=seed)


def doubts(findings):
    return [(f.check, f.channel, f.severity) for f in findings if f.severity != "note"]


@pytest.mark.parametrize(
    ("loud", "quiet"),
    [
        (
            {"name": "a1", "position": "plate", "axis": "z"},
            {"name": "a2", "position": "plate", "axis": "x"},
        ),
        ({"name": "acc_z"}, {"name": "acc_x"}),
    ],
    ids=["axes declared", "axes in names"],
)
@pytest.mark.parametrize("share", [0.0, 0.02])
def test_quiet_cross_axis_is_a_note(loud, quiet, share):
    findings = judge(
        hit(), channel(x=ringing(), **loud), channel(x=ringing(1000.0 * share, seed=2), **quiet)
    )
    assert doubts(findings) == []
    (note,) = [
        f
        for f in findings
        if f.channel == quiet["name"] and f.check in ("no-shock", "pre-trigger-noise")
    ]
    assert loud["name"] in note.message


def test_silent_sensor_elsewhere_and_tank_at_its_sensor_s_range_are_rejected():
    elsewhere = channel("b", noise(seed=3), position="frame")
    assert doubts(judge(hit(), channel("a", ringing(), position="plate"), elsewhere)) == [
        ("no-shock", "b", "reject")
    ]
    x = np.minimum(6e5 + 1e5 * np.sin(np.arange(N) / 900.0), 6.5e5)
    assert ("saturation", "tank", "reject") in doubts(
        judge(channel("tank", x, "pressure", range=6.5e5))
    )


@pytest.mark.parametrize(
    ("channels", "expected"),
    [
        (channel("force", noise(), "force"), ("no-contact", "force", "reject")),
        # at its declared range the top is flat as well
        (
            channel("force", np.minimum(hit().si, 600.0), "force", range=600.0),
            ("saturation", "force", "reject"),
        ),
        (channel("a", np.full(N, 3.0)), ("dropouts", "a", "reject")),
    ],
    ids=["no contact", "full scale", "one value"],
)
def test_fault_is_told_once(channels, expected):
    assert doubts(judge(channels)) == [expected]


def test_noise_is_told_once_with_its_notes():
    assert [(f.check, f.severity) for f in judge(channel("a", noise()))] == [("no-shock", "reject")]


@pytest.mark.parametrize("level", [2e5, 5.5e5])
@pytest.mark.parametrize("ripple", [0.0, 20.0, 400.0])
@pytest.mark.parametrize("fall", [0.0, 0.4])
def test_tank_that_holds_its_pressure_is_right(level, ripple, fall):
    """Until the valve opens, or all the time; through a converter of 14 bits for 10 bar."""
    t = np.arange(N)
    x = level * (1.0 - fall * (1.0 - np.exp(-np.maximum(t - 7000, 0) / 600.0))) + noise(ripple)
    step = 10e5 / 2**14
    assert doubts(judge(channel("tank", np.round(x / step) * step, "pressure"))) == []
