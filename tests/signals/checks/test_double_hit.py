from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.double_hit import check_double_hit


def two_hits(half_sine, share, delay, rng=None):
    """Two pulses of 1000 and `share` of it, `delay` samples from start to start, at 51.2 kHz."""
    x = half_sine(n=16384, noise=2.0, rng=rng) if rng is not None else half_sine(n=16384)
    return x + half_sine(n=16384, first=400 + delay, height=1000.0 * share)


def test_second_contact_soon_after_the_first_is_a_double_hit(channel_of, half_sine):
    contacts = (Contact(400, 430, 459), Contact(900, 930, 959))
    (finding,) = check_double_hit(channel_of(two_hits(half_sine, 0.5, 500)), contacts)
    assert finding.contact == 0
    assert finding.evidence["share"] == pytest.approx(0.5, rel=1e-3)
    assert finding.evidence["delay_s"] == pytest.approx(500 / 51200, abs=2 / 51200)
    assert check_double_hit(channel_of(two_hits(half_sine, 0.3, 62)), (Contact(400, 430, 521),))


@pytest.mark.parametrize(("share", "found"), [(0.04, False), (0.06, True)])
def test_second_peak_counts_from_five_per_cent(channel_of, half_sine, share, found):
    x = two_hits(half_sine, share, 500, np.random.default_rng(11))
    assert bool(check_double_hit(channel_of(x), (Contact(400, 430, 459),))) is found


def test_single_hits_are_left_alone(channel_of, half_sine):
    """A second one on purpose 0.2 s later, ringing about zero, a force that has not returned to
    zero, and what is no force."""
    deliberate = two_hits(half_sine, 0.9, 10240)
    assert (
        check_double_hit(
            channel_of(deliberate), (Contact(400, 430, 459), Contact(10640, 10670, 10699))
        )
        == []
    )
    ringing, t = half_sine(), np.arange(1500)
    ringing[460:1960] += 150.0 * np.exp(-t / 200) * np.sin(t * 0.3)
    assert check_double_hit(channel_of(ringing), (Contact(400, 430, 459),)) == []
    pressed = half_sine(width=60) + half_sine(first=420, width=80, height=800.0)
    assert check_double_hit(channel_of(pressed), (Contact(400, 430, 499),)) == []
    assert (
        check_double_hit(
            channel_of(two_hits(half_sine, 0.5, 500), "acceleration"), (Contact(400, 430, 459),)
        )
        == []
    )


def test_measured_single_hits_and_noise_on_a_slow_flank_are_single(
    channel_of, contact_at_peak, vrtac
):
    """Seen once in 2000 random pulses: 4 % was crossed down, then a noisy sample stood at 5.4 %."""
    rng, phase = np.random.default_rng(0), np.arange(260) / 260
    for _ in range(200):
        x = rng.normal(scale=5.0, size=2048)
        x[400:660] += 1000.0 * np.sin(np.pi * phase) ** 2.5
        assert check_double_hit(channel_of(x), (Contact(400, 530, 659),)) == []
    flagged = [
        n
        for n, h in vrtac.items()
        if check_double_hit(channel_of(h[0], rate_hz=2e4), contact_at_peak(h[0]))
    ]
    assert flagged == []
