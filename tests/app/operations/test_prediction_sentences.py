"""Warnings of random predictions: each is allowed by its rule, none claims what its numbers do not
say, and each number stands in the table of what is known."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.operations.predict.nearest_shots import velocity_basis
from pyroshock.app.operations.predict.validity import (
    beyond_rows,
    extrapolation_sentence,
    outside_sentence,
    warning_sentences,
)
from pyroshock.app.operations.sentence import (
    BETWEEN,
    BEYOND,
    EXCEEDS,
    INSIDE,
    UnfoundedSentenceError,
)
from pyroshock.dataset.validity_limits import BETWEEN_LEVELS
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact_interface import Extrapolation, OutOfDomain
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.prediction import Prediction, RestsOn
from support.records.twin_parts import BENCH, HalfSine, setting

QUANTITIES = (
    "tank_pressure_pa", "bullet_mass_kg", "impactor_mass", "impact_velocity", "tip_radius",
    "plate_youngs_modulus", "tip_yield_strength", "tip_density", "plate_thickness", "humidity",
)  # fmt: skip
REASONS = (BETWEEN_LEVELS, "lies beyond what was recorded", "was never recorded together with X")
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
SHOT = Twin(HalfSine(), gun=GunStage(BENCH, 0.05)).predict(
    setting(tank_pressure_pa=3e5), draws=4, rng=np.random.default_rng(0)
)
values = st.floats(1e-3, 1e12, allow_nan=False).map(lambda value: float(f"{value:.6g}"))


@st.composite
def ranges(draw: st.DrawFn) -> tuple[float, float]:
    low, high = sorted((draw(values), draw(values)))
    return low, high


@st.composite
def extrapolations(draw: st.DrawFn) -> Extrapolation:
    low, high = draw(ranges())
    value = draw(st.sampled_from((0.9 * low, 1.1 * high)))
    return Extrapolation(draw(st.sampled_from(QUANTITIES)), value, low, high)


@st.composite
def out_of_domain(draw: st.DrawFn) -> OutOfDomain:
    name, value = draw(st.sampled_from(QUANTITIES)), draw(values)
    if draw(st.booleans()):
        return OutOfDomain(name, value, "up to the yield")
    low, high = draw(ranges())
    return OutOfDomain(name, value, "a range", draw(st.sampled_from(REASONS)), (low, high))


@st.composite
def predictions(draw: st.DrawFn) -> Prediction:
    pressure = draw(st.sampled_from((3e5, 9e5, 50e5)))
    return replace(
        SHOT,
        setting=replace(SHOT.setting, tank_pressure_pa=pressure),
        extrapolation=tuple(draw(st.lists(extrapolations(), max_size=3))),
        outside=tuple(draw(st.lists(out_of_domain(), max_size=3))),
        rests_on=RestsOn(draw(st.sampled_from((0, 5))), "half-sine", "Shots."),
    )


@settings(max_examples=300, deadline=None)
@given(predictions(), st.sampled_from(("bench", "si")))
def test_claims_are_allowed_and_their_numbers_stand_in_the_table(
    prediction: Prediction, units: Any
) -> None:
    with shown_in(units):
        claims, rows = warning_sentences(prediction), beyond_rows(prediction)
        assert len(claims) == len(rows)
        for claim, row in zip(claims, rows, strict=True):
            assert claim.rule is None or claim.rule.allows(**claim.evidence)
            stated = {number for cell in map(str, row.values()) for number in _found(cell)}
            assert set(_found(claim.text)) <= stated, f"{claim}: {row}"
    assert [claim.rule for claim in claims].count(EXCEEDS) <= 1


@given(out_of_domain())
def test_a_value_lies_between_levels_only_where_it_does(item: OutOfDomain) -> None:
    claim = outside_sentence(item, "models:/tree@1")
    between = bool(item.ends) and item.ends[0] < float(item.value) < item.ends[-1]
    assert (claim.rule is BETWEEN) == (between and item.reason == BETWEEN_LEVELS)
    assert ("lies between" in claim.text) == (claim.rule is BETWEEN)


@given(st.sampled_from(QUANTITIES), ranges(), st.floats(0.0, 1.0))
def test_a_value_within_the_range_is_no_extrapolation(
    quantity: str, ends: tuple[float, float], place: float
) -> None:
    value = min(max(ends[0] + place * (ends[1] - ends[0]), ends[0]), ends[1])
    with pytest.raises(UnfoundedSentenceError):
        extrapolation_sentence(Extrapolation(quantity, value, *ends))


@given(st.lists(values, min_size=1, max_size=9), values)
def test_the_velocity_is_extrapolated_beyond_the_measured_pressures_alone(
    pressures: list[float], pressure: float
) -> None:
    gun = SimpleNamespace(shots=_Shots(np.array(pressures)))
    built: Any = SimpleNamespace(twin=SimpleNamespace(gun=gun))
    claim = velocity_basis(built, pressure)
    assert claim is not None and claim.rule in (INSIDE, BEYOND)
    inside = 0.99 * min(pressures) <= pressure <= 1.01 * max(pressures)
    assert (claim.rule is INSIDE) == inside == ("extrapolation" not in claim.text)


class _Shots:
    def __init__(self, tank_pressure_pa: Any) -> None:
        self.tank_pressure_pa = tank_pressure_pa

    def __len__(self) -> int:
        return len(self.tank_pressure_pa)


def _found(text: str) -> list[str]:
    return _NUMBER.findall(text)
