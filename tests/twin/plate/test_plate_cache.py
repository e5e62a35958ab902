"""Solved plates on disk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.plate import modes
from pyroshock.twin.plate.build import PlateBuild, named_points
from pyroshock.twin.plate.modes import solve_plate
from pyroshock.twin.setting import THESIS

BUILD = PlateBuild(
    ((0.0, 0.0), (0.5, 0.0), (0.4, 0.4)),
    0.01,
    THESIS["steel"],
    named_points({"#1": (0.3, 0.1)}),
    named_points({"a": (0.35, 0.2)}),
)


@pytest.fixture
def solutions(monkeypatch):
    """How often a plate has been solved."""
    solve, seen = solve_plate, []

    def counted(*arguments, **more):
        seen.append(arguments)
        return solve(*arguments, **more)

    monkeypatch.setattr(modes, "solve_plate", counted)
    return seen


def test_a_plate_is_solved_once(tmp_path, solutions):
    first, again = (modes.cached_plate(BUILD, 500.0, tmp_path / "deep" / "er") for _ in range(2))
    assert len(solutions) == 1
    for name in ("frequency_hz", "damping_ratio", "shape_impact", "shapes"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))
    assert (again.impact_points, again.sensors) == (("#1",), ("a",))
    assert {BUILD: 1}[replace(BUILD)] == 1


@pytest.mark.slow
def test_another_plate_is_another_file(tmp_path, solutions):
    for build in (BUILD, replace(BUILD, thickness_m=0.011)):
        modes.cached_plate(build, 500.0, tmp_path)
    modes.cached_plate(BUILD, 400.0, tmp_path)
    modes.cached_plate(BUILD, 400.0, tmp_path, thickness_correction=False)
    assert len(solutions) == 4 == len(list(tmp_path.iterdir()))


@pytest.mark.parametrize("damage", [b"", b"no archive", None])
def test_a_damaged_file_is_solved_anew(tmp_path, solutions, damage):
    good = modes.cached_plate(BUILD, 500.0, tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(file.read_bytes()[:-200] if damage is None else damage)
    np.testing.assert_array_equal(modes.cached_plate(BUILD, 500.0, tmp_path).shapes, good.shapes)
    modes.cached_plate(BUILD, 500.0, tmp_path)
    assert len(solutions) == 2
