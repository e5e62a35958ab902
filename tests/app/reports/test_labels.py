"""Settings and figures are told in the units of the bench."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.documents.document import column_heading, force_unit, mean_and_spread, setting, settings_words


def test_known_factors_are_told_in_the_units_of_their_columns() -> None:
    assert setting("tip_radius_m").heading == "tip radius (mm)"
    assert setting("tip_radius_m").words(0.045) == "45 mm"
    assert setting("tank_pressure_pa").cell(38080.0) == 0.3808
    assert column_heading("tank_pressure_bar") == "tank pressure (bar)"


def test_free_factors_keep_their_names() -> None:
    assert setting("paint_job").named("green") == "paint job green"
    assert column_heading("paint_job") == "paint job"


def test_missing_layers_are_named() -> None:
    assert settings_words({"insulator": "none", "tip_material": "steel"}) == "no insulator, steel"
    assert setting("insulator").named("none") == "no insulator"
    assert settings_words({}) == "all alike"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ([5.5, 5.6, 5.7], "5.60 ± 0.10"),
        ([5.6], "5.6"),
        ([5.6, 5.6], "5.6"),
        ([1000.0, 1200.0], "1100 ± 141"),
        ([np.nan, 2.0], "2"),
        ([np.nan], None),
        ([], None),
    ],
)
def test_mean_and_spread(values: list[float], text: str | None) -> None:
    assert mean_and_spread(np.array(values, dtype=np.float64)) == text


@given(st.lists(st.floats(1e-6, 1e6), min_size=2, max_size=20))
def test_mean_is_told_to_a_tenth_of_the_spread(values: list[float]) -> None:
    array = np.array(values)
    text = mean_and_spread(array)
    assert text is not None
    mean, _, spread = text.partition(" ± ")
    if spread:
        assert abs(float(mean) - array.mean()) <= 0.06 * array.std(ddof=1) + 0.5 * (array.std(ddof=1) > 10)


def test_large_forces_are_in_kilonewtons() -> None:
    assert force_unit(999.0) == ("N", 1.0)
    assert force_unit(1000.0) == ("kN", 1e-3)
