"""What a reading in the wrong unit is off by."""

from __future__ import annotations

import re

import pytest
from pyroshock.ingest.channel_mistakes import unit_mistakes
from pyroshock.signals.units import to_si


@pytest.mark.parametrize("quantity", ["force", "acceleration", "velocity", "pressure"])
def test_a_mistake_of_unit_is_off_by_the_ratio_of_both_units(quantity: str) -> None:
    found = [
        (factor, re.fullmatch("values in (.+) where (.+) is declared", text))
        for factor, text in unit_mistakes(quantity)
    ]
    units = [(factor, *match.groups()) for factor, match in found if match]
    assert len(units) >= 6
    for factor, written, declared in units:
        assert factor == pytest.approx(to_si(declared, quantity)[0] / to_si(written, quantity)[0], rel=1e-6)


def test_a_gain_can_be_forgotten_or_too_much() -> None:
    gains = {factor for factor, text in unit_mistakes("acceleration") if "gain" in text}
    assert gains == {10.0, 100.0, 0.1, 0.01}
