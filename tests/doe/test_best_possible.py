"""Bounds of a design's figures, held against every design of a small space."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from pyroshock.doe.factors import DesignFactor
from pyroshock.doe.merit.best_possible import best_possible, random_reference
from pyroshock.doe.merit.quality import FIGURES, quality
from pyroshock.doe.space import Space, gun_space, space_of


def _space(*sizes: int) -> Space:
    names = [f"f{k}" for k in range(len(sizes))]
    return space_of(
        "s",
        "gun",
        [
            DesignFactor(name, name, tuple(f"{name}{k}" for k in range(size)), None, False, 0)
            for name, size in zip(names, sizes, strict=True)
        ],
    )


@pytest.mark.parametrize(
    ("sizes", "runs"), [((2, 3), 4), ((2, 2, 2), 4), ((2, 2, 3), 3), ((3, 2), 1), ((2, 2), 6)]
)
def test_no_design_is_beyond_the_bound_and_some_reach_it(sizes: tuple[int, ...], runs: int) -> None:
    space = _space(*sizes)
    treatments = space.all_treatments()
    designs = itertools.combinations_with_replacement(range(len(treatments)), runs)
    judged = [quality(space, treatments[list(rows)]) for rows in designs]
    for name, bound in best_possible(space, runs).items():
        values = [getattr(figures, name) for figures in judged]
        best = max(values) if FIGURES[name][1] == "more" else min(values)
        if FIGURES[name][1] == "more":
            assert best <= bound + 1e-9, name
        else:
            assert best >= bound - 1e-9, name
        if name in ("worst_level", "worst_pair", "distinct", "rms_triple", "fewest_differences"):
            assert best == pytest.approx(bound, abs=1e-9), name


def test_random_runs_are_worse_than_the_bound_and_the_same_each_time() -> None:
    gun = gun_space()
    drawn, bounds = random_reference(gun, 105), best_possible(gun, 105)
    assert drawn == random_reference.__wrapped__(gun, 105) and set(drawn) == set(FIGURES)
    assert (
        drawn["worst_pair"] > 3 * bounds["worst_pair"]
        and drawn["d_efficiency"] < bounds["d_efficiency"]
    )
    with pytest.raises(ValueError, match="runs is 0; expected 1 or more"):
        best_possible(gun, 0)
    assert np.isfinite(list(bounds.values())).all()
