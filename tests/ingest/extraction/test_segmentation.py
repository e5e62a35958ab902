"""Rest, events and contacts of records whose every sample is known, and pulses that fill much of
their record."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.ingest.extraction.segmentation import (
    RestLevel,
    delimit,
    find_events,
    local_baseline,
    orientation,
    rest_level,
    segment,
)
from pyroshock.ingest.extraction.settings import ExtractionSettings
from scipy.signal import lfilter
from scipy.stats import norm

QUIET = RestLevel(0.0, 0.0)
#: At the threshold of a tenth: first sample above it is 3, last is 6.
CONTACT = np.array([0.0, 0.0, 1.0, 5.0, 10.0, 6.0, 2.0, 0.5, 0.0])


def tenth(**other):
    return ExtractionSettings(threshold=0.1, **other)


@pytest.mark.parametrize("samples", [999, 400_001])
def test_rest_is_median_and_deviation_of_normal_noise(samples):
    noise = norm.ppf((np.arange(samples) + 0.5) / samples)
    force = 7.0 + 3.0 * np.random.default_rng(0).permutation(noise)
    force[5::100] = np.nan
    level = rest_level(force)
    assert (level.baseline, level.noise) == (
        pytest.approx(7.0, abs=0.15),
        pytest.approx(3.0, rel=0.04),
    )


def test_record_of_gaps_rests_at_zero() -> None:
    assert rest_level(np.full(10, np.nan)) == QUIET


@pytest.mark.parametrize(
    ("samples", "settings", "events"),
    [
        ({}, ExtractionSettings(), []),
        ({10: 5.0, 12: 8.0}, ExtractionSettings(separation_s=0.0), [[10], [12]]),
        ({0: 9.0, 49: 10.0}, ExtractionSettings(), [[0], [49]]),
        ({10: 5.0, 40: 8.0, 45: 6.0}, ExtractionSettings(separation_s=1.0), [[10], [40, 45]]),
        # of the first two, ten samples lie between the fall and the next rise
        ({10: 5.0, 21: 8.0, 40: 6.0}, ExtractionSettings(separation_s=1.1), [[21, 10], [40]]),
        ({10: 5.0, 21: 8.0, 40: 6.0}, ExtractionSettings(separation_s=1.0), [[10], [21], [40]]),
    ],
    ids=[
        "silence",
        "no separation",
        "ends of the record",
        "from the contact before",
        "one event",
        "two events",
    ],
)
def test_contacts_a_separation_apart_are_two_events(samples, settings, events):
    force = np.zeros(50)
    force[list(samples)] = list(samples.values())
    assert [event.tolist() for event in find_events(force, QUIET, 10.0, settings)] == events
    assert find_events(np.zeros(0), QUIET, 10.0, settings) == []


@pytest.mark.parametrize(
    ("force", "sign"),
    [([0, 5, -4], 1), ([0, 4, -5], -1), ([0, 5, -5], 1), ([3, 8, 0], 1), ([3, 5, -2], -1)],
)
def test_orientation_is_that_of_the_largest_excursion(force, sign):
    level = RestLevel(3.0 if force[0] else 0.0, 0.0)
    assert orientation(np.array(force, dtype=float), level) == sign


@pytest.mark.parametrize(
    ("first", "rate", "expected"),
    [
        (1000, 51_200.0, 867.5),  # 5 ms are 256 samples: 740 to 995
        (1000, 1000.0, 987.5),  # 5 samples are too few: 980 to 995
        (20, 51_200.0, 7.5),  # all that there is: 0 to 15
        (19, 51_200.0, -1.0),  # 15 samples: the record's rest
        (2, 51_200.0, -1.0),  # none
    ],
)
def test_local_rest_is_the_stretch_that_ends_four_samples_earlier(first, rate, expected):
    level = local_baseline(np.arange(2000.0), (first, first + 9), RestLevel(-1.0, 0.25), rate)
    assert level == RestLevel(expected, 0.25)


def test_local_rest_ends_15_per_cent_of_a_long_contact_earlier_and_passes_over_gaps():
    """The foot of a slow pulse is no rest: 256 samples that end 150 before a contact of 1000."""
    level = local_baseline(np.arange(2000.0), (1000, 2000), RestLevel(-1.0, 0.25), 51_200.0)
    assert level.baseline == 850 - 128.5
    force = np.arange(2000.0)
    force[500:996:2] = np.nan
    assert local_baseline(force, (1000, 1009), QUIET, 51_200.0).baseline == 868.0
    force[500:] = np.nan
    assert local_baseline(force, (1000, 1009), RestLevel(-1.0, 0.0), 51_200.0).baseline == -1.0


def test_contact_of_known_samples_by_share_noise_and_further_hits():
    found = segment(CONTACT, np.array([4]), QUIET, tenth())
    assert (found.walk, found.mask, found.threshold) == ((2, 7), (2, 6), 1.0)
    assert found.difference == pytest.approx(0.2)
    assert (found.contact.first, found.contact.peak, found.contact.last) == (2, 4, 7)
    assert not found.raised and not found.truncated and found.extra_hits == 0
    by_mask = segment(CONTACT, np.array([4]), QUIET, tenth(segmentation="mask"))
    assert (by_mask.contact.first, by_mask.contact.last) == (2, 6)
    noisy = segment(CONTACT, np.array([4]), RestLevel(0.0, 1.25), tenth())
    assert (noisy.walk, noisy.threshold, noisy.raised) == ((2, 6), 2.5, True)
    assert not segment(
        CONTACT, np.array([4]), RestLevel(0.0, 0.5), tenth()
    ).raised  # both are 1: nothing is raised
    force = np.concatenate([CONTACT, CONTACT / 2])
    assert segment(force, np.array([4, 13]), QUIET, tenth()).extra_hits == 1
    assert segment(force, np.array([4, 5]), QUIET, tenth()).extra_hits == 0
    ends = segment(force, np.array([4, 2, 7]), QUIET, tenth())  # on the contact's own ends
    assert ends.extra_hits == 0


@pytest.mark.parametrize("cut", [slice(3, None), slice(None, 7)], ids=["begin", "end"])
def test_record_inside_a_contact_is_truncated_at_its_own_end(cut):
    force = CONTACT[cut]
    found = segment(force, np.array([int(np.argmax(force))]), QUIET, tenth())
    assert found.truncated
    assert found.walk == ((0, 4) if cut.start else (2, 6))
    assert found.mask == ((0, 3) if cut.start else (2, 6))


def test_contact_ends_at_the_first_sample_that_does_not_exceed_the_threshold():
    segments = segment(CONTACT[::-1], np.array([4]), QUIET, tenth())
    assert (segments.walk, segments.mask) == ((1, 6), (1, 5))
    raised = segment(
        CONTACT + 100.0, np.array([4]), RestLevel(100.0, 0.0), tenth()
    )  # counts from the rest
    assert (raised.walk, raised.threshold) == ((2, 7), 101.0)
    force = CONTACT.copy()
    force[6] = np.nan  # a gap ends it
    assert segment(force, np.array([4]), QUIET, tenth()).walk == (2, 6)


@pytest.mark.parametrize("samples", [40, 64, 65, 300, 5000])
def test_contact_of_any_length_is_walked(samples):
    force = np.concatenate(
        [np.zeros(7000), np.ones(samples), [2.0], np.ones(samples), np.zeros(7000)]
    )
    found = segment(force, np.array([7000 + samples]), QUIET, tenth())
    assert found.walk == (6999, 7000 + 2 * samples + 1)
    assert found.mask == (6999, 7000 + 2 * samples)


def test_events_exceed_share_and_noise_both_and_drift_does_not_tilt_them():
    force = np.zeros(100)
    force[[10, 30, 50]] = 100.0, 10.0, 11.0
    far = ExtractionSettings(separation_s=0.0)
    assert [each.tolist() for each in find_events(force, QUIET, 1.0, far)] == [[10], [50]]
    assert [each.tolist() for each in find_events(force, RestLevel(0.0, 1.05), 1.0, far)] == [
        [10],
        [50],
    ]
    assert [each.tolist() for each in find_events(force, RestLevel(0.0, 1.1), 1.0, far)] == [[10]]
    assert find_events(force, RestLevel(0.0, 10.1), 1.0, far) == []
    assert [each.tolist() for each in find_events(force + 50, RestLevel(50.0, 0.0), 1.0, far)] == [
        [10],
        [50],
    ]
    force = np.concatenate([np.zeros(400), np.full(400, 0.5), CONTACT + 0.5, np.full(50, 0.5)])
    rest, found = delimit(force, np.array([804]), QUIET, 51_200.0, tenth())
    assert rest.baseline == 0.5
    assert found.walk == (802, 807)


def hit_with_shift(offset, slope=0.0):
    """A half sine of 1000 N over 101 samples from sample 1000 on, in whose last fifth the sensor
    shifts by `offset`."""
    force = np.random.default_rng(3).normal(0.0, 0.2, 6000)
    force[1000:1101] += 1000.0 * np.sin(np.pi * np.arange(101) / 100)
    force[1080:1101] += offset * np.linspace(0.0, 1.0, 21)
    force[1101:] += offset - slope * np.arange(force.size - 1101)
    return force


@pytest.mark.parametrize("segmentation", ["walk", "mask"])
@pytest.mark.parametrize("offset", [0.0, 8.0, 30.0, 80.0])
def test_contact_ends_where_the_force_comes_down_to_a_higher_rest(offset, segmentation):
    settings = ExtractionSettings(segmentation=segmentation)
    (pulse,) = extract_pulses(hit_with_shift(offset), 51200.0, settings)
    assert not pulse.truncated
    assert pulse.contact.first == pytest.approx(
        1000, abs=2
    ) and pulse.contact.last == pytest.approx(1100, abs=3)
    assert pulse.peak_force_n == pytest.approx(1000.0, abs=1.0)
    assert pulse.impulse_n_s == pytest.approx(
        2 / np.pi * 1000.0 * 100 / 51200, rel=0.01 + offset / 1e4
    )


@pytest.mark.parametrize(("offset", "slope"), [(95.0, 0.004), (150.0, 0.0)])
def test_force_that_is_still_falling_or_far_up_is_cut_by_the_end(offset, slope):
    (pulse,) = extract_pulses(hit_with_shift(offset, slope), 51200.0)
    assert pulse.truncated


RATE_HZ, SAMPLES, NOISE_N, PEAK_N = 20_000.0, 4000, 3.0, 1000.0
RECORD_S = SAMPLES / RATE_HZ
SHARES = (0.01, 0.05, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8)
#: By shape: exponent of the sine, and its mean over the pulse.
SHAPES = {"half sine": (1, 2 / np.pi), "haversine": (2, 0.5)}


def record(
    share: float,
    shape: str,
    start: float = 0.1,
    noise: float = NOISE_N,
    constant_s: float | None = None,
):
    """(n,) force in newtons of one pulse that fills a share of the record; `constant_s` of the
    sensor's high pass."""
    phase = (np.arange(SAMPLES) / SAMPLES - start) / share
    force = PEAK_N * np.where(
        (phase > 0) & (phase < 1), np.sin(np.pi * np.clip(phase, 0, 1)) ** SHAPES[shape][0], 0.0
    )
    if constant_s:
        keep = constant_s / (constant_s + 1 / RATE_HZ)
        force = lfilter([keep, -keep], [1, -keep], force)
    return force + noise * np.random.default_rng(4).standard_normal(SAMPLES)


@pytest.mark.parametrize("sign", [1, -1], ids=["positive", "negative"])
@pytest.mark.parametrize("start", [0.02, 0.15])
@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("shape", SHAPES)
def test_peak_and_impulse_are_those_of_the_closed_form(shape, share, start, sign):
    """Peak within 1 % and three deviations of noise, impulse within 1 % and what the threshold cuts
    off the flanks."""
    (pulse,) = extract_pulses(sign * record(share, shape, start), RATE_HZ)
    assert pulse.peak_force_n == pytest.approx(PEAK_N, abs=0.01 * PEAK_N + 3 * NOISE_N)
    assert pulse.impulse_n_s == pytest.approx(
        PEAK_N * share * RECORD_S * SHAPES[shape][1], rel=0.012
    )
    assert abs(pulse.rest_n) < NOISE_N
    assert not pulse.truncated


@pytest.mark.parametrize("share", SHARES)
def test_without_noise_a_slow_half_sine_is_exact(share):
    (pulse,) = extract_pulses(record(share, "half sine", noise=0.0), RATE_HZ)
    assert pulse.peak_force_n == pytest.approx(PEAK_N, rel=2e-3)
    assert pulse.impulse_n_s == pytest.approx(PEAK_N * share * RECORD_S * 2 / np.pi, rel=2e-3)
    assert pulse.contact_time_s == pytest.approx(share * RECORD_S, rel=0.01, abs=2 / RATE_HZ)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.4, 0.6, 0.8])
@pytest.mark.parametrize("lengths", [5, 20])
def test_what_an_ac_coupled_sensor_sags_below_rest_is_not_taken_for_rest(share, lengths):
    """Truth: the filtered record without noise. Behind the pulse the sensor lies below its rest,
    before it at rest."""
    constant_s = lengths * share * RECORD_S
    clean = record(share, "half sine", noise=0.0, constant_s=constant_s)
    (pulse,) = extract_pulses(record(share, "half sine", constant_s=constant_s), RATE_HZ)
    assert abs(pulse.rest_n) < NOISE_N
    assert pulse.peak_force_n == pytest.approx(clean.max(), abs=0.01 * PEAK_N + 3 * NOISE_N)
    assert pulse.impulse_n_s == pytest.approx(np.maximum(clean, 0).sum() / RATE_HZ, rel=0.012)


@pytest.mark.parametrize("share", [0.6, 0.8])
def test_record_that_begins_with_the_pulse_rests_where_it_ends(share):
    """No rest before it: that behind it is taken, and the pulse is said to be cut."""
    force = record(share, "half sine", start=-0.1)
    (pulse,) = extract_pulses(force, RATE_HZ)
    assert abs(pulse.rest_n) < NOISE_N
    assert pulse.truncated
