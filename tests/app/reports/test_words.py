"""Settings, figures and findings in words, and in the units of the bench."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.common.number_format import join_words, number, percent, percent_range, times
from pyroshock.app.diagnose.wording import effect_title, shrinkage_line, where_lines
from pyroshock.app.documents.document import column_heading, force_unit, mean_and_spread, setting, settings_words
from pyroshock.twin.effects import catalogue
from support.records import verdicts

# --- settings and figures are told in the units of the bench --------------------------------------------------------


def test_factors_are_told_in_their_units_and_means_with_their_spread() -> None:
    assert setting("tip_radius_m").heading == "tip radius (mm)"
    assert setting("tip_radius_m").words(0.045) == "45 mm"
    assert setting("tank_pressure_pa").cell(38080.0) == 0.3808
    assert column_heading("tank_pressure_bar") == "tank pressure (bar)"
    assert (force_unit(999.0), force_unit(1000.0)) == (("N", 1.0), ("kN", 1e-3))
    assert setting("paint_job").named("green") == "paint job green"
    assert column_heading("paint_job") == "paint job"
    assert settings_words({"insulator": "none", "tip_material": "steel"}) == "no insulator, steel"
    assert setting("insulator").named("none") == "no insulator"
    assert settings_words({}) == "all alike"
    texts = {(5.5, 5.6, 5.7): "5.60 ± 0.10", (5.6,): "5.6", (5.6, 5.6): "5.6", (1000.0, 1200.0): "1100 ± 141"}
    texts |= {(np.nan, 2.0): "2", (np.nan,): None, (): None}
    assert [mean_and_spread(np.array(values, dtype=np.float64)) for values in texts] == list(texts.values())


@given(st.lists(st.floats(1e-6, 1e6), min_size=2, max_size=20))
def test_mean_is_told_to_a_tenth_of_the_spread(values: list[float]) -> None:
    array = np.array(values)
    text = mean_and_spread(array)
    assert text is not None
    mean, _, spread = text.partition(" ± ")
    if spread:
        assert abs(float(mean) - array.mean()) <= 0.06 * array.std(ddof=1) + 0.5 * (array.std(ddof=1) > 10)


# --- sentences of a diagnosis say what it found, and no more --------------------------------------------------------


def test_shrinkage_places_shares_and_ranges_are_told() -> None:
    sentence = shrinkage_line(verdicts.gun().shrinkage[0])
    assert sentence.endswith(
        "97 % (95 to 98 %) of the error above the noise disappears. With a learned correction of the "
        "rest 0.0085 would be left; a correction is not a cause."
    )
    assert "correction" not in shrinkage_line(verdicts.verdict().shrinkage[0])
    assert shrinkage_line(verdicts.verdict().shrinkage[1]).endswith("; there was no error to reduce.")
    lines = list(where_lines(verdicts.verdict().where))
    assert len(lines) == 6
    assert lines[-1].startswith("peak force of the contact falls")
    # Near certainty is not certainty, and what is no number is a dash.
    shares = {1.0: "100 %", 0.999: "> 99 %", 0.93: "93 %", 0.001: "< 1 %", 0.0: "0 %"}
    assert {share: percent(share) for share in shares} == shares
    numbers = {4000.0: "4000", 0.0123456: "0.0123", 2.9e7: "2.9e+07", 3.4e-8: "3.4e-08"}
    assert {value: number(value) for value in numbers} == numbers
    assert percent_range(0.52, 0.68) == "52 to 68 %"
    assert [times(ratio) for ratio in (42.3, 9.96, 0.891)] == ["42", "10", "0.89"]
    assert [join_words("abc"[:count]) for count in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert join_words(["a", "b"], "or") == "a or b"
    assert (number(float("nan")), percent(float("nan")), percent(float("inf"))) == ("–", "–", "–")
    assert percent_range(float("nan"), 0.3) == "interval not known"


@pytest.mark.parametrize("identity", list(catalogue()))
def test_every_effect_has_a_title(identity: str) -> None:
    assert effect_title(identity).startswith(f"{identity}: ")
