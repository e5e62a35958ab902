"""What counts as found, as made up, and as a second hit."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.benchmarks.extraction import PEERS, ours
from pyroshock.benchmarks.find_peaks_ways import second_hits
from pyroshock.benchmarks.pulse_scores import Score, Seen, score, share
from pyroshock.benchmarks.struck_records import Hit, Struck

HITS = [Hit(1.0, 1e-3, False, False), Hit(2.0, 1e-3, True, False)]
RECORD = Struck("two hits", np.zeros(0), HITS)


def test_all_found():
    found = [Seen(1.001, 1.1e-3, False), Seen(2.0, 0.9e-3, True)]
    assert score(RECORD, found) == Score(0, 0, pytest.approx(0.1))


def test_missed_and_made_up():
    """The second hit is missed with its impact; what begins elsewhere is made up."""
    found = [Seen(1.0, 1e-3, False), Seen(2.5, 1e-3, True)]
    assert score(RECORD, found) == Score(2, 1, 0.0)


def test_two_pulses_for_one_impact():
    found = [Seen(1.0, 1e-3, False), Seen(2.0, 1e-3, True), Seen(2.004, 1e-3, False)]
    assert score(RECORD, found).miscounted == 1


def test_nothing_found():
    assert score(RECORD, []) == Score(2, 1, float("inf"))


def test_chatter_is_judged_by_nobody():
    record = Struck("chatter", np.zeros(0), [Hit(1.0, 1e-3, False, True)])
    assert score(record, [Seen(1.0, 2e-3, True)]) == Score(0, 0, float("inf"))


@pytest.mark.parametrize(("wrong", "peers", "expected"), [(0, 0, 1.0), (0, 3, 0.0), (3, 2, 1.5), (1, 0, float("inf"))])
def test_share_of_the_peers_errors(wrong, peers, expected):
    assert share(wrong, peers) == expected


def test_ways_agree_on_a_clean_record():
    """Half sines of 2 ms, the second with another of a third 20 ms later; contacts end where 0.5 % are left."""
    rate, force = 50_000.0, np.random.default_rng(0).normal(0, 0.01, 150_000)
    for at, height in ((50_000, 1e3), (100_000, 1e3), (101_000, 333.0)):
        force[at : at + 100] += height * np.sin(np.pi * np.arange(100) / 100)
    for found in (ours(force, rate), *(_seen(way, force, rate) for way in PEERS.values())):
        assert [round(one.start_s, 3) for one in found] == [1.0, 2.0]
        assert [one.contact_time_s for one in found] == pytest.approx([2e-3, 2e-3], rel=0.02)
        assert [one.followed for one in found] == [False, True]


def _seen(way, force, rate):
    found = way(force, rate)
    followed = second_hits(force, found, rate)
    return [Seen(one.start_s, one.contact_time_s, again) for one, again in zip(found, followed, strict=True)]
