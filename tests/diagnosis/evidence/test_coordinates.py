"""Where parameters are looked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.coordinates import Axis, Sheet, sheets
from pyroshock.twin.effects import Effect, Value, catalogue, parameter

KINDS = pytest.mark.parametrize("kind", catalogue().values(), ids=lambda kind: kind.id)


@KINDS
def test_every_effect_is_looked_for(kind: type[Effect]) -> None:
    assert sheets(kind)


@KINDS
def test_values_stay_in_the_likely_range(kind: type[Effect]) -> None:
    likely = {item.name: item.likely for item in kind.parameters()}
    for sheet in sheets(kind):
        for axis in sheet.axes:
            ends = likely[axis.name]
            assert ends is not None
            values = axis.value(np.linspace(0, 1, 9))
            assert values.min() >= min(ends) - 1e-12
            assert values.max() <= max(ends) * (1 + 1e-12)
            assert np.all(np.diff(values) > 0) or np.all(np.diff(values) < 0)


@KINDS
def test_at_most_two_parameters_at_once(kind: type[Effect]) -> None:
    assert max(len(sheet.axes) for sheet in sheets(kind)) <= 2


@KINDS
def test_a_regime_leaves_the_others_off(kind: type[Effect]) -> None:
    off = {item.name: item.off for item in kind.parameters()}
    for sheet in sheets(kind):
        one = sheet.effects(np.full((1, len(sheet.axes)), 0.5))[0]
        for name, _ in sheet.fixed:
            assert getattr(one, name) == off[name]


def test_a_signed_parameter_is_looked_for_on_both_sides() -> None:
    gains = [float(sheet.axes[0].value(np.array(1.0))) for sheet in sheets(catalogue()["sensor.velocity_gain"])]
    assert min(gains) < 1 < max(gains)


U = np.linspace(0, 1, 11)


def test_an_axis_by_ratios_takes_equal_ratios() -> None:
    values = Axis("depth_m", "m", 1e-5, 5e-3, 0).value(U)
    assert (values[0], values[-1]) == pytest.approx((1e-5, 5e-3))
    np.testing.assert_allclose(values[1:] / values[:-1], 500**0.1)


@pytest.mark.parametrize(("start", "end"), [(1.0, 3.0), (0.5, -2.0)])
def test_an_axis_by_differences_takes_equal_steps(start: float, end: float) -> None:
    values = Axis("gain", "", start, end, 1).value(U)
    assert (values[0], values[-1]) == pytest.approx((start, end))
    np.testing.assert_allclose(np.diff(values), (end - start) / 10)


@pytest.mark.parametrize("end", [4.0, -2.0])
def test_an_axis_that_is_finer_where_small_has_equal_steps_of_the_root(end: float) -> None:
    values = Axis("share", "", 1.0, end, 2).value(U)
    np.testing.assert_allclose(np.sqrt((values - 1) / (end - 1)), U)


@pytest.mark.parametrize("power", [0, 1, 2])
def test_a_shorter_axis_goes_the_same_way(power: float) -> None:
    axis = Axis("share", "kg", 0.5, 8.0, power)
    short = axis.up_to(0.3)
    assert (short.name, short.unit, short.start, short.power) == ("share", "kg", 0.5, power)
    np.testing.assert_allclose(short.value(U), axis.value(0.3 * U))


def likely_of(low: float, high: float, *, off: float, default: float = 0.77) -> type[Effect]:
    @dataclass(frozen=True)
    class One(Effect):
        id = "gun.one"
        law = "none"
        source = "test"
        share: Value = parameter("a share", "kg", default=default, low=-1e9, high=1e9, off=off, likely=(low, high))  # noqa: RUF009 - a field()

    return One


@pytest.mark.parametrize(
    ("low", "high", "off", "ways"),
    [
        # both signs of what is off in between, the positive one first
        (-1.0, 2.0, 0.0, [(0.0, 2.0, 1), (0.0, -1.0, 1)]),
        (0.7, 1.4, 1.0, [(1.0, 1.4, 1), (1.0, 0.7, 1)]),
        # from "off" on, finer where it is small
        (0.0, 3.0, 0.0, [(0.0, 3.0, 2)]),
        (1.0, 3.0, 1.0, [(1.0, 3.0, 2)]),
        (-3.0, 0.0, 0.0, [(0.0, -3.0, 2)]),
        (-3.0, 2.0, 2.0, [(2.0, -3.0, 2)]),
        # a range that does not hold "off", from the end that is next to it
        (0.3, 20.0, 0.0, [(0.3, 20.0, 0)]),
        (0.3, 20.0, 1e6, [(20.0, 0.3, 0)]),
        (2.0, 2.5, 0.0, [(2.0, 2.5, 1)]),
        (2.0, 2.5, 4.0, [(2.5, 2.0, 1)]),
        # by ratios beyond a factor of 1.5
        (2.0, 3.0, 0.0, [(2.0, 3.0, 1)]),
        (2.0, 3.25, 0.0, [(2.0, 3.25, 0)]),
        # none by ratios of what is not positive
        (0.0, 3.0, -1.0, [(0.0, 3.0, 1)]),
        (-3.0, -1.0, 0.0, [(-1.0, -3.0, 1)]),
    ],
)
def test_ways_from_hardly_there_to_the_end(
    low: float, high: float, off: float, ways: list[tuple[float, float, float]]
) -> None:
    found = sheets(likely_of(low, high, off=off))
    assert [sheet.axes for sheet in found] == [(Axis("share", "kg", *way),) for way in ways]
    assert all(sheet.fixed == () for sheet in found)


@pytest.mark.parametrize(
    ("low", "high", "off", "power"),
    [
        (0.05, 0.8, 0.05, 0),
        (0.05, 0.8, 0.1, 0),
        (0.05, 0.8, 0.8, 0),
        (0.05, 0.8, 5.0, 0),
        (0.0, 0.8, 0.0, 1),
        (0.0, 0.8, 0.3, 1),
    ],
)
def test_what_only_shapes_an_effect_goes_from_low_to_high(low: float, high: float, off: float, power: float) -> None:
    """Its default is "off": it switches nothing off, so that neither end is nearer to none."""
    found = sheets(likely_of(low, high, off=off, default=off))
    assert [sheet.axes for sheet in found] == [(Axis("share", "kg", low, high, power),)]


@dataclass(frozen=True)
class ThreeWays(Effect):
    id = "gun.three_ways"
    law = "none"
    source = "test"
    size: Value = parameter("a size", "m", default=0.5, low=-9, high=9, off=0.0, likely=(-1.0, 2.0))  # noqa: RUF009 - a field()
    still: Value = parameter("not looked for", "", default=7.0, low=0, high=9, off=0.0)  # noqa: RUF009 - a field()
    turn: Value = parameter("an angle", "", default=2.0, low=-9, high=9, off=1.0, likely=(0.5, 3.0))  # noqa: RUF009 - a field()


@dataclass(frozen=True)
class Regimes(ThreeWays):
    id = "gun.regimes"
    regimes = (("size",), ("turn", "size"))


def test_each_sign_of_each_parameter_has_a_sheet() -> None:
    found = sheets(ThreeWays)
    ends = [tuple((axis.name, axis.end) for axis in sheet.axes) for sheet in found]
    assert ends == [(("size", size), ("turn", turn)) for size in (2.0, -1.0) for turn in (3.0, 0.5)]
    assert all(sheet.kind is ThreeWays and sheet.fixed == () for sheet in found)


def test_each_regime_has_its_sheets() -> None:
    found = sheets(Regimes)
    assert [tuple(axis.name for axis in sheet.axes) for sheet in found] == [("size",)] * 2 + [("size", "turn")] * 4
    assert [sheet.fixed for sheet in found] == [(("turn", 1.0),)] * 2 + [()] * 4


def test_effects_of_a_sheet_are_one_for_each_place() -> None:
    sheet = Sheet(ThreeWays, (Axis("turn", "", 1.0, 3.0, 1),), (("size", -0.5),))
    assert sheet.effects(np.array([[0.0], [0.25], [1.0]])) == [ThreeWays(-0.5, 7.0, turn) for turn in (1.0, 1.5, 3.0)]
    both = sheets(ThreeWays)[0]
    assert both.effects(np.array([[0.5, 0.0], [0.0, 0.5]])) == [ThreeWays(1.0, 7.0, 1.0), ThreeWays(0.0, 7.0, 2.0)]


def test_an_effect_without_a_likely_range_is_named() -> None:
    @dataclass(frozen=True)
    class Never(Effect):
        id = "gun.never"
        law = "none"
        source = "test"
        still: Value = parameter("not looked for", "", default=7.0, low=0, high=9, off=0.0)  # noqa: RUF009 - a field()

    with pytest.raises(ValueError, match=r"gun\.never: no parameter has a likely range"):
        sheets(Never)
