from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.pre_trigger_noise import check_pre_trigger_noise

CONTACT = (Contact(30000, 30030, 30059),)


def noisy(half_sine, sigma, seed=0):
    return half_sine(n=32768, first=30000, noise=sigma, rng=np.random.default_rng(seed))


def test_severity_and_sigma_follow_the_noise_with_few_spikes_as_well(channel_of, half_sine):
    """Sigma within four standard errors of a MAD of 4096."""
    for sigma, severities in ((0.5, []), (5.0, ["note"]), (30.0, ["warning"])):
        findings = check_pre_trigger_noise(channel_of(noisy(half_sine, sigma)), CONTACT)
        assert [f.severity for f in findings] == severities
    x = noisy(half_sine, 5.0)
    (finding,) = check_pre_trigger_noise(channel_of(x), CONTACT)
    assert finding.evidence["sigma"] == pytest.approx(5.0, rel=0.08)
    x[1000:29000:500] += 300.0
    (finding,) = check_pre_trigger_noise(channel_of(x), CONTACT)
    assert finding.evidence["sigma"] == pytest.approx(5.0, rel=0.08)
    assert finding.evidence["peak_to_peak"] > 250.0


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
def test_mains_hum_is_named_and_white_noise_is_none(channel_of, half_sine, mains_hz):
    x = noisy(half_sine, 2.0) + 20.0 * np.sin(
        2 * np.pi * mains_hz * np.arange(32768) / 51200.0 + 0.7
    )
    (finding,) = check_pre_trigger_noise(channel_of(x), CONTACT)
    assert finding.evidence["mains_hz"] == mains_hz
    assert finding.evidence["mains_variance_share"] == pytest.approx(200.0 / 204.0, rel=0.05)
    (finding,) = check_pre_trigger_noise(channel_of(noisy(half_sine, 20.0)), CONTACT)
    assert finding.evidence["mains_hz"] is None


def test_record_that_begins_with_the_contact_is_noted_and_a_pressure_never(channel_of, half_sine):
    (finding,) = check_pre_trigger_noise(channel_of(half_sine(first=5)), (Contact(5, 35, 64),))
    assert (finding.severity, finding.evidence["samples"]) == ("note", 5)
    assert check_pre_trigger_noise(channel_of(noisy(half_sine, 50.0), "pressure"), CONTACT) == []


def test_no_measured_hit_warns(channel_of, contact_at_peak, vrtac):
    found = [
        f
        for h in vrtac.values()
        for f in check_pre_trigger_noise(channel_of(h[0], rate_hz=2e4), contact_at_peak(h[0]))
    ]
    assert [f for f in found if f.severity != "note"] == []
