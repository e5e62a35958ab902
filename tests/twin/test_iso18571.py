"""The rating of ISO/TS 18571."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.iso18571 import pulse_rating, rating, warping_path

TIME = np.arange(200) / 200
PULSE = np.sin(np.pi * TIME) ** 2


def test_gain_shift_rest_and_warping_are_rated() -> None:
    """Equal records are rated one. Twice as high, a record is outside the corridor where above half
    the peak, and the phase alone is whole."""
    assert rating(PULSE, PULSE) == pytest.approx(1.0)
    assert rating(PULSE, 2 * PULSE) == pytest.approx(0.4 * 0.2865 + 0.2 + 0.0 + 0.2 * 0.5, abs=0.02)
    late = np.interp(TIME - 0.05, TIME, PULSE)
    assert rating(PULSE, late) == pytest.approx(rating(late, PULSE), abs=0.01)
    assert 0.8 < rating(PULSE, late) < 0.95
    ratings = [rating(PULSE, gain * PULSE) for gain in (1.0, 1.1, 1.3, 1.6)]
    assert ratings == sorted(ratings, reverse=True)
    late = np.interp(TIME - 0.02 * np.sin(np.pi * TIME), TIME, PULSE)
    path = warping_path(late, PULSE, 20)
    assert np.abs(late[path[:, 0]] - PULSE[path[:, 1]]).max() < 0.2 * np.abs(late - PULSE).max()
    assert (np.diff(path, axis=0) >= 0).all()


def test_constant_records_and_other_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="constant record"):
        rating(PULSE, np.zeros(200))
    with pytest.raises(ValueError, match="one length"):
        rating(PULSE, PULSE[:-1])


@pytest.mark.parametrize("contact", [TIME > 0.9, TIME < 0.1], ids=["end", "begin"])
def test_a_record_that_rests_for_most_of_its_time_is_rated(contact: np.ndarray) -> None:
    """Shifted, nothing but rest is left to correlate: that was a division by zero."""
    short = np.where(contact, np.sin(10 * np.pi * TIME) ** 2, 0.0)
    assert rating(short, short) == pytest.approx(1.0)
    assert 0 <= rating(short, 0.5 * short) < 1
    assert 0 <= rating(short, PULSE) < 0.7


def test_a_rectangle_and_a_pulse_without_the_rest_around_it_are_rated() -> None:
    """Within it there is neither slope nor variance."""
    step = np.where((TIME > 0.1) & (TIME < 0.3), 1.0, 0.0)
    assert rating(step, step) == pytest.approx(1.0)
    assert 0 <= rating(step, np.where(TIME > 0.95, 1.0, 0.0)) < 0.5
    # Rest before and after counts for nothing, at whatever rate; where there is no pulse there is
    # no rating.
    rested = np.concatenate([np.zeros(500), PULSE, np.zeros(500)])
    assert pulse_rating(rested, 1.2 * rested) == pytest.approx(
        pulse_rating(PULSE, 1.2 * PULSE), abs=0.01
    )
    assert pulse_rating(rested, rested) == pytest.approx(1.0)
    assert np.isnan(pulse_rating(np.zeros(100), np.zeros(100)))
    assert np.isnan(pulse_rating(np.full(200, np.nan), PULSE))


#: What objective-rating-metrics 1.3 (TU Graz, MIT) rates the pairs below, by
#: `ISO18571(...).overall_rating(-1)`. It is not installed with the tests: it brings twenty packages
#: that nothing else needs.
PEER_RATINGS = (
    0.596296975922, 0.741229774819, 0.728361862980, 0.530126362568, 0.778646403500, 0.673120643343,
    0.840606958367,
    0.696076106710, 0.585527107143, 0.811230319903, 0.565196244278, 0.789172881062, 0.671360504762,
    0.569277308179,
    0.628233912865, 0.661912537549, 0.801580212862, 0.547884100008, 0.507360445086, 0.633099729827,
)  # fmt: skip


def test_peer_agrees() -> None:
    rng = np.random.default_rng(0)
    for expected in PEER_RATINGS:
        n = int(rng.integers(60, 300))
        t = np.linspace(0, 1, n)
        one = np.sin(np.pi * t * rng.uniform(0.5, 3)) * rng.uniform(1, 100) + 0.1 * rng.normal(
            size=n
        )
        other = rng.uniform(0.6, 1.4) * np.interp(
            t * rng.uniform(0.9, 1.1) + rng.uniform(-0.1, 0.1), t, one
        )
        assert rating(one, other) == pytest.approx(expected, abs=1e-9)
