"""Continuous factors beside levels: from the factors file to designs, their quality and their
order."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.doe.designs.augment import augment
from pyroshock.doe.designs.factorial import factorial
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.designs.space_filling import latin_hypercube
from pyroshock.doe.factors import continuous_levels
from pyroshock.doe.merit.pair_matrix import pair_matrix
from pyroshock.doe.merit.quality import quality
from pyroshock.doe.merit.space_filling import d_efficiency, d_efficiency_limit
from pyroshock.doe.order import run_order, time_confounding
from pyroshock.doe.space import STRATA, gun_space, shipped_factors, space_from_text
from pyroshock.doe.toml_space import with_ranges

TEXT = """
name = "own"
kind = "gun"
[[factors]]
name = "tip_material"
kind = "categorical"
levels = ["PLA", "aluminum", "steel"]
[[factors]]
name = "tank_pressure"
column = "tank_pressure_bar"
kind = "continuous"
unit = "bar"
low = 0.8
high = 6
step = 0.05
[[factors]]
name = "bullet_mass"
column = "bullet_mass_kg"
kind = "numeric"
unit = "kg"
levels = [0.2, 0.5, 1]
"""
SPACE = space_from_text(TEXT)
PRESSURE = SPACE.factors[1]


def pressures(treatments: np.ndarray) -> np.ndarray:
    return np.array([float(row["tank_pressure_bar"]) for row in SPACE.rows(treatments)])


def test_values_run_from_low_to_high_in_steps() -> None:
    assert len(PRESSURE.levels) == 105
    assert PRESSURE.levels[:3] == ("0.8", "0.85", "0.9")
    assert (PRESSURE.limits, PRESSURE.step) == ((0.8, 6.0), pytest.approx(0.05))
    assert PRESSURE.level_text == "0.8 to 6 bar in steps of 0.05"
    (treatment,) = SPACE.treatments(
        [{"tip_material": "PLA", "tank_pressure_bar": "1,35", "bullet_mass_kg": "1"}]
    )
    assert SPACE.rows(treatment[None])[0]["tank_pressure_bar"] == "1.35"
    with pytest.raises(
        ValueError, match="tank_pressure_bar is '1\\.36'; expected 0\\.8 to 6 bar in steps"
    ):
        SPACE.treatments(
            [{"tip_material": "PLA", "tank_pressure_bar": "1.36", "bullet_mass_kg": "1"}]
        )
    with pytest.raises(ValueError, match="tank_pressure_bar is '1,350'; expected"):  # 1350, too
        SPACE.treatments(
            [{"tip_material": "PLA", "tank_pressure_bar": "1,350", "bullet_mass_kg": "1"}]
        )


@pytest.mark.parametrize(
    ("low", "high", "step"),
    [(0.8, 6, "0.1"), (20, 80, "1"), (0, 1, "0.02"), (0.2, 1, "0.01"), (-56, 112, "2")],
)
def test_step_of_its_own_has_few_digits(low: float, high: float, step: str) -> None:
    levels = continuous_levels(low, high, None)
    assert float(levels[1]) - float(levels[0]) == pytest.approx(float(step))
    assert 50 <= len(levels) <= 2001
    assert (float(levels[0]), float(levels[-1])) == (low, high)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("high = 6", "high = 0.5"), "low is 0.8 and high 0.5; " "expected finite " "numbers, low below high"),
        (("high = 6", "high = inf"), "low is 0.8 and high inf"),
        (("step = 0.05", "step = 0.3"), "step is 0.3; expected a part of the range from 0.8 to 6"),
        (("step = 0.05", "step = 0"), "step is 0; expected"),
        (("step = 0.05", "step = 1e-5"), "which gives 520001 values; expected 2001 at most"),
        (("high = 6", 'high = "six"'), "level 'six'; expected a number"),
        (("high = 6\n", ""), "key 'high' is missing"),
        (("low = 0.8", "levels = [1, 2]"), "unknown key 'levels'"),
        (('unit = "bar"\n', ""), "unit is None"),
        (("low = 0.8", "low = -0.8"), "tank_pressure_bar " "has level " "'-0.8'; expected " "a number above zero"),
        (('kind = "gun"', 'kind = "gun"\nrequires = [{factor = "tip_material", level = "PLA", '
          'needs = ' '"tank_pressure", ' 'levels = ["1"]}]'), "'tank_pressure' is " "continuous; " "expected " "factors with levels"),
    ],
)  # fmt: skip
def test_range_that_is_none_is_refused(change: tuple[str, str], message: str) -> None:
    with pytest.raises(ValueError) as caught:
        space_from_text(TEXT.replace(*change))
    assert message in str(caught.value)


def test_hypercube_has_a_pressure_in_each_part_of_the_range() -> None:
    made = balance_levels(SPACE, 35, np.random.default_rng(1))
    judged = quality(SPACE, made.treatments)
    assert list(judged.level_counts["tank_pressure"].values()) == [7] * STRATA
    assert next(iter(judged.level_counts["tank_pressure"])) == "0.8 to 1.8"
    # 35 runs, 105 values: one run in each three of them
    assert np.bincount(made.treatments[:, 1] // 3, minlength=35).tolist() == [1] * 35
    assert judged.distinct == 35
    before = balance_levels(SPACE, 30, np.random.default_rng(1)).treatments
    made = augment(
        SPACE,
        before,
        15,
        lambda space, n, fixed: balance_levels(space, n, np.random.default_rng(2), fixed=fixed),
    )
    judged = quality(SPACE, np.vstack([before, made.treatments]))
    assert list(judged.level_counts["tank_pressure"].values()) == [9] * STRATA
    assert judged.distinct == 45

    def uneven(treatments: np.ndarray) -> tuple[float, float]:
        judged = quality(SPACE, treatments)
        return judged.worst_pair, judged.rms_triple

    ours = uneven(balance_levels(SPACE, 45, np.random.default_rng(1)).treatments)
    for criterion in ("maximin", "correlation", "centermaximin", "lhsmu"):
        peer = uneven(latin_hypercube(SPACE, 45, np.random.default_rng(1), criterion).treatments)
        assert ours[0] < peer[0]
        assert ours[1] < peer[1]


def test_factorial_takes_values_at_equal_distances() -> None:
    made = factorial(SPACE, 5)
    assert len(made.treatments) == 3 * 5 * 3
    assert np.unique(pressures(made.treatments)).tolist() == pytest.approx(
        [0.8, 2.1, 3.4, 4.7, 6.0]
    )
    with pytest.raises(ValueError, match="levels is 1"):
        factorial(SPACE, 1)
    assert pair_matrix(SPACE, factorial(SPACE).treatments).shape == (3 + STRATA + 3,) * 2
    # At the two ends it is that of two levels; spread evenly over them, the variance is (k + 1) /
    # (3 (k - 1)).
    assert d_efficiency(np.array([[0], [100]]), [101], [0]) == pytest.approx(
        d_efficiency_limit([101], [0])
    )
    even = np.arange(101)[:, None]
    assert d_efficiency(even, [101], [0]) == pytest.approx((102 / 300) ** 0.5)


def test_order_takes_time_by_parts_and_changes_once_a_value() -> None:
    rows = balance_levels(SPACE, 45, np.random.default_rng(1)).treatments
    ordered = rows[run_order(SPACE, rows, np.random.default_rng(1))]
    assert time_confounding(SPACE, ordered)["tank_pressure"] < 0.35  # (5 - 1) / (45 - 1) on average
    space = space_from_text(TEXT.replace("step = 0.05", "step = 1.3\nchange = 2"))
    rows = factorial(space, 5).treatments
    ordered = rows[run_order(space, rows, np.random.default_rng(1))]
    assert quality(space, ordered).changeovers["tank_pressure"] == 4


def test_range_takes_the_place_of_levels_and_keeps_the_work_to_change() -> None:
    text = shipped_factors("gun").replace(
        "levels = [0.2, 0.5, 1]", "levels = [0.2, 0.5, 1]\nchange = 1"
    )
    space = space_from_text(
        with_ranges(text, {"bullet_mass_kg": (0.2, 1, 0.1), "tip_radius": (30, 60)})
    )
    by_name = {factor.name: factor for factor in space.factors}
    assert by_name["bullet_mass"].levels[:3] == ("0.2", "0.3", "0.4")
    assert by_name["bullet_mass"].change == 1
    assert by_name["tip_radius"].continuous
    assert [axis.name for axis in space.axes] == [axis.name for axis in gun_space().axes]
    space = space_from_text(
        with_ranges(shipped_factors("gun"), {"tank_pressure_bar": (0.8, 6, 0.05)})
    )
    assert "velocity_level" not in [factor.name for factor in space.factors]
    assert space.factors[-1] == PRESSURE


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"plate_material": (1, 2)}, "plate_material has words for levels"),
        ({"velocity_level": (1, 2)}, "velocity_level has words for levels"),
        ({"humidity": (1, 2)}, "no factor 'humidity' to give a range; there: plate_material"),
        ({"bullet_mass_kg": (1,)}, "range of bullet_mass_kg is"),
        ({"bullet_mass_kg": (1, 0.2)}, "low is 1 and high 0.2"),
    ],
)
def test_range_of_what_is_no_number_is_refused(ranges: dict, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        space_from_text(with_ranges(shipped_factors("gun"), ranges))
