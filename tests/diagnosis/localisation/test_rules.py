"""Rules over factors, in the words of a campaign's files."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.localisation.rules import holds, rules, short_between
from pyroshock.diagnosis.record import Configuration
from support.records.toy_bench import Design

CONFIGURATIONS = Design().configurations()


def test_thresholds_have_the_units_of_the_files() -> None:
    texts = [rule.text for rule in rules(CONFIGURATIONS)]
    assert "tank_pressure_bar > 3" in texts
    assert "insulator = polymeric" in texts
    assert "bullet_mass_kg <= 0.4" in texts


def test_a_rule_reads_back_as_what_it_holds_for() -> None:
    for rule in rules(CONFIGURATIONS):
        assert [holds(rule.text, each.factors) for each in CONFIGURATIONS] == rule.inside.tolist()


def test_rules_for_the_same_configurations_are_one() -> None:
    found = rules(CONFIGURATIONS)
    assert len({rule.inside.tobytes() for rule in found}) == len(found)


def test_other_than_a_level_needs_three_levels() -> None:
    three = [Configuration(str(i), {"anvil_material": ["none", "steel", "aluminum"][i % 3]}) for i in range(9)]
    assert "anvil_material != none" in [rule.text for rule in rules(three)]
    assert not any("!=" in rule.text for rule in rules(CONFIGURATIONS))


def test_unknown_factor_is_refused() -> None:
    with pytest.raises(LookupError, match="no factor 'weather'; there are: insulator"):
        holds("weather = dry", {"insulator": "none"})


def test_text_without_a_sign_is_refused() -> None:
    with pytest.raises(ValueError, match="is no rule"):
        holds("everywhere", {"insulator": "none"})


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_short_number_lies_between(low: float, apart: float) -> None:
    if low + apart > low:
        number = short_between(low, low + apart)
        assert low <= number < low + apart or np.isclose(number, low)
