"""The zero of a record and its hits."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.record_hits import hits_of
from pyroshock.signals.record_rest import AS_RECORDED, RestChoice, rest_before_shock, without_rest

RATE = 50_000.0


def ringing(
    at_s: float, peak: float = 100.0, seconds: float = 0.2, hz: float = 900.0
) -> np.ndarray:
    t = np.arange(round(seconds * RATE)) / RATE - at_s
    return np.where(
        t >= 0, peak * np.exp(-150 * np.maximum(t, 0)) * np.sin(2 * np.pi * hz * t), 0.0
    )


@pytest.mark.parametrize("offset", [-30.0, 0.6, 40.0])
def test_rest_before_the_shock_is_removed_and_said(offset):
    x = ringing(0.05) + offset + np.random.default_rng(1).normal(0, 0.05, 10_000)
    clean, removed = without_rest(x, RATE)
    assert removed.level_m_s2 == pytest.approx(offset, abs=0.02)
    np.testing.assert_allclose(clean, x - removed.level_m_s2)
    assert removed.sentence.startswith("the rest before the shock is removed: ")


def test_nothing_is_removed_without_rest_or_when_asked():
    begins_at_once = ringing(0.0) + 5.0
    slow_foot = np.sin(
        np.pi * np.arange(20_000) / 20_000
    )  # no rest: its first half of what is quiet climbs
    for record in (begins_at_once, slow_foot):
        same, removed = without_rest(record, RATE)
        assert (
            same is record
            and removed.level_m_s2 == 0
            and "no rest was recorded" in removed.sentence
        )
    assert rest_before_shock(slow_foot)[0] is None
    same, removed = without_rest(ringing(0.05) + 3, RATE, choice=AS_RECORDED)
    assert removed.level_m_s2 == 0 and "as recorded" in removed.sentence


def test_a_stretch_is_on_the_records_own_clock():
    x = ringing(0.05) + 3
    clean, removed = without_rest(x, RATE, -0.05, RestChoice("stretch", -0.04, -0.01))
    assert removed.level_m_s2 == pytest.approx(3) and "from -0.04 to -0.01 s" in removed.sentence
    np.testing.assert_allclose(clean, x - 3)
    with pytest.raises(ValueError, match=r"holds no sample: the record reaches from 0 to 0\.2 s"):
        without_rest(x, RATE, 0.0, RestChoice("stretch", 0.3, 0.4))


@pytest.mark.parametrize("times_s", [(0.05,), (0.05, 0.35), (0.1, 0.4, 0.7)])
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.05])
def test_hits_that_are_apart_are_counted(times_s, noise):
    x = np.sum([ringing(at, 100.0 - 20 * i, seconds=1.0) for i, at in enumerate(times_s)], axis=0)
    hits = hits_of(x + 7.0 + np.random.default_rng(2).normal(0, 100 * noise, x.size), RATE)
    assert [hit.first / RATE for hit in hits] == pytest.approx(times_s, abs=1e-3)


def test_one_event_is_one_hit():
    """A bounce within milliseconds, a small rebound, slow oscillation, beats, noise, a step, and
    silence."""
    t = np.arange(100_000) / RATE
    single_hits = {
        "bounce": ringing(0.05) + ringing(0.062),
        "small rebound": ringing(0.05, seconds=1.0) + ringing(0.5, 15.0, seconds=1.0),
        "sine of 1 Hz": np.sin(2 * np.pi * t),
        "beats": np.exp(-3 * t) * (np.sin(2 * np.pi * 800 * t) + np.sin(2 * np.pi * 810 * t)),
        "noise": np.random.default_rng(3).normal(size=100_000),
        "half sine": np.where(t < 0.011, np.sin(np.pi * t / 0.011), 0.0),
    }
    assert {
        name: len(hits_of(record, RATE)) for name, record in single_hits.items()
    } == dict.fromkeys(single_hits, 1)
    assert len(hits_of(np.array([0.0, 1.0]), 10.0)) == 1
    assert hits_of(np.zeros(100), RATE) == [] and hits_of(np.array([]), RATE) == []
