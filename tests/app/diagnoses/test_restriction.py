"""`--with` and `--without`: which effects are left, what a report says of it, and what is refused."""

from __future__ import annotations

import pytest
from pyroshock.app.diagnose.request import considered_effects, restriction_sentences

GUN = ("gun.back_pressure", "gun.blow_by", "gun.valve_flow", "sensor.velocity_gain")


@pytest.mark.parametrize(
    ("only", "without", "effects"),
    [
        ((), (), GUN),
        (("gun.valve_flow", "gun.blow_by"), (), ("gun.blow_by", "gun.valve_flow")),
        ((), ("gun.blow_by",), ("gun.back_pressure", "gun.valve_flow", "sensor.velocity_gain")),
        (("gun.valve_flow", "gun.blow_by"), ("gun.blow_by",), ("gun.valve_flow",)),
    ],
)
def test_effects_that_are_left(only, without, effects) -> None:
    assert considered_effects("spring", GUN, only, without) == effects


def test_unknown_effect_is_named_with_those_that_there_are() -> None:
    with pytest.raises(LookupError, match=r"--with 'gun.magic': the catalogue has no such effect; it has gun.back_p"):
        considered_effects("spring", GUN, ("gun.magic",))


def test_effect_that_the_campaign_cannot_show_is_named_with_those_that_it_can() -> None:
    message = (
        r"--without plate.damping: the channels of spring cannot show this effect; they can show gun.back_pressure"
    )
    with pytest.raises(ValueError, match=message):
        considered_effects("spring", GUN, (), ("plate.damping",))


def test_no_effect_left_is_refused() -> None:
    with pytest.raises(ValueError, match="leave no effect to consider for spring"):
        considered_effects("spring", GUN, ("gun.blow_by",), ("gun.blow_by",))


def test_each_restriction_has_its_sentence() -> None:
    assert restriction_sentences() == ()
    only, without = restriction_sentences(("gun.blow_by",), ("gun.valve_flow", "gun.back_pressure"))
    assert "only gun.blow_by" in only
    assert "not consider gun.valve_flow, gun.back_pressure" in without
