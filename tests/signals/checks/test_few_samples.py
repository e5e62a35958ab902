from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.few_samples import check_few_samples


def contact_of(samples):
    return Contact(100, 100 + samples // 2, 100 + samples - 1)


@pytest.mark.parametrize(
    ("samples", "severity"), [(10, None), (9, "note"), (5, "note"), (4, "warning"), (1, "warning")]
)
def test_severity_follows_the_number_of_samples(channel_of, samples, severity):
    findings = check_few_samples(channel_of(np.zeros(300)), (contact_of(samples),))
    assert [f.severity for f in findings] == ([] if severity is None else [severity])


def test_missed_peak_bounds_that_of_a_half_sine_sampled_anywhere(channel_of):
    (finding,) = check_few_samples(channel_of(np.zeros(300)), (contact_of(8),))
    offsets = np.linspace(0.0, 1.0, 201)[:-1]
    peaks = np.sin(np.pi * (np.arange(8) + offsets[:, None]) / 8).max(axis=1)
    assert 1.0 - peaks.min() == pytest.approx(finding.evidence["missed_peak_share"], rel=1e-6)


def test_each_contact_is_judged_for_itself(channel_of):
    contacts = (Contact(0, 2, 5), Contact(20, 30, 40), Contact(60, 61, 62))
    assert [f.contact for f in check_few_samples(channel_of(np.zeros(300)), contacts)] == [0, 2]


def test_other_quantities_are_left_alone(channel_of):
    assert check_few_samples(channel_of(np.zeros(300), "acceleration"), (contact_of(3),)) == []


def test_most_measured_hits_at_20_khz_have_few_samples(channel_of, contact_at_peak, vrtac):
    """FWHM of 148 to 208 us at 20 kHz: a stiff contact lasts six or seven samples, and a tail extends some to 12."""
    found = [bool(check_few_samples(channel_of(h[0], rate_hz=2e4), contact_at_peak(h[0]))) for h in vrtac.values()]
    assert (len(found), sum(found)) == (33, 24)
