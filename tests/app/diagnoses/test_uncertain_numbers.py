"""Names of uncertain numbers: each has one owner, and a slip of the pen is answered with the right name."""

from __future__ import annotations

import pytest
from pyroshock.app.diagnose.request import full_name, uncertain_numbers

EVERY = [(stage, number) for stage, numbers in uncertain_numbers().items() for number in numbers]


@pytest.mark.parametrize(("stage", "number"), EVERY)
def test_every_number_is_known_with_and_without_its_stage(stage: str, number: str) -> None:
    assert full_name(number) == full_name(f"{stage}.{number}") == f"{stage}.{number}"


@pytest.mark.parametrize(
    ("name", "nearest"), [("mass_bullet_kg", "gun.bullet_mass_kg"), ("contact.travel", "gun.travel_m")]
)
def test_a_slip_is_answered_with_the_nearest(name: str, nearest: str) -> None:
    with pytest.raises(ValueError, match=f"no number '{name}'; the nearest is {nearest}"):
        full_name(name)


def test_what_is_like_none_is_answered_with_all() -> None:
    with pytest.raises(ValueError, match=r"no number 'q'; there are gun\.tank_volume_m3, .*contact\.impactor_mass_kg"):
        full_name("q")
