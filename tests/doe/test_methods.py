"""What every method of making a plan promises, over the list of them. A newcomer is tested by being
there."""

from __future__ import annotations

import ast
import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyroshock.doe.designs.methods import METHODS, DesignRequest, get_method
from pyroshock.doe.designs.pydoe import unit_lhs
from pyroshock.doe.space import Space, gun_space, hammer_space, space_from_text
from scipy.spatial.distance import pdist

RUNS = 16
EACH = pytest.mark.parametrize("method", METHODS)
CONTINUOUS = space_from_text(
    """
    name = "continuous"
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
    low = 1
    high = 6
    [[factors]]
    name = "tip_radius"
    column = "tip_radius_mm"
    kind = "continuous"
    unit = "mm"
    low = 30
    high = 60
    step = 0.5
    [[factors]]
    name = "bullet_mass"
    column = "bullet_mass_kg"
    kind = "numeric"
    unit = "kg"
    levels = [0.2, 0.5, 1]
    """
)
SPACES = {"gun": gun_space(), "hammer": hammer_space(), "continuous": CONTINUOUS}
#: What lets a method take words without order, and not look at 810 candidates for long.
OPTIONS: dict[str, dict[str, Any]] = {
    "fractional-factorial": {"categorical": "first-last"},
    "plackett-burman": {"categorical": "first-last"},
    "central-composite": {"categorical": "cross"},
    "box-behnken": {"categorical": "cross"},
    "optimal": {"exchange": "simple_exchange"},
}
#: The hammer has no ordered factor beside its two speeds: no surface is fitted there.
IMPOSSIBLE = {("central-composite", "hammer"), ("box-behnken", "hammer")}


@pytest.fixture
def table(tmp_path: Path) -> Path:
    return tmp_path / "table.csv"


def request_of(method: str, space: Space, table: Path, seed: int = 1) -> DesignRequest:
    """Everything that a method may ask for."""
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["run", *space.columns])
        rows = space.rows(np.zeros((1, len(space.axes)), dtype=np.int64))
        writer.writerows([number, *row.values()] for number, row in enumerate(rows, 1))
    return DesignRequest(RUNS, table, np.random.default_rng(seed), OPTIONS.get(method, {}))


@EACH
@pytest.mark.parametrize("name", SPACES)
def test_treatments_are_of_the_space(method: str, name: str, table: Path) -> None:
    space, made = SPACES[name], get_method(method)
    if (method, name) in IMPOSSIBLE:
        with pytest.raises(ValueError, match="factor"):
            made.make(space, request_of(method, space, table))
        return
    design = made.make(space, request_of(method, space, table))
    assert (design.space, design.method.split()[0]) == (space, method)
    assert "runs" not in made.takes or len(design.treatments) == RUNS
    np.testing.assert_array_equal(space.checked(design.treatments), design.treatments)
    if not made.repeats:
        assert len(np.unique(design.treatments, axis=0)) == len(design.treatments)


@EACH
def test_same_seed_makes_the_same_design_without_global_state(method: str, table: Path) -> None:
    first, second, other = (
        get_method(method).make(CONTINUOUS, request_of(method, CONTINUOUS, table, seed)).treatments
        for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first, second)
    assert ("runs" in METHODS[method].takes) == (first.tolist() != other.tolist())
    # pyDOE3 draws from the generator that it is given, or a plan would not come back.
    state = np.random.get_state()[1].tolist()  # noqa: NPY002
    get_method(method).make(CONTINUOUS, request_of(method, CONTINUOUS, table))
    assert np.random.get_state()[1].tolist() == state  # noqa: NPY002


@EACH
def test_what_is_missing_is_told(method: str) -> None:
    """A method that needs nothing makes its design of nothing, or names the factor that it cannot
    take."""
    nothing = DesignRequest(None, None, np.random.default_rng(1))
    try:
        design = get_method(method).make(hammer_space(), nothing)
    except ValueError as error:
        assert "expected" in str(error)
    else:
        assert len(design.treatments) > 0
        assert not METHODS[method].takes


@EACH
def test_defaults_of_options_are_those_of_the_function_and_others_refused(
    method: str, table: Path
) -> None:
    # So that the name of the method says all of a design without further options.
    made, given = get_method(method), request_of(method, CONTINUOUS, table)
    usual = {option.name: option.default for option in made.options if option.default is not None}
    all_stated = DesignRequest(
        given.runs, given.table, np.random.default_rng(1), {**usual, **given.options}
    )
    first, second = made.make(CONTINUOUS, given), made.make(CONTINUOUS, all_stated)
    assert first.method == second.method
    np.testing.assert_array_equal(first.treatments, second.treatments)
    with pytest.raises(ValueError, match="unknown option 'magic'; the method has: "):
        METHODS[method].checked({"magic": 1})
    for option in METHODS[method].options:
        if option.choices or option.kind is not str:
            with pytest.raises(ValueError, match=f"{option.name} is 'magic'; expected "):
                METHODS[method].checked({option.name: "magic"})


def test_name_of_the_design_holds_its_method_and_options(table: Path) -> None:
    request = DesignRequest(RUNS, None, np.random.default_rng(1), {"criterion": "maximin"})
    assert get_method("lhs").make(CONTINUOUS, request).method == "lhs criterion=maximin"
    with pytest.raises(
        ValueError, match="method is 'magic'; expected one of " + ", ".join(METHODS)
    ):
        get_method("magic")


ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(("n", "axes"), [(1, 1), (1, 4), (2, 3), (50, 6)])
def test_each_axis_has_one_point_in_each_part(n: int, axes: int) -> None:
    points = unit_lhs(n, axes, np.random.default_rng(0))
    assert np.sort(np.floor(points * n), axis=0).tolist() == [[k] * axes for k in range(n)]


def test_generator_alone_decides() -> None:
    first, again, other = (unit_lhs(20, 3, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert first.tolist() == again.tolist() != other.tolist()
    rng = np.random.default_rng(3)
    ours = np.mean([pdist(unit_lhs(30, 4, rng)).min() for _ in range(20)])
    random = np.mean([pdist(rng.random((30, 4))).min() for _ in range(20)])
    assert ours > 1.2 * random


@pytest.mark.parametrize(("n", "axes"), [(0, 3), (3, 0)])
def test_nothing_to_draw_is_refused(n: int, axes: int) -> None:
    with pytest.raises(ValueError, match="expected at least 1 of each"):
        unit_lhs(n, axes, np.random.default_rng(0))


def test_one_module_knows_the_package() -> None:
    """So that its successor can take its place."""
    sources = [path for path in (ROOT / "doe").rglob("*.py") if "pyDOE3" in _imported(path)]
    assert [path.name for path in sources] == ["pydoe.py"]


def _imported(path: Path) -> set[str]:
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return plain | {
        node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module
    }
