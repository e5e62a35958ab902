"""What every way of making a plan promises, over the list of them. A newcomer is tested by being there."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from pyroshock.doe.designs.methods import METHODS, Method, Wanted, way_of
from pyroshock.doe.space import Space, gun_space, hammer_space

RUNS = 12
EACH = pytest.mark.parametrize("method", METHODS)
SPACES = pytest.mark.parametrize("space", [gun_space(), hammer_space()], ids=["gun", "hammer"])


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return tmp_path / "table.csv"


def wanted(space: Space, table: Path, seed: int = 1) -> Wanted:
    """Everything that a way may ask for."""
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["run", *space.columns])
        rows = space.rows(space.all_treatments()[:RUNS])
        writer.writerows([number, *row.values()] for number, row in enumerate(rows, 1))
    return Wanted(RUNS, table, np.random.default_rng(seed))


def test_list_and_type_name_the_same() -> None:
    assert sorted(METHODS) == sorted(get_args(Method))


@EACH
@SPACES
def test_treatments_are_of_the_space(method: str, space: Space, table: Path) -> None:
    design = way_of(method).make(space, wanted(space, table))
    assert (design.space, design.method) == (space, method)
    assert design.treatments.shape[1] == len(space.axes)
    assert len(design.treatments) in (RUNS, space.size)
    np.testing.assert_array_equal(space.checked(design.treatments), design.treatments)


@EACH
def test_no_treatment_comes_twice_while_others_remain(method: str, table: Path) -> None:
    treatments = way_of(method).make(hammer_space(), wanted(hammer_space(), table)).treatments
    assert len(np.unique(treatments, axis=0)) == len(treatments)


@EACH
def test_same_seed_makes_the_same_design(method: str, table: Path) -> None:
    space = hammer_space()
    first, second = (way_of(method).make(space, wanted(space, table, seed=7)).treatments for _ in range(2))
    np.testing.assert_array_equal(first, second)


@EACH
def test_what_is_missing_is_told(method: str) -> None:
    """A way that wants nothing makes its design of nothing."""
    nothing = Wanted(None, None, np.random.default_rng(1))
    try:
        design = way_of(method).make(hammer_space(), nothing)
    except ValueError as error:
        assert "expected" in str(error)
    else:
        assert len(design.treatments) == hammer_space().size


def test_unknown_way_is_refused_with_the_known_ones() -> None:
    with pytest.raises(ValueError, match="method is 'magic'; expected one of " + ", ".join(METHODS)):
        way_of("magic")
