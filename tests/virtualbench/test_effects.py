"""The table of effects: the names of the catalogue, and switches that behave."""

from __future__ import annotations

import json
import math

import pytest
from pyroshock.virtualbench.effects import CATALOGUE, SIGNED, Effects, EffectSwitch


def test_names_and_benches_are_those_of_the_catalogue(effect_ids: list[str]) -> None:
    assert len(effect_ids) == 25
    assert [name for name in CATALOGUE if not name.startswith("bench.")] == effect_ids
    habits = [name for name in CATALOGUE if name.startswith("bench.")]
    assert habits == ["bench.hand_scatter", "bench.trigger_jitter", "bench.drift", "bench.noise"]
    assert set(CATALOGUE) >= SIGNED
    assert dict(Effects.default()) == dict.fromkeys(CATALOGUE, 1.0)
    assert dict(Effects.none()) == dict.fromkeys(CATALOGUE, 0.0)
    effects = Effects.only("gun.blow_by", 0.5)
    assert effects["gun.blow_by"] == 0.5
    assert sum(effects.values()) == 0.5
    default = Effects.default()
    stronger = default.with_strength("plate.damping", -0.3)
    assert {name for name in CATALOGUE if stronger[name] != default[name]} == {"plate.damping"}
    assert stronger["plate.damping"] == -0.3
    effects = Effects.default().with_strength("gun.blow_by", 2.0).without("gun.blow_by")
    assert effects["gun.blow_by"] == 0.0
    assert effects.effect("gun.blow_by").strength == 2.0
    assert effects.with_strength("gun.blow_by", 2.0)["gun.blow_by"] == 2.0


def test_bench_is_the_same_out_of_its_seal_and_in_any_order() -> None:
    effects = Effects.default().with_strength("sensor.force_gain", -2.5).without("gun.blow_by")
    again = Effects.from_json(json.loads(json.dumps(effects.as_json())))
    assert again == effects
    assert hash(again) == hash(effects)
    first, second = EffectSwitch("gun.blow_by"), EffectSwitch("bench.noise", strength=3.0)
    assert Effects((first, second)) == Effects((second, first))


@pytest.mark.parametrize("name", ["gun.blowby", "gun", "", "twin.noise"])
def test_unknown_name_lists_the_known(name: str) -> None:
    for ask in (
        EffectSwitch,
        Effects.only,
        Effects.default().__getitem__,
        Effects.default().without,
    ):
        with pytest.raises(ValueError, match=r"unknown effect .*gun\.blow_by.*bench\.noise"):
            ask(name)
    assert name not in Effects.default()


def test_what_is_no_bench_is_refused() -> None:
    for strength in (math.nan, math.inf, -math.inf):
        with pytest.raises(ValueError, match="finite"):
            Effects.only("sensor.force_gain", strength)
    assert Effects.only("sensor.force_gain", -1.0)["sensor.force_gain"] == -1.0
    with pytest.raises(ValueError, match=r"gun\.blow_by = -1\.0"):
        Effects.only("gun.blow_by", -1.0)
    with pytest.raises(ValueError, match=r"given twice: \['gun\.blow_by'\]"):
        Effects((EffectSwitch("gun.blow_by"), EffectSwitch("gun.blow_by", strength=2.0)))
    with pytest.raises(ValueError, match="'on' and 'strength'"):
        Effects.from_json({"gun.blow_by": {"strength": 1.0}})
    with pytest.raises((AttributeError, TypeError)):
        Effects.default().given = ()  # type: ignore[misc]
