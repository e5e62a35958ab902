"""Spaces of feasible treatments: the thesis's two, and any that rules can make."""

from __future__ import annotations

import csv
import itertools
import math
import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pyroshock.doe.factors import DesignFactor, Requirement, Tie, number_label
from pyroshock.doe.space import Axis, Space, gun_space, hammer_space, space_of

GUN, HAMMER = gun_space(), hammer_space()


def _column(path: Path, factor: str) -> list[str]:
    """A factor's levels in a typed table of the thesis."""
    with path.open(newline="") as handle:
        [row] = [row for row in csv.DictReader(handle) if row["factor"] == factor]
    return [cell for name, cell in row.items() if name != "factor" and cell]


@st.composite
def spaces(draw: st.DrawFn) -> Space:
    """Up to five factors of up to four levels, numeric or not, under up to three requirements."""
    sizes = draw(st.lists(st.integers(1, 4), min_size=1, max_size=5))
    factors = [_factor(f"f{index}", size, draw(st.booleans())) for index, size in enumerate(sizes)]
    pairs = list(itertools.permutations(factors, 2))
    rules = [
        _requirement(draw, *draw(st.sampled_from(pairs)))
        for _ in range(draw(st.integers(0, 3)) if pairs else 0)
    ]
    try:
        return space_of("drawn", "gun", factors, rules)
    except ValueError as error:
        assert "feasible" in str(error)  # contradicting rules; nothing else may be wrong with them
        assume(False)
        raise


def _factor(name: str, size: int, numeric: bool) -> DesignFactor:
    numbers = tuple(0.1 * (place + 1) for place in range(size))
    levels = tuple(map(number_label, numbers)) if numeric else tuple("abcd"[:size])
    return DesignFactor(name, name, levels, numbers if numeric else None, False, 0)


def _requirement(draw: st.DrawFn, factor: DesignFactor, needs: DesignFactor) -> Requirement:
    allowed = draw(st.lists(st.sampled_from(needs.levels), min_size=1, unique=True))
    return Requirement(
        factor.name, draw(st.sampled_from(factor.levels)), needs.name, tuple(allowed)
    )


def _some(space: Space, seed: int, n: int = 20) -> NDArray[np.int64]:
    return np.random.default_rng(seed).integers(
        [axis.size for axis in space.axes], size=(n, len(space.axes))
    )


def test_axes_of_the_two_benches() -> None:
    assert GUN.size == 2 * 3**4 * (3 + 2) == 810  # eq. 3.1
    assert [axis.size for axis in GUN.axes] == [2, 5, 3, 3, 3, 3]
    assert HAMMER.size == 180
    assert [axis.size for axis in HAMMER.axes] == [3, 2, 3, 5, 2]
    assert [axis.name for axis in GUN.axes if axis.ordered] == [
        "tip_radius",
        "bullet_mass",
        "velocity_level",
    ]
    assert [axis.name for axis in HAMMER.axes if axis.ordered] == ["hammer_speed"]
    assert [axis.change for axis in GUN.axes] == [3, 2, 0, 0, 0, 0]
    assert HAMMER.axes[2].labels == ("aluminum/30", "delrin/30", "polyurethane/15")


def test_rules_make_axes_of_several_factors() -> None:
    tie = Tie(("f0", "f1"), (("0.1", "a"), ("0.2", "b")))
    space = space_of(
        "own", "gun", [_factor("f0", 2, numeric=True), _factor("f1", 2, numeric=False)], [tie]
    )
    assert not space.axes[0].ordered and space.factors[0].has_order
    factors = [_factor(name, 2, numeric=False) for name in ("f0", "f1", "f2")]
    space = space_of("own", "gun", factors, [Requirement("f2", "b", "f0", ("b",))])
    assert [axis.name for axis in space.axes] == ["f0+f2", "f1"]
    assert list(space.rows(np.array([[2, 0]]))[0].items()) == [
        ("f0", "b"),
        ("f1", "a"),
        ("f2", "b"),
    ]


#: Names of the factors in the thesis's tables, and ours.
TABLE_3_2 = {
    **{
        "bullet_mass_kg": "bullet_mass",
        "bullet_tip": "tip_material",
        "bullet_tip_radius_mm": "tip_radius",
    },
    **{
        "plate_material": "plate_material",
        "anvil_plate_material": "anvil_material",
        "insulator_layer": "insulator",
    },
    "bullet_velocity": "velocity_level",
}
TABLE_4_1 = {
    **{
        "impact_position": "impact_position",
        "hammer_speed": "hammer_speed",
        "hammer_head_material": "tip_material",
    },
    **{
        "hammer_head_radius_mm": "tip_radius",
        "anvil_plate_material": "anvil_material",
        "anvil_insulator": "insulator",
    },
    "plate_boundary_conditions": "boundary_conditions",
}


def test_levels_are_those_of_tables_3_2_and_4_1(thesis_tables: Path) -> None:
    gun, hammer = (
        {factor.name: factor.levels for factor in space.factors} for space in (GUN, HAMMER)
    )
    for printed, name in TABLE_3_2.items():
        assert list(gun[name]) == _column(thesis_tables / "table_3_2_gun_factors.csv", printed)
    for printed, name in TABLE_4_1.items():
        assert set(hammer[name]) == set(
            _column(thesis_tables / "table_4_1_hammer_factors.csv", printed)
        )


@pytest.mark.parametrize("space", [GUN, HAMMER], ids=["gun", "hammer"])
def test_all_treatments_are_all_different(space: Space) -> None:
    treatments = space.all_treatments()
    assert treatments.shape == (space.size, len(space.axes))
    assert len(np.unique(treatments, axis=0)) == space.size


@settings(max_examples=150)
@given(spaces(), st.integers(0, 2**32))
def test_rows_and_treatments_are_inverse(space: Space, seed: int) -> None:
    treatments = _some(space, seed)
    assert np.array_equal(space.treatments(space.rows(treatments)), treatments)


@settings(max_examples=150)
@given(spaces())
def test_space_holds_what_the_rules_allow(space: Space) -> None:
    """Every combination of levels is a treatment exactly if it breaks no rule: counted without the
    axes."""
    feasible = 0
    for levels in itertools.product(*(factor.levels for factor in space.factors)):
        row = dict(zip(space.columns, levels, strict=True))
        if all(rule.allows(row) for rule in space.rules):
            feasible += 1
            assert space.rows(space.treatments([row])) == [row]
        else:
            with pytest.raises(ValueError, match="not feasible"):
                space.treatments([row])
    assert space.size == feasible == len(np.unique(space.all_treatments(), axis=0))


@settings(max_examples=50)
@given(st.integers(0, 2**32), st.sampled_from(["{:.3f}", "{:g}", "{:e}", " {:.1f} "]))
def test_numbers_may_be_written_otherwise(seed: int, form: str) -> None:
    treatments = _some(GUN, seed)
    rows = GUN.rows(treatments)
    for row in rows:
        row.update(
            {key: form.format(float(row[key])) for key in ("tip_radius_mm", "bullet_mass_kg")}
        )
    assert np.array_equal(GUN.treatments(rows), treatments)


def test_level_stands_for_its_velocity_and_a_row_for_its_columns() -> None:
    header = (
        "plate_material,anvil_material,insulator,tip_material,tip_radius_mm,bullet_mass_kg,"
        "velocity_level"
    )
    assert ",".join(GUN.rows(np.zeros((1, 6), dtype=np.int64))[0]) == header
    assert GUN.treatments([]).shape == (0, 6)
    assert GUN.rows(np.empty((0, 6), dtype=np.int64)) == []
    level = next(factor for factor in gun_space().factors if factor.unit == "m/s")
    velocities = [gun_space().velocity_m_s({level.column: word}) for word in level.levels]
    assert velocities == list(level.values)
    assert gun_space().velocity_m_s({level.column: "never heard of"}) is None
    assert hammer_space().velocity_m_s({"hammer_speed": "low"}) is None


def _gun_rows(**cells: str) -> list[dict[str, str]]:
    rows = GUN.rows(np.zeros((3, 6), dtype=np.int64))
    rows[1].update(cells)
    return rows


def test_row_that_is_no_treatment_is_named() -> None:
    rule = "insulator = polymeric needs anvil_material = aluminum or steel"
    with pytest.raises(
        ValueError, match=f"^run 2: .*anvil_material = none is not feasible: {rule}$"
    ):
        GUN.treatments(_gun_rows(insulator="polymeric"))
    rows = HAMMER.rows(np.zeros((1, 5), dtype=np.int64))
    rows[0]["tip_radius_mm"] = "15"
    with pytest.raises(ValueError, match="go together as aluminum/30, delrin/30, polyurethane/15"):
        HAMMER.treatments(rows)
    with pytest.raises(
        ValueError, match=r"^run 17: tip_material is 'gold'; expected one of PLA, aluminum, steel$"
    ):
        GUN.treatments(_gun_rows(run="17", tip_material="gold"))
    rows = _gun_rows()
    del rows[1]["insulator"]
    with pytest.raises(ValueError, match="run 2: column 'insulator' is missing"):
        GUN.treatments(rows)


@pytest.mark.parametrize(
    ("treatments", "message"),
    [
        ([[0, 0, 0, 0, 0]], r"\(1, 5\) of int64; expected \(n, 6\)"),
        ([0, 0, 0, 0, 0, 0], "expected"),
        ([[0.0] * 6], "float64"),
        (
            [[0] * 6, [0, 5, 0, 0, 0, 0]],
            r"treatment 1: anvil_material\+insulator is 5; expected 0 to 4",
        ),
        ([[-1, 0, 0, 0, 0, 0]], "plate_material is -1"),
    ],
)
def test_no_treatments_of_this_space(treatments: list[object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        GUN.rows(np.array(treatments))


def test_space_made_by_hand() -> None:
    [one, other] = [_factor("f0", 2, numeric=False), _factor("f1", 2, numeric=False)]
    space = Space("own", "gun", (one, other), (Axis("f0+f1", (one, other), ((0, 0), (1, 1))),))
    assert space.size == 2
    with pytest.raises(ValueError, match=r"f0\+f1 = a/b is not feasible; expected one of a/a, b/b"):
        space.treatments([{"f0": "a", "f1": "b"}])
    with pytest.raises(ValueError, match="expected every factor once"):
        Space("own", "gun", GUN.factors, GUN.axes[:-1])
    levels = tuple(map(str, range(30)))
    space = space_of(
        "big", "gun", [DesignFactor(name, name, levels, None, False, 0) for name in "abcdefghij"]
    )
    assert space.size == math.prod([30] * 10)
    with pytest.raises(ValueError, match="expected at most 1000000 to list"):
        space.all_treatments()
    assert pickle.loads(pickle.dumps(GUN)) == GUN
    assert hash(gun_space()) == hash(GUN)


@pytest.mark.parametrize("combinations", [(), ((0,), (0,)), ((0, 0),), ((2,),), ((-1,),)])
def test_axis_of_impossible_combinations_is_refused(
    combinations: tuple[tuple[int, ...], ...],
) -> None:
    with pytest.raises(ValueError, match="axis 'f0': combination"):
        Axis("f0", (_factor("f0", 2, numeric=False),), combinations)
