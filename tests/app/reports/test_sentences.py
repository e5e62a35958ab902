"""Sentences of a diagnosis say what it found, and no more."""

from __future__ import annotations

import pytest
from pyroshock.app.common.number_format import join_words, number, percent, percent_range, times
from pyroshock.app.diagnose.wording import effect_title, shrinkage_line, where_lines
from pyroshock.twin.effects import catalogue
from support.records import verdicts


def test_nothing_to_shrink_is_said() -> None:
    assert shrinkage_line(verdicts.verdict().shrinkage[1]).endswith("; there was no error to reduce.")


def test_learned_correction_is_told_and_is_no_cause() -> None:
    told = shrinkage_line(verdicts.gun().shrinkage[0])
    assert told.endswith("97 % (95 to 98 %) of the error above the noise disappears. With a learned correction of the "
                         "rest 0.0085 would be left; a correction is not a cause.")  # fmt: skip
    assert "correction" not in shrinkage_line(verdicts.verdict().shrinkage[0])


def test_every_place_has_its_line() -> None:
    lines = list(where_lines(verdicts.verdict().where))
    assert len(lines) == 6
    assert lines[-1].startswith("peak force of the contact falls")


@pytest.mark.parametrize("identity", list(catalogue()))
def test_every_effect_has_a_title(identity: str) -> None:
    assert effect_title(identity).startswith(f"{identity}: ")


@pytest.mark.parametrize(
    ("share", "told"), [(1.0, "100 %"), (0.999, "> 99 %"), (0.93, "93 %"), (0.001, "< 1 %"), (0.0, "0 %")]
)
def test_near_certainty_is_not_certainty(share: float, told: str) -> None:
    assert percent(share) == told


@pytest.mark.parametrize(
    ("value", "told"), [(4000.0, "4000"), (0.0123456, "0.0123"), (2.9e7, "2.9e+07"), (3.4e-8, "3.4e-08")]
)
def test_numbers_have_three_digits(value: float, told: str) -> None:
    assert number(value) == told


def test_ranges_ratios_and_lists() -> None:
    assert percent_range(0.52, 0.68) == "52 to 68 %"
    assert [times(ratio) for ratio in (42.3, 9.96, 0.891)] == ["42", "10", "0.89"]
    assert [join_words("abc"[:count]) for count in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert join_words(["a", "b"], "or") == "a or b"


def test_what_is_no_number_is_a_dash() -> None:
    assert (number(float("nan")), percent(float("nan")), percent(float("inf"))) == ("–", "–", "–")
    assert percent_range(float("nan"), 0.3) == "interval not known"
