"""The verdict on a design: what is wrong is named, and the cure that it names cures it."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.doe.designs.base import Design
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.designs.repeats import replicated, with_centre_points
from pyroshock.doe.designs.two_level import fractional_factorial, plackett_burman
from pyroshock.doe.factors import DesignFactor
from pyroshock.doe.merit.verdict import PlanVerdict, judge
from pyroshock.doe.order import run_order
from pyroshock.doe.space import Space, gun_space, space_of

GUN = gun_space()


def _judged(space: Space, rows: NDArray[np.int64], **layout: Any) -> PlanVerdict:
    return judge(space, rows[run_order(space, rows, np.random.default_rng(1), **layout)]).verdict


def _texts(verdict: PlanVerdict, weight: str) -> str:
    return " ".join(reason.text for reason in verdict.reasons if reason.weight == weight)


def test_thesis_plan_is_usable_for_its_plate_goes_with_time_and_blocks_cure_it() -> None:
    rows = balance_levels(GUN, 105, np.random.default_rng(0)).treatments
    usual = _judged(GUN, rows)
    assert usual.word == "usable" and "1 caution;" in usual.sentence
    assert re.search(
        r"drift of the bench cannot be told from the effect of plate material \(7\d %",
        _texts(usual, "caution"),
    )
    for layout in ({"blocks": 2}, {"kind": "random"}):
        cured = _judged(GUN, rows, **layout)
        assert cured.word == "good" and cured.sentence.startswith("The plan is good")
    assert "plate material (2 for 2 levels)" in _texts(usual, "note")
    assert "plate material" not in _texts(_judged(GUN, rows, kind="random"), "note")


def test_repeats_are_asked_for_until_there_are_some() -> None:
    design = Design(GUN, balance_levels(GUN, 54, np.random.default_rng(0)).treatments, "lhs", 0)
    assert "No treatment is run twice" in _texts(_judged(GUN, design.treatments), "note")
    twice = replicated(design, 2)
    assert len(twice.treatments) == 108 and "replicates=2" in twice.method
    assert "No treatment is run twice" not in _texts(_judged(GUN, twice.treatments), "note")


def test_missing_level_is_named_and_poor() -> None:
    rows = GUN.all_treatments()
    verdict = _judged(GUN, rows[rows[:, 0] == 0])
    assert verdict.word == "poor" and "plate material has no run at steel" in _texts(
        verdict, "fault"
    )


def test_cure_of_low_power_is_as_many_runs_as_it_says() -> None:
    rows = balance_levels(GUN, 24, np.random.default_rng(0)).treatments
    verdict = _judged(GUN, rows)
    (reason,) = [
        reason
        for reason in verdict.reasons
        if "standard deviations of a run is seen" in reason.text
    ]
    assert "anvil material and insulator" in reason.text
    (needed,) = re.findall(r"about (\d+) runs", reason.cure)
    more = balance_levels(GUN, int(needed) + 4, np.random.default_rng(0)).treatments
    assert not any(
        "is seen with a chance below" in reason.text for reason in _judged(GUN, more).reasons
    )
    few = _judged(GUN, rows[:10])
    assert few.word == "poor" and "10 runs are too few" in _texts(few, "fault")
    assert "No factor is varied in 1 run" in _texts(_judged(GUN, rows[:1]), "fault")


def test_confounding_above_half_is_named_with_its_cure() -> None:
    three = _judged(GUN, plackett_burman(GUN, categorical="first-last").treatments)
    (reason,) = [
        reason for reason in three.reasons if "confounded with interactions" in reason.text
    ]
    assert "(1.00)" in reason.text and "--resolution 4" in reason.cure
    four = _judged(
        GUN, fractional_factorial(GUN, resolution=4, categorical="first-last").treatments
    )
    assert not any("confounded with interactions" in reason.text for reason in four.reasons)
    assert "interactions of two factors are confounded with each other" in _texts(four, "note")
    assert "No more than two levels" in _texts(four, "note")
    rows = GUN.all_treatments()
    together = rows[
        (rows[:, 2] == rows[:, 3]) | (np.arange(len(rows)) % 19 == 0)
    ]  # tip material and radius
    verdict = _judged(GUN, together)
    assert "tip material and tip radius" in " ".join(
        reason.text for reason in verdict.reasons if "Main effects that" in reason.text
    )


def test_centre_points_lie_in_the_middle_and_words_take_turns() -> None:
    design = Design(GUN, GUN.all_treatments()[:8], "factorial", None)
    with_centre = with_centre_points(design, 10, np.random.default_rng(2))
    centre = with_centre.treatments[8:]
    assert len(centre) == 10 and with_centre.method == "factorial centre_points=10"
    names = [axis.name for axis in GUN.axes]
    assert {*centre[:, names.index("tip_radius")].tolist()} == {1}
    assert {*centre[:, names.index("velocity_level")].tolist()} == {1}
    assert np.bincount(centre[:, names.index("anvil_material+insulator")]).tolist() == [2] * 5
    assert with_centre_points(design, 0, np.random.default_rng(2)) is design
    words = space_of("w", "gun", [DesignFactor("a", "a", ("x", "y"), None, False, 0)])
    with pytest.raises(ValueError, match="no ordered factor"):
        with_centre_points(
            Design(words, words.all_treatments(), "factorial", None), 2, np.random.default_rng(0)
        )
    with pytest.raises(ValueError, match="centre points are -1"):
        with_centre_points(design, -1, np.random.default_rng(0))
    with pytest.raises(ValueError, match="replicates is 0"):
        replicated(design, 0)
