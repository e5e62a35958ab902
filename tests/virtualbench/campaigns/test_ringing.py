"""Blows and the closed form between them are what the whole recording on the fine grid would be."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns.ringing import blow, ringing_accelerations
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.plate.modes import PlateModes
from pyroshock.virtualbench.sensors import SensorBuild, analog
from scipy.signal import cont2discrete, lfilter

FS_HZ, RATIO = 51_200.0, 20
SENSORS = tuple(
    SensorBuild(f"a{i}", "acceleration", "m/s2", 1e5, mount_resonance_hz=45e3) for i in (1, 2)
)
MODES = PlateModes(
    np.array([0.0, 3.0, 231.0, 4000.0, 17_000.0]),
    np.array([0.0, 0.005, 0.004, 0.003, 0.01]),
    np.array([[0.3, 0.2, -0.27, 0.5, 0.4]]),
    np.array([[0.3, -0.1, 0.3, 0.6, -0.5], [0.3, 0.4, -0.4, 0.2, 0.5]]),
    ("a1", "a2"),
)
PULSE_S = np.linspace(0.0, 250e-6, 1001)
PULSE_N = 2000 * np.sin(np.pi * PULSE_S / PULSE_S[-1]) ** 1.5


def response(time, force):
    """Every mode through its exact filter for a force that is linear between samples."""
    out = np.zeros((2, time.size))
    for frequency, damping, impact, shape in zip(
        MODES.frequencies_hz, MODES.damping, MODES.shape_impact[0], MODES.shapes.T, strict=True
    ):
        omega = 2 * np.pi * frequency
        if omega:
            system = ([1.0, 0.0, 0.0], [1.0, 2 * damping * omega, omega**2])
            b, a, _ = cont2discrete(system, time[1] - time[0], method="foh")
            out += np.outer(shape * impact, lfilter(np.squeeze(b), a, force))
        else:
            out += np.outer(shape * impact, force)
    return out


def in_one_piece(starts, samples, effects):
    time = np.arange(samples * RATIO) / (FS_HZ * RATIO)
    force = sum(np.interp(time - s, PULSE_S, PULSE_N, left=0, right=0) for s in starts)
    return [
        analog(time, a, s, FS_HZ, effects)
        for a, s in zip(response(time, force), SENSORS, strict=True)
    ]


def in_blows(starts, samples, effects):
    blows = [blow(s, PULSE_S, PULSE_N, FS_HZ, RATIO, 3e-3) for s in starts]
    return ringing_accelerations(
        blows, samples, MODES, MODES.shape_impact[0], response, SENSORS, FS_HZ, effects
    )


@pytest.mark.parametrize("mounting", [0.0, 1.0, 3.0], ids=["rigid", "45 kHz", "15 kHz"])
def test_recording_in_blows_is_the_recording_in_one_piece(mounting):
    starts, samples = (0.0100003, 0.0432107, 0.1), 8000
    effects = Effects.only("sensor.mount_resonance", mounting)
    whole, pieces = in_one_piece(starts, samples, effects), in_blows(starts, samples, effects)
    for expected, found in zip(whole, pieces, strict=True):
        assert np.abs(found[:-100] - expected[:-100]).max() < 2e-4 * np.abs(expected).max()
        quiet = slice(6500, 7900)  # long after the last blow nothing has run out of phase
        assert np.abs(found[quiet] - expected[quiet]).max() < 1e-3 * np.abs(expected[quiet]).max()


def test_blow_at_the_record_s_ends_is_cut_and_none_or_one_without_force_moves_nothing():
    whole = in_blows((0.01,), 1000, Effects.none())
    assert in_blows((0.01,), 530, Effects.none()) == pytest.approx(whole[:, :530], abs=1e-9)
    late = in_blows((0.01 + 1000 / FS_HZ,), 1600, Effects.none())
    assert late[:, 1000:] == pytest.approx(whole[:, :600], rel=1e-6, abs=1e-6)
    nothing = blow(0.01, PULSE_S, 0 * PULSE_N, FS_HZ, RATIO, 1e-3)
    assert not ringing_accelerations(
        [nothing], 900, MODES, MODES.shape_impact[0], response, SENSORS, FS_HZ, Effects.default()
    ).any()
    assert not ringing_accelerations(
        [], 100, MODES, MODES.shape_impact[0], response, SENSORS, FS_HZ, Effects.none()
    ).any()
