from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.dropouts import check_dropouts

CONTACT = (Contact(400, 430, 459),)


@pytest.fixture
def live(half_sine):
    return half_sine(noise=2.0, rng=np.random.default_rng(7))


def test_records_without_dropouts(channel_of, live, half_sine):
    assert check_dropouts(channel_of(live), CONTACT) == []
    live[:80] = live[-300:] = 0.0  # padding at the ends
    assert check_dropouts(channel_of(live), CONTACT) == []
    assert check_dropouts(channel_of(np.array([1e308, 1.5e308, 1e308, 0.5e308])), ()) == []
    drift = np.round(np.cumsum(np.random.default_rng(5).normal(scale=0.05, size=20000))).astype(
        np.int16
    )
    assert check_dropouts(channel_of(drift), ()) == []
    masked = (
        half_sine(first=400, width=300)
        + half_sine(first=900, width=300)
        - half_sine(first=1500, height=50.0)
    )
    assert check_dropouts(channel_of(masked), ()) == []


def test_bad_samples_reject_their_contact_and_are_a_warning_outside(channel_of, live):
    for bad in (np.nan, np.inf, -np.inf):
        x = live.copy()
        x[440] = bad
        (finding,) = check_dropouts(channel_of(x), CONTACT)
        assert (finding.severity, finding.contact, finding.evidence["first_sample"]) == (
            "reject",
            0,
            440,
        )
    live[[100, 1000, 1001, 1002, 1500]] = np.nan
    (finding,) = check_dropouts(channel_of(live, rate_hz=1000.0), CONTACT)
    assert finding.severity == "warning"
    assert (finding.evidence["samples"], finding.evidence["longest_samples"]) == (5, 3)
    assert finding.evidence["longest_s"] == pytest.approx(0.003)


def test_record_of_no_samples_or_of_one_value_is_reported(channel_of):
    (finding,) = check_dropouts(channel_of(np.full(50, np.nan)), ())
    assert finding.evidence["share"] == 1.0
    (finding,) = check_dropouts(channel_of(np.full(1000, 3, np.int32)), ())
    assert (finding.severity, finding.evidence["kind"], finding.evidence["level"]) == (
        "reject",
        "dead",
        3.0,
    )


def test_missing_samples_of_the_time_column_are_counted(channel_of, live):
    channel = channel_of(live, header={"time_gaps": [[100, 7], [420, 30], [430, 5]]})
    inside, outside = check_dropouts(channel, CONTACT)
    assert (inside.severity, inside.evidence["samples"], inside.evidence["longest_samples"]) == (
        "reject",
        35,
        30,
    )
    assert (outside.severity, outside.evidence["samples"]) == ("warning", 7)
    with pytest.raises(ValueError, match=r"time_gaps is 3; expected a list"):
        check_dropouts(channel_of(live, header={"time_gaps": 3}), CONTACT)


def test_held_values_are_found_and_reject_a_contact(channel_of, live, half_sine):
    held = live.copy()
    live[900:950] = 0.0
    (finding,) = check_dropouts(channel_of(live), CONTACT)
    assert (finding.evidence["first_sample"], finding.evidence["samples"]) == (900, 50)
    held[410:420] = held[410]
    (finding,) = check_dropouts(channel_of(held), CONTACT)
    assert (finding.severity, finding.evidence["kind"]) == ("reject", "held")
    x = half_sine() + half_sine(first=900, height=-300.0)
    x[425:440] = 0.0
    (finding,) = check_dropouts(channel_of(x), CONTACT)
    assert finding.evidence["first_sample"] == 425


def test_equal_codes_of_a_crest_or_of_noise_are_live(channel_of):
    """Ten equal samples at the turn of a decayed wave came up in one of 2000 random records."""
    flank = np.arange(100, 7, -4)
    crest = np.concatenate(
        [flank, [6, 6, 5, 4, 3, 2, 1], np.zeros(10), [1, 3, 4, 5, 7, 7], flank[::-1]]
    )
    codes = np.round(np.random.default_rng(6).normal(scale=60.0, size=4096))
    codes[2000 : 2000 + crest.size] = crest
    assert check_dropouts(channel_of(codes.astype(np.int16)), ()) == []
    # Twelve per cent of neighbours are equal there; seven in a row came up once in 1500 random
    # records.
    codes = np.round(np.random.default_rng(9).normal(scale=2.3, size=200_000))
    codes[5000:5009] = 1.0
    assert check_dropouts(channel_of(codes.astype(np.int16)), ()) == []
