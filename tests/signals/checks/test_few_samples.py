from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.few_samples import check_few_samples


def force_of(*contacts, n=300):
    """A force at rest but for contacts (first, samples), in which it stands at 100 N."""
    force = np.zeros(n)
    for first, samples in contacts:
        force[first : first + samples] = 100.0
    return force


def around(first, samples):
    """As a walk delimits it: from the sample before the contact to the one after it."""
    return Contact(first - 1, first + samples // 2, first + samples)


@pytest.mark.parametrize(
    ("samples", "severity"), [(10, None), (9, "note"), (5, "note"), (4, "warning"), (1, "warning")]
)
@pytest.mark.parametrize("ends", [0, 1])
def test_severity_follows_the_number_of_samples(channel_of, samples, severity, ends):
    contact = Contact(100 - ends, 100 + samples // 2, 100 + samples - 1 + ends)
    findings = check_few_samples(channel_of(force_of((100, samples))), (contact,))
    assert [f.severity for f in findings] == ([] if severity is None else [severity])
    assert [f.evidence["samples"] for f in findings] == ([] if severity is None else [samples])


def test_missed_peak_is_bounded_and_each_contact_judged_for_itself(channel_of):
    (finding,) = check_few_samples(channel_of(force_of((100, 8))), (around(100, 8),))
    offsets = np.linspace(0.0, 1.0, 201)[:-1]
    peaks = np.sin(np.pi * (np.arange(8) + offsets[:, None]) / 8).max(axis=1)
    assert 1.0 - peaks.min() == pytest.approx(finding.evidence["missed_peak_share"], rel=1e-6)
    force = -force_of((10, 4), (30, 21), (60, 2))
    contacts = (around(10, 4), around(30, 21), around(60, 2))
    assert [f.contact for f in check_few_samples(channel_of(force), contacts)] == [0, 2]
    assert (
        check_few_samples(channel_of(force_of((100, 3)), "acceleration"), (around(100, 3),)) == []
    )


def test_most_measured_hits_at_20_khz_have_few_samples(channel_of, contact_at_peak, vrtac):
    """FWHM of 148 to 208 us at 20 kHz: a stiff contact lasts six or seven samples, and a tail
    extends some to 12."""
    found = [
        bool(check_few_samples(channel_of(h[0], rate_hz=2e4), contact_at_peak(h[0])))
        for h in vrtac.values()
    ]
    assert (len(found), sum(found)) == (33, 24)
