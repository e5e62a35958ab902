from __future__ import annotations

import numpy as np
import pytest
from pyroshock.signals.checks.rest_level import check_rest_level

HEIGHT = 1000.0


def shock(offset=0.0, begin=1000):
    """A decaying sine of 1000 m/s2 on a level of its own, with noise of 1."""
    t = np.arange(16384) - begin
    wave = np.where(t >= 0, np.exp(-np.maximum(t, 0) / 500.0) * np.sin(0.2 * t), 0.0)
    return (
        offset + HEIGHT * wave / np.abs(wave).max() + np.random.default_rng(0).normal(size=t.size)
    )


@pytest.mark.parametrize("share", [0.22, 0.5, 1.0, 1.58, -0.4])
def test_offset_of_a_fifth_of_the_peak_is_rejected(channel_of, share):
    (finding,) = check_rest_level(channel_of(shock(share * HEIGHT), "acceleration"), ())
    assert finding.severity == "reject"
    assert finding.evidence["before_m_s2"] == pytest.approx(share * HEIGHT, rel=0.01)
    assert finding.evidence["peak_share"] == pytest.approx(abs(share), rel=0.02)


@pytest.mark.parametrize(
    ("share", "severities"),
    [(0.0, []), (0.003, []), (0.03, ["note"]), (0.06, ["warning"]), (-0.15, ["warning"])],
)
def test_smaller_offset_is_graded(channel_of, share, severities):
    findings = check_rest_level(channel_of(shock(share * HEIGHT), "acceleration"), ())
    assert [finding.severity for finding in findings] == severities


def test_gravity_is_a_note_and_the_level_after_is_taken_where_nothing_lies_before(channel_of):
    """The same record at a tenth of the height: 9.8 m/s2 are a tenth of its peak. Other channels
    may rest where they like."""
    (finding,) = check_rest_level(channel_of(shock() / 10.0 - 9.80665, "acceleration"), ())
    assert (finding.severity, finding.evidence["could_be_gravity"]) == ("note", True)
    (finding,) = check_rest_level(channel_of(shock(300.0, begin=3), "acceleration"), ())
    assert finding.severity == "reject"
    assert finding.evidence["after_m_s2"] == pytest.approx(300.0, rel=0.01)
    for quantity, more in (("force", {}), ("acceleration", {"position": "hammer"})):
        assert check_rest_level(channel_of(shock(500.0), quantity, **more), ()) == []
