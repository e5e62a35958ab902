"""The table of effects: the names of the catalogue, and switches that behave."""

from __future__ import annotations

import json
import math

import pytest
from pyroshock.virtualbench.effects import CATALOGUE, SIGNED, Effects, EffectSwitch


def test_names_are_the_catalogue_and_the_habits(effect_ids: list[str]) -> None:
    assert len(effect_ids) == 25
    assert [name for name in CATALOGUE if not name.startswith("bench.")] == effect_ids
    habits = [name for name in CATALOGUE if name.startswith("bench.")]
    assert habits == ["bench.hand_scatter", "bench.trigger_jitter", "bench.drift", "bench.noise"]


def test_signed_effects_are_known() -> None:
    assert set(CATALOGUE) >= SIGNED


def test_default_bench_has_all_at_one() -> None:
    assert dict(Effects.default()) == dict.fromkeys(CATALOGUE, 1.0)


def test_ideal_bench_has_none() -> None:
    assert dict(Effects.none()) == dict.fromkeys(CATALOGUE, 0.0)


def test_only_leaves_the_others_off() -> None:
    effects = Effects.only("gun.blow_by", 0.5)
    assert effects["gun.blow_by"] == 0.5
    assert sum(effects.values()) == 0.5


def test_strength_changes_one_and_leaves_the_original() -> None:
    default = Effects.default()
    stronger = default.with_strength("plate.damping", -0.3)
    assert {name for name in CATALOGUE if stronger[name] != default[name]} == {"plate.damping"}
    assert stronger["plate.damping"] == -0.3


def test_off_is_zero_and_remembers_its_strength() -> None:
    effects = Effects.default().with_strength("gun.blow_by", 2.0).without("gun.blow_by")
    assert effects["gun.blow_by"] == 0.0
    assert effects.effect("gun.blow_by").strength == 2.0
    assert effects.with_strength("gun.blow_by", 2.0)["gun.blow_by"] == 2.0


def test_seal_gives_the_same_bench_back() -> None:
    effects = Effects.default().with_strength("sensor.force_gain", -2.5).without("gun.blow_by")
    again = Effects.from_json(json.loads(json.dumps(effects.as_json())))
    assert again == effects
    assert hash(again) == hash(effects)


def test_order_of_giving_does_not_matter() -> None:
    first, second = EffectSwitch("gun.blow_by"), EffectSwitch("bench.noise", strength=3.0)
    assert Effects((first, second)) == Effects((second, first))


@pytest.mark.parametrize("name", ["gun.blowby", "gun", "", "twin.noise"])
def test_unknown_name_lists_the_known(name: str) -> None:
    for ask in (EffectSwitch, Effects.only, Effects.default().__getitem__, Effects.default().without):
        with pytest.raises(ValueError, match=r"unknown effect .*gun\.blow_by.*bench\.noise"):
            ask(name)
    assert name not in Effects.default()


@pytest.mark.parametrize("strength", [math.nan, math.inf, -math.inf])
def test_strength_is_a_number(strength: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        Effects.only("sensor.force_gain", strength)


def test_only_signed_effects_go_below_zero() -> None:
    assert Effects.only("sensor.force_gain", -1.0)["sensor.force_gain"] == -1.0
    with pytest.raises(ValueError, match=r"gun\.blow_by = -1\.0"):
        Effects.only("gun.blow_by", -1.0)


def test_effect_given_twice_is_refused() -> None:
    with pytest.raises(ValueError, match=r"given twice: \['gun\.blow_by'\]"):
        Effects((EffectSwitch("gun.blow_by"), EffectSwitch("gun.blow_by", strength=2.0)))


def test_table_cannot_be_changed() -> None:
    with pytest.raises((AttributeError, TypeError)):
        Effects.default().given = ()  # type: ignore[misc]


def test_seal_with_other_keys_is_refused() -> None:
    with pytest.raises(ValueError, match="'on' and 'strength'"):
        Effects.from_json({"gun.blow_by": {"strength": 1.0}})
