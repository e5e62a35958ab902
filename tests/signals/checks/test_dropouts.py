from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks import Contact
from pyroshock.signals.checks.dropouts import check_dropouts

CONTACT = (Contact(400, 430, 459),)


@pytest.fixture
def live(half_sine):
    return half_sine(noise=2.0, rng=np.random.default_rng(7))


def test_whole_record_has_no_dropouts(channel_of, live):
    assert check_dropouts(channel_of(live), CONTACT) == []


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_one_bad_sample_in_a_contact_rejects_it(channel_of, live, bad):
    live[440] = bad
    (finding,) = check_dropouts(channel_of(live), CONTACT)
    assert (finding.severity, finding.contact, finding.evidence["first_sample"]) == ("reject", 0, 440)


def test_bad_samples_outside_contacts_are_a_warning_with_the_longest_gap(channel_of, live):
    live[[100, 1000, 1001, 1002, 1500]] = np.nan
    (finding,) = check_dropouts(channel_of(live, rate_hz=1000.0), CONTACT)
    assert finding.severity == "warning"
    assert (finding.evidence["samples"], finding.evidence["longest_samples"]) == (5, 3)
    assert finding.evidence["longest_s"] == pytest.approx(0.003)


def test_all_bad_record_is_reported_and_not_raised(channel_of):
    (finding,) = check_dropouts(channel_of(np.full(50, np.nan)), ())
    assert finding.evidence["share"] == 1.0


def test_huge_values_are_not_taken_for_infinity(channel_of):
    assert check_dropouts(channel_of(np.array([1e308, 1.5e308, 1e308, 0.5e308])), ()) == []


def test_missing_samples_of_the_time_column_are_counted(channel_of, live):
    channel = channel_of(live, header={"time_gaps": [[100, 7], [420, 30], [430, 5]]})
    inside, outside = check_dropouts(channel, CONTACT)
    assert (inside.severity, inside.evidence["samples"], inside.evidence["longest_samples"]) == ("reject", 35, 30)
    assert (outside.severity, outside.evidence["samples"]) == ("warning", 7)


def test_gaps_of_another_form_are_refused(channel_of, live):
    with pytest.raises(ValueError, match=r"time_gaps is 3; expected a list"):
        check_dropouts(channel_of(live, header={"time_gaps": 3}), CONTACT)


def test_zeros_in_a_live_signal_are_found(channel_of, live):
    live[900:950] = 0.0
    (finding,) = check_dropouts(channel_of(live), CONTACT)
    assert (finding.evidence["first_sample"], finding.evidence["samples"]) == (900, 50)


def test_held_value_within_a_pulse_rejects_the_contact(channel_of, live):
    live[410:420] = live[410]
    (finding,) = check_dropouts(channel_of(live), CONTACT)
    assert (finding.severity, finding.evidence["kind"]) == ("reject", "held")


def test_pulse_cut_to_zero_is_found_in_a_record_that_rests_at_zero(channel_of, half_sine):
    x = half_sine() + half_sine(first=900, height=-300.0)
    x[425:440] = 0.0
    (finding,) = check_dropouts(channel_of(x), CONTACT)
    assert finding.evidence["first_sample"] == 425


def test_zeros_between_pulses_of_a_masked_record_are_rest(channel_of, half_sine):
    x = half_sine(first=400, width=300) + half_sine(first=900, width=300) - half_sine(first=1500, height=50.0)
    assert check_dropouts(channel_of(x), ()) == []


def test_zero_padding_at_the_ends_is_no_dropout(channel_of, live):
    live[:80] = live[-300:] = 0.0
    assert check_dropouts(channel_of(live), CONTACT) == []


def test_quiet_record_of_few_codes_is_live(channel_of):
    drift = np.round(np.cumsum(np.random.default_rng(5).normal(scale=0.05, size=20000))).astype(np.int16)
    assert check_dropouts(channel_of(drift), ()) == []


def test_rounded_crest_of_a_slow_wave_is_live(channel_of):
    """Ten equal samples at the turn of a decayed wave came up in one of 2000 random records."""
    flank = np.arange(100, 7, -4)
    crest = np.concatenate([flank, [6, 6, 5, 4, 3, 2, 1], np.zeros(10), [1, 3, 4, 5, 7, 7], flank[::-1]])
    codes = np.round(np.random.default_rng(6).normal(scale=60.0, size=4096))
    codes[2000 : 2000 + crest.size] = crest
    assert check_dropouts(channel_of(codes.astype(np.int16)), ()) == []


def test_chance_stand_in_noise_of_two_codes_is_live(channel_of):
    """Twelve per cent of neighbours are equal there; seven in a row came up once in 1500 random records."""
    codes = np.round(np.random.default_rng(9).normal(scale=2.3, size=200_000))
    codes[5000:5009] = 1.0
    assert check_dropouts(channel_of(codes.astype(np.int16)), ()) == []


def test_channel_that_never_moves_is_rejected(channel_of):
    (finding,) = check_dropouts(channel_of(np.full(1000, 3, np.int32)), ())
    assert (finding.severity, finding.evidence["kind"], finding.evidence["level"]) == ("reject", "dead", 3.0)
