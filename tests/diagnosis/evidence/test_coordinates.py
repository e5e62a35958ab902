"""Where parameters are looked for."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.coordinates import sheets
from pyroshock.twin.effects import Effect, catalogue

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
