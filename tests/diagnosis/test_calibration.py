"""The map from margins to probabilities."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.calibration import CalibrationMap, shipped
from scipy.optimize import brentq

STAGES = (("gun",), ("contact",), ("plate",), ("gun", "contact", "plate"), ("contact", "plate"))
PLAIN = CalibrationMap(1.0, 0.0, 0.0, 0.0)
LOGS = st.dictionaries(
    st.sampled_from(["none", "unknown", "gun.blow_by", "gun.dead_volume", "gun.blow_by+gun.dead_volume"]),
    st.floats(-1e4, 1e4),
    min_size=1,
)


@given(LOGS)
def test_probabilities_sum_to_one_and_fall(logs: dict[str, float]) -> None:
    for stages in STAGES:
        found = list(shipped(stages)(logs).values())
        assert sum(found) == pytest.approx(1.0)
        assert found == sorted(found, reverse=True)


@given(LOGS, st.floats(-1e3, 1e3))
def test_only_margins_count(logs: dict[str, float], shift: float) -> None:
    moved = {name: value + shift for name, value in logs.items()}
    for name, p in PLAIN(logs).items():
        assert PLAIN(moved)[name] == pytest.approx(p, abs=1e-6)


def test_huge_margins_leave_something_to_doubt() -> None:
    """A thousand nats are not a probability of one: laws are never quite the bench's."""
    assert 1e-9 < PLAIN({"gun.blow_by": 0.0, "unknown": -1000.0})["unknown"] < 0.01


def test_learns_to_doubt_what_is_too_sure() -> None:
    """Evidence that is four nats ahead and wrong in four of ten cases."""
    rng = np.random.default_rng(0)
    campaigns = []
    for _ in range(400):
        right = bool(rng.random() < 0.6)
        logs = {"gun.blow_by": 4.0 if right else 0.0, "gun.dead_volume": 0.0 if right else 4.0, "none": -50.0}
        campaigns.append((logs, "gun.blow_by"))
    learned = CalibrationMap.learned(campaigns, "a test")
    assert learned({"gun.blow_by": 4.0, "gun.dead_volume": 0.0, "none": -50.0})["gun.blow_by"] == pytest.approx(
        0.6, abs=0.06
    )


def test_learns_an_intercept_for_none() -> None:
    """None that comes out true more often than its evidence says."""
    campaigns = [({"none": 0.0, "gun.blow_by": 0.0}, "none")] * 90 + [
        ({"none": 0.0, "gun.blow_by": 0.0}, "gun.blow_by")
    ] * 10
    assert CalibrationMap.learned(campaigns, "a test")({"none": 0.0, "gun.blow_by": 0.0})["none"] > 0.8


def test_shares_of_truths_are_those_of_the_campaigns_to_come() -> None:
    """Unknown causes came twice as often in what it learns from as they will: alike, each of them counts half."""
    logs = {"none": 0.0, "unknown": 0.0, "gun.blow_by": 0.0, "gun.blow_by+gun.dead_volume": 0.0}
    shares = {"none": 0.3, "unknown": 0.3, "single": 0.3, "pair": 0.1}
    truths = ["none"] * 300 + ["unknown"] * 600 + ["gun.blow_by"] * 100 + ["gun.blow_by+gun.dead_volume"] * 50
    found = CalibrationMap.learned([(logs, truth) for truth in truths], "a test", shares=shares)(logs)
    assert found["unknown"] == pytest.approx(0.3, abs=0.02)
    assert found["gun.blow_by+gun.dead_volume"] == pytest.approx(0.1, abs=0.02)
    assert CalibrationMap.learned([(logs, truth) for truth in truths], "a test")(logs)["unknown"] > 0.5


def test_nothing_to_learn_from_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing to learn from"):
        CalibrationMap.learned([({"none": 0.0}, "gun.blow_by")], "a test")


def test_few_campaigns_hardly_move_a_map() -> None:
    """What is learned on one kind of campaign starts from what holds for all."""
    usual = CalibrationMap(1.5, 1.0, -1.0, -1.5)
    few = [({"none": 0.0, "gun.blow_by": 1.0}, "none")] * 2
    learned = CalibrationMap.learned(few, "two", usual)
    assert learned.slope == pytest.approx(1.5, rel=0.3)
    assert learned.none == pytest.approx(1.0, abs=0.6)
    assert learned.pair == pytest.approx(-1.5, abs=1e-2)


@pytest.mark.parametrize("stages", STAGES)
def test_the_shipped_maps_tell_their_source(stages: tuple[str, ...]) -> None:
    assert shipped(stages).source
    assert shipped(stages).slope > 0


def test_one_stage_has_a_map_of_its_own() -> None:
    assert len({shipped((stage,)).slope for stage in ("gun", "contact", "plate")}) == 3
    assert shipped(("contact", "plate")) == shipped(("gun", "contact", "plate"))


def test_probability_is_the_logit_of_the_compressed_margin() -> None:
    """exp(slope asinh(margin / 2) + intercept) in proportion; asinh(-1) and asinh(-3/4) have closed forms."""
    one = CalibrationMap(2.0, none=0.5, unknown=-0.5, pair=1.0)
    found = one({"a": 7.0, "b": 5.0, "none": 5.5, "unknown": 7.0, "a+b": 7.0})
    back, less = np.sqrt(2) - 1, 0.5
    weights = {"a": 1.0, "b": back**2, "none": less**2 * np.exp(0.5), "unknown": np.exp(-0.5), "a+b": np.exp(1.0)}
    assert found == pytest.approx({name: weight / sum(weights.values()) for name, weight in weights.items()})
    assert list(found) == ["a+b", "a", "unknown", "none", "b"]


def test_equal_hypotheses_stay_in_their_order() -> None:
    assert list(PLAIN({"b": 1.0, "c": 2.0, "a": 1.0})) == ["c", "b", "a"]


def test_learned_intercept_is_where_likelihood_and_prior_balance() -> None:
    """Two hypotheses alike: t = w_none - sum(w) / (1 + exp(-t)) by the derivative of loss and prior."""

    def balance(none: float, both: float) -> float:
        return float(brentq(lambda t: none - both / (1 + np.exp(-t)) - t, -5, 5))

    logs = {"none": 3.0, "gun.blow_by": 3.0}
    one = CalibrationMap.learned([(logs, "none")], "one")
    assert (one.none, one.slope) == (pytest.approx(balance(1, 1), abs=2e-3), pytest.approx(1, abs=2e-3))
    shares = {"none": 0.3, "single": 0.1, "unknown": 0.5, "pair": 0.1}
    two = CalibrationMap.learned([(logs, "none"), (logs, "gun.blow_by")], "two", shares=shares)
    assert two.none == pytest.approx(balance(1.5, 2), abs=2e-3)
