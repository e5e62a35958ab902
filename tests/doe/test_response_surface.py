"""Central composite, Box-Behnken and optimal designs against closed forms and pyDOE3's own
tables."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pyroshock.doe.designs import pydoe
from pyroshock.doe.designs.factorial import factorial
from pyroshock.doe.designs.optimal import optimal
from pyroshock.doe.designs.response_surface import box_behnken, central_composite
from pyroshock.doe.factors import DesignFactor, continuous_levels
from pyroshock.doe.space import Space, gun_space, space_of


def continuous(
    name: str, low: float = -1.0, high: float = 1.0, step: float = 0.001
) -> DesignFactor:
    levels = continuous_levels(low, high, step)
    return DesignFactor(name, name, levels, tuple(map(float, levels)), True, 0, "1", None, True)


SPEEDS = DesignFactor("v", "v", ("low", "high"), None, True, 0)
THREE = DesignFactor("v", "v", ("a", "b", "c"), None, True, 0)


def surface_space(count: int, *more: DesignFactor) -> Space:
    return space_of("s", "hammer", [*(continuous(f"x{i}") for i in range(count)), *more])


def coded(space: Space, treatments: np.ndarray) -> np.ndarray:
    return np.array(
        [[float(row[column]) for column in space.columns] for row in space.rows(treatments)]
    )


def test_stars_are_at_the_distance_of_orthogonal_blocks() -> None:
    # Of three factors with four centre points in each block: 1.826 (Myers and Montgomery; pyDOE3's
    # documentation).
    space = surface_space(3)
    found = coded(space, central_composite(space, face="ccc", cube=0.5).treatments)
    assert len(found) == 8 + 6 + 8
    stars = found[np.sum(found != 0, axis=1) == 1]
    assert sorted(np.abs(stars).sum(axis=1)) == pytest.approx([1.826 / 2] * 6, abs=1e-3)
    assert {tuple(row) for row in found[np.all(found != 0, axis=1)]} == set(
        itertools.product((-0.5, 0.5), repeat=3)
    )
    space = space_of(
        "s", "gun", [f for f in gun_space().factors if f.name in ("tip_radius", "bullet_mass")]
    )
    rows = space.rows(central_composite(space, centre=1).treatments)
    assert len(rows) == 4 + 4 + 2
    assert {row["bullet_mass_kg"] for row in rows} == {"0.2", "0.5", "1"}
    assert sum((row["tip_radius_mm"], row["bullet_mass_kg"]) == ("45", "0.5") for row in rows) == 2
    words = DesignFactor("tip", "tip", ("PLA", "steel"), None, False, 0)
    space = surface_space(2, words)
    with pytest.raises(ValueError, match="tip has levels without order \\(PLA, steel\\)"):
        central_composite(space)
    rows = space.rows(central_composite(space, centre=1, categorical="cross").treatments)
    assert len(rows) == 2 * 10
    assert sum(row["tip"] == "PLA" for row in rows) == 10


@pytest.mark.parametrize(("count", "distance"), [(2, 1.4142), (3, 1.6818), (4, 2.0)])
def test_inscribed_stars_are_at_the_ends_and_the_cube_within(count: int, distance: float) -> None:
    space = surface_space(count)
    found = coded(space, central_composite(space, face="cci", alpha="rotatable").treatments)
    assert np.abs(found).max() == 1.0
    assert np.unique(np.abs(found)) == pytest.approx([0, 1 / distance, 1], abs=1e-3)


def test_rotatable_design_predicts_as_well_in_all_directions() -> None:
    """x' (X'X)^-1 x is the same on a circle (Box and Hunter, Ann. Math. Stat. 28, 1957)."""
    from pyDOE3.doe_optimal import build_design_matrix

    design = pydoe.central_composite(2, (4, 4), "rotatable", "ccc")
    terms = build_design_matrix(design, 2)
    angles = np.linspace(0, 2 * np.pi, 13)
    circle = build_design_matrix(np.column_stack([np.cos(angles), np.sin(angles)]), 2)
    variance = np.einsum("ij,jk,ik->i", circle, np.linalg.inv(terms.T @ terms), circle)
    np.testing.assert_allclose(variance, variance[0], rtol=1e-9)


def test_box_behnken_has_one_centre_and_two_ends_in_each_run() -> None:
    space = surface_space(3)
    found = coded(space, box_behnken(space).treatments)
    edges = [(a, b) for a in (-1, 1) for b in (-1, 1)]
    expected = (
        {(a, b, 0) for a, b in edges}
        | {(a, 0, b) for a, b in edges}
        | {(0, a, b) for a, b in edges}
    )
    assert {tuple(map(int, row)) for row in found} == expected | {(0, 0, 0)}
    assert len(found) == 12 + 3
    with pytest.raises(ValueError, match="expected three or more"):
        box_behnken(surface_space(2))
    space = surface_space(1, DesignFactor("v_mm", "v_mm", ("1", "2"), (1.0, 2.0), False, 0, "mm"))
    with pytest.raises(ValueError, match="v_mm has 2 levels; expected 3 for a model of degree 2"):
        optimal(space, 6, np.random.default_rng(1), degree=2)


@pytest.mark.parametrize(
    ("space", "options", "message"),
    [
        (surface_space(3), {"face": "ccc", "cube": 0.9}, "x0: a run lies at 1.64 times its range"),
        (surface_space(3), {"cube": 0}, "cube is 0; expected a share"),
        (surface_space(3), {"centre": -1}, "centre is -1; expected 0 to 1000"),
        (surface_space(3), {"centre": 10**9}, "centre is 1000000000; expected"),
        (surface_space(1), {}, "1 factor; expected two or more"),
        (
            surface_space(1, SPEEDS),
            {},
            "v has 2 levels, and a run lies between",
        ),
        (surface_space(1, THREE), {"face": "cci"}, "v has 3 levels, and a"),
    ],
)
def test_surface_that_the_factors_do_not_allow_names_the_factor(
    space: Space, options: dict, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        central_composite(space, **options)


def information(points: np.ndarray, degree: int) -> float:
    """|X'X / n|^(1 / p)."""
    from pyDOE3.doe_optimal import build_design_matrix

    terms = build_design_matrix(points, degree)
    return max(float(np.linalg.det(terms.T @ terms / len(terms))), 0.0) ** (1 / terms.shape[1])


@pytest.mark.parametrize(
    "exchange", ["sequential", "simple_exchange", "fedorov", "modified_fedorov", "detmax"]
)
@pytest.mark.parametrize("runs", [6, 7, 8])
def test_d_optimal_runs_are_the_best_of_all_choices(exchange: str, runs: int) -> None:
    """Of the nine treatments of a 3 x 3 factorial, for a quadratic surface: every choice is
    tried."""
    space = surface_space(2)
    everything = coded(space, factorial(space).treatments)
    best = max(
        information(everything[list(chosen)], 2)
        for chosen in itertools.combinations(range(9), runs)
    )
    made = optimal(space, runs, np.random.default_rng(1), degree=2, exchange=exchange)
    assert information(coded(space, made.treatments), 2) == pytest.approx(best, rel=1e-9)
    assert information(everything, 2) == pytest.approx(0.46224, rel=1e-4)
    assert best > 0.9 * 0.46224


def test_half_fraction_is_as_efficient_as_the_factorial() -> None:
    # A two-level factorial of three factors has 1, which no design exceeds; four of its eight runs
    # have it too.
    space = surface_space(3)
    made = optimal(space, 4, np.random.default_rng(2), levels=2)
    assert information(coded(space, factorial(space, 2).treatments), 1) == pytest.approx(1.0)
    assert information(coded(space, made.treatments), 1) == pytest.approx(1.0)
    # 24 of 810 runs have as much information a run as all of them have.
    space = gun_space()
    numbers = [f.name for f in space.factors if f.numbers or f.values]
    made = optimal(space, 24, np.random.default_rng(1), exchange="simple_exchange")
    rows = space.rows(made.treatments)
    assert {row["tip_material"] for row in rows} == {"PLA", "aluminum", "steel"}
    assert numbers == ["tip_radius", "bullet_mass", "velocity_level"]
    assert {row["tip_radius_mm"] for row in rows} == {
        "30",
        "60",
    }  # a line is known best from its ends


@pytest.mark.parametrize(("criterion", "row"), [("A", 0), ("I", 1)])
def test_criteria_serve_what_they_are_named_for(criterion: str, row: int) -> None:
    """The mean variance of coefficients (A) and of predictions (I) is no worse than that of the
    D-optimal runs."""
    from pyDOE3.doe_optimal import build_design_matrix

    space = surface_space(2)
    terms = build_design_matrix(coded(space, factorial(space).treatments), 2)

    def variances(name: str) -> tuple[float, float]:
        made = optimal(space, 7, np.random.default_rng(1), degree=2, criterion=name)
        chosen = build_design_matrix(coded(space, made.treatments), 2)
        inverse = np.linalg.inv(chosen.T @ chosen)
        return float(np.trace(inverse)), float(np.trace(inverse @ terms.T @ terms) / len(terms))

    assert variances(criterion)[row] <= variances("D")[row] + 1e-9


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"degree": 2},
            "plate_material has words for levels; expected numbers for a model of degree 2",
        ),
        ({"degree": 0}, "degree is 0"),
        ({"degree": 99}, "degree is 99"),
        ({"levels": 10**9}, "levels is 1000000000"),
        ({"n": 8}, "8 runs for a model of 11 terms; expected 11 or more"),
        ({"n": 811}, "810 candidates; expected 811"),
    ],
)
def test_model_that_cannot_be_fitted_is_refused(options: dict, message: str) -> None:
    given = {"n": 24} | options
    with pytest.raises(ValueError, match=message):
        optimal(gun_space(), given.pop("n"), np.random.default_rng(1), **given)
