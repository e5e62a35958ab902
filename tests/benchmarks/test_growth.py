"""Growth curves: exponents, budgets, points and their picture."""

from __future__ import annotations

import json

import pytest

from benchmarks import growth
from benchmarks.growth import Point, exponents, fitting, keep
from benchmarks.growth_diagnosis import shots
from benchmarks.growth_plot import draw
from benchmarks.growth_store import store_points
from benchmarks.growth_training import training_points


def power_law(power: float, sizes=(10, 100, 1000)) -> list[Point]:
    return [Point("pulses", "training a law", size, (2.0 * size**power, 3.0 * size**power)) for size in sizes]


def test_exponents_of_power_laws_are_theirs():
    assert exponents(power_law(1.7)).median == pytest.approx(1.7)
    uneven = [Point("a", "c", 10, (1.0, 1.0)), Point("a", "c", 100, (10.0, 100.0))]
    assert (exponents(uneven).low, exponents(uneven).high) == pytest.approx((1.0, 2.0))


def test_a_figure_tells_growth_and_exponent():
    (figure,) = growth.figures(power_law(1.0), {("pulses", "training a law"): "a limit"})
    assert figure.value.median == pytest.approx(100)
    assert "p = 1 (1 to 1)" in figure.nature and figure.nature.endswith("a limit")
    assert "10 to 1,000 pulses" in figure.name


def test_sizes_beyond_the_budget_are_left_out():
    assert [size for size, _ in fitting(lambda n: (n**2 / 1e4,), (10, 100, 1000, 10_000), budget_s=150)] == [
        10,
        100,
        1000,
    ]


def test_points_of_a_small_store(tmp_path):
    points, natures = store_points(tmp_path, (1_000,))
    assert {point.curve for point in points} == {curve for _, curve in natures}
    room = next(point for point in points if point.unit == "bytes")
    assert room.values[0] > 1_000 * 100


def test_points_of_a_training():
    points, _ = training_points(1e9, (60, 120), ("tree",))
    assert {(point.curve, point.size) for point in points} == {
        (curve, size) for curve in ("training a tree", "1,000 predictions of a tree") for size in (60, 120)
    }


def test_shots_of_a_grid_are_repeated():
    record = shots(4, 3)
    assert len(record.configurations) == 12 and len(record.runs) == 36
    assert all(run.velocity_m_s > 0 for run in record.runs)


def test_the_picture_is_drawn_from_what_is_kept(tmp_path):
    keep([*power_law(1.0), Point("impacts", "room", 1000, (1e6,), "bytes")], tmp_path)
    draw(json.loads((tmp_path / growth.FILE).read_text()), tmp_path / "growth.png")
    assert (tmp_path / "growth.png").stat().st_size > 5_000
