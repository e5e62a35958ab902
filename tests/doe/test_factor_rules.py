"""Rules over factors, in the words of a campaign's files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.doe.factor_rules import holds, rules, short_between
from support.records.toy_bench import Design

SETTINGS = [configuration.factors for configuration in Design().configurations()]


def test_rules_speak_the_words_of_the_files() -> None:
    texts = [rule.text for rule in rules(SETTINGS)]
    assert "tank_pressure_bar > 3" in texts
    assert "insulator = polymeric" in texts
    assert "bullet_mass_kg <= 0.4" in texts
    texts = [rule.text for rule in rules(STRIKERS)]
    assert {f"striker = {word}" for word in WORDS} <= set(texts)
    assert "shot by whom = Ann" in texts
    assert "shot by whom = Bo and Cy" in texts
    three = [{"anvil_material": ["none", "steel", "aluminum"][i % 3]} for i in range(9)]
    assert "anvil_material != none" in [rule.text for rule in rules(three)]
    assert not any("!=" in rule.text for rule in rules(SETTINGS))


def test_a_rule_reads_back_as_what_it_holds_for() -> None:
    for rule in rules(SETTINGS):
        assert [holds(rule.text, setting) for setting in SETTINGS] == rule.inside.tolist()


def test_rules_for_the_same_settings_are_one() -> None:
    results = rules(SETTINGS)
    assert len({rule.inside.tobytes() for rule in results}) == len(results)
    # Only one bullet was ever shot by that striker.
    confounded = [{"bullet_mass": [0.25, 0.5][i % 2], "striker": ["127 mm", "254 mm"][i % 2]} for i in range(8)]
    results = {rule.text: rule.same for rule in rules(confounded)}
    assert results["bullet_mass_kg > 0.4"] == ("striker = 254 mm",)


#: As laboratories write them: lengths, names with an "and", signs, a number that is a name, a column with blanks.
WORDS = ["254 mm", "127 mm", "PLA and steel", "a = b", "254"]
STRIKERS = [
    {"striker": WORDS[i % 5], "shot by whom": "Ann" if i % 2 else "Bo and Cy", "tank_pressure": 1e5 * i}
    for i in range(20)
]


def test_a_rule_with_free_text_reads_back_as_what_it_holds_for() -> None:
    for rule in rules(STRIKERS):
        assert [holds(rule.text, setting) for setting in STRIKERS] == rule.inside.tolist(), rule.text


def test_numbers_beside_words_are_levels() -> None:
    # A column of lengths in which somebody wrote a word: the ingest keeps numbers as numbers.
    mixed = [{"striker": [254.0, 127.0, "long"][i % 3]} for i in range(9)]
    results = {rule.text: rule.inside.tolist() for rule in rules(mixed)}
    assert results["striker = 254"] == [i % 3 == 0 for i in range(9)]
    assert results["striker = long"] == [i % 3 == 2 for i in range(9)]
    mixed = [{"serial": [1000001.0, 1000002.0, "none"][i % 3]} for i in range(9)]
    assert {"serial = 1000001", "serial = 1000002"} <= {rule.text for rule in rules(mixed)}


def test_text_that_is_no_rule_is_refused() -> None:
    with pytest.raises(LookupError, match="no factor 'weather'; there are: insulator"):
        holds("weather = dry", {"insulator": "none"})
    with pytest.raises(ValueError, match="is no rule"):
        holds("everywhere", {"insulator": "none"})


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_short_number_lies_between(low: float, apart: float) -> None:
    if low + apart > low:
        number = short_between(low, low + apart)
        assert low <= number < low + apart or np.isclose(number, low)
