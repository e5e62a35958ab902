"""Velocity, displacement and truncation of accelerations, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks.displacement import check_displacement
from pyroshock.signals.checks.truncation import check_truncation
from pyroshock.signals.checks.velocity import check_velocity

RATE = 51200.0
ONSET, WIDTH, HEIGHT = 4000, 512, 1000.0
#: Velocity that the half sine gives: 2 A T / pi.
VELOCITY = 2.0 * HEIGHT * WIDTH / RATE / np.pi


def half_sine(samples=40_000, noise=0.3):
    x = np.random.default_rng(7).normal(0.0, noise, samples)
    x[ONSET : ONSET + WIDTH] += HEIGHT * np.sin(np.pi * (np.arange(WIDTH) + 0.5) / WIDTH)
    return x


def test_free_body_record_without_a_rest_and_noise_before_the_shock_are_left_alone(channel_of):
    """A free body keeps what a half sine gave it; a sensor's own offset integrates to any velocity,
    and without a rest nobody knows it."""
    for x in (half_sine(), half_sine()[ONSET:] + 0.04 * HEIGHT):
        channel = channel_of(x, "acceleration", RATE)
        assert check_velocity(channel, ()) == [] == check_displacement(channel, ())
    assert (
        check_truncation(channel_of(half_sine(noise=0.05 * HEIGHT), "acceleration", RATE), ()) == []
    )


def test_offset_after_the_shock_is_a_velocity_of_its_size(channel_of):
    x, offset = half_sine(), 0.02 * HEIGHT
    x[ONSET + WIDTH :] += offset
    (finding,) = check_velocity(channel_of(x, "acceleration", RATE), ())
    assert finding.severity == "warning"
    assert finding.evidence["final_velocity_m_s"] == pytest.approx(
        VELOCITY + offset * (x.size - ONSET - WIDTH) / RATE, rel=0.02
    )
    assert finding.evidence["shock_velocity_m_s"] == pytest.approx(VELOCITY, rel=0.02)


@pytest.mark.parametrize("samples", [40_000, 400_000])
def test_wander_that_comes_back_is_a_displacement_of_its_size(channel_of, samples):
    """One period of a sine of amplitude a and length T gives no velocity at its end, and a T^2 / (2
    pi) of way."""
    x = half_sine(samples)
    lasts_s, amplitude = (samples - ONSET) / RATE, 0.04 * HEIGHT
    x[ONSET:] += amplitude * np.sin(2 * np.pi * np.arange(samples - ONSET) / (samples - ONSET))
    channel = channel_of(x, "acceleration", RATE)
    (finding,) = check_displacement(channel, ())
    way_m = amplitude * lasts_s**2 / (2 * np.pi) + VELOCITY * (lasts_s - WIDTH / RATE / 2)
    assert finding.evidence["displacement_m"] == pytest.approx(way_m, rel=0.03)
    assert check_velocity(channel, ()) == []


def test_what_moves_on_purpose_and_other_quantities_are_left_alone(channel_of):
    x = half_sine()
    x[ONSET + WIDTH :] += 0.2 * HEIGHT
    for position in ("hammer", "Projectile", "tip"):
        channel = channel_of(x, "acceleration", RATE, position=position)
        assert check_velocity(channel, ()) == [] == check_displacement(channel, ())
    for check, offset, swing in (
        (check_velocity, 0.04, 0),
        (check_displacement, 0.04, 0),
        (check_truncation, 0, 0.2),
    ):
        x = half_sine()
        x[ONSET:] += HEIGHT * (offset + swing * np.sin(0.3 * np.arange(x.size - ONSET)))
        assert check(channel_of(x, "acceleration", RATE), ()) != []
        assert check(channel_of(x, "force", RATE), ()) == []


@pytest.mark.parametrize(("decay", "told"), [(4.0, False), (1.0, True)])
def test_ringing_at_the_end_is_told_with_its_share(channel_of, decay, told):
    """A sine that has decayed to exp(-decay) of its peak at the end of the record."""
    x = half_sine()
    after = np.arange(x.size - ONSET)
    x[ONSET:] = HEIGHT * np.exp(-decay * after / after.size) * np.sin(0.2 * after)
    findings = check_truncation(channel_of(x, "acceleration", RATE), ())
    assert [finding.severity for finding in findings] == ["note"] * told
    for finding in findings:
        # the swing of the last 20th is that of its begin
        assert finding.evidence["peak_share"] == pytest.approx(np.exp(-decay * 0.95), rel=0.03)


@pytest.mark.parametrize(("share", "severity"), [(0.002, "note"), (0.02, "warning")])
def test_offset_that_spoils_no_spectrum_is_a_note(channel_of, share, severity):
    x = half_sine(400_000)
    x[ONSET:] += share * HEIGHT
    for check in (check_velocity, check_displacement):
        (finding,) = check(channel_of(x, "acceleration", RATE), ())
        assert finding.severity == severity
