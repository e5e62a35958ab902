"""The order of runs: few changeovers of what is heavy, chance for the rest."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pyroshock.doe.designs.lhs import balance_levels
from pyroshock.doe.factors import DesignFactor, Requirement
from pyroshock.doe.order import changeovers, run_order, time_confounding
from pyroshock.doe.space import Space, gun_space, hammer_space, space_of

GUN, HAMMER = gun_space(), hammer_space()
EASY = ("tip_material", "tip_radius", "bullet_mass", "velocity_level")


def _some(space: Space, n: int, seed: int) -> NDArray[np.int64]:
    return np.random.default_rng(seed).permutation(space.all_treatments())[:n]


def _ordered(space: Space, treatments: NDArray[np.int64], seed: int) -> NDArray[np.int64]:
    return treatments[run_order(space, treatments, np.random.default_rng(seed))]


def _word(name: str, levels: int, change: int) -> DesignFactor:
    return DesignFactor(name, name, tuple(f"{name}{k}" for k in range(levels)), None, False, change)


@given(st.integers(0, 60), st.integers(0, 100))
@settings(max_examples=25)
def test_every_run_stands_once(n: int, seed: int) -> None:
    indices = run_order(GUN, _some(GUN, n, seed), np.random.default_rng(seed))
    assert sorted(indices.tolist()) == list(range(n))


@pytest.mark.parametrize("seed", range(5))
def test_gun_changes_plate_once_and_anvils_least(seed: int) -> None:
    """With all combinations on both plates 2 changes of anvil each are the least, and 2 of the
    insulator with them."""
    found = changeovers(GUN, _ordered(GUN, _some(GUN, 200, seed), seed))
    assert (found["plate_material"], found["anvil_material"], found["insulator"]) == (1, 4, 4)


def test_blocks_of_hard_factors_are_visited_once() -> None:
    changes = changeovers(HAMMER, _ordered(HAMMER, HAMMER.all_treatments(), 0))
    assert (changes["boundary_conditions"], changes["anvil_material"]) == (1, 4)
    space = space_of("s", "gun", [_word("easy", 4, 0), _word("hard", 3, 1), _word("hardest", 4, 5)])
    changes = changeovers(space, _ordered(space, space.all_treatments(), 1))
    assert (changes["hardest"], changes["hard"]) == (3, 4 * 2)
    assert changes["easy"] > 20
    # Eight combinations of two factors: beyond what is tried out.
    hard = [_word("a", 4, 2), _word("b", 2, 1)]
    space = space_of(
        "s",
        "gun",
        [*hard, _word("c", 3, 0)],
        [Requirement("b", "b1", "a", ("a0", "a1", "a2", "a3"))],
    )
    changes = changeovers(space, _ordered(space, space.all_treatments(), 2))
    assert (changes["a"], changes["b"]) == (3, 4)
    easy = tuple(replace(factor, change=0) for factor in GUN.factors)
    space = space_of("easy", "gun", easy, GUN.rules)
    assert changeovers(space, _ordered(space, space.all_treatments(), 0))["plate_material"] > 300


@pytest.mark.parametrize("seed", range(3))
def test_few_changes_are_the_fewest_there_are(seed: int) -> None:
    """Against every order of the blocks of a small space."""
    space = space_of("s", "gun", [_word("a", 3, 2), _word("b", 2, 1), _word("c", 2, 0)],
                     [Requirement("b", "b1", "a", ("a1", "a2"))])  # fmt: skip
    rows = space.all_treatments()
    blocks = [rows[rows[:, 0] == level] for level in np.unique(rows[:, 0])]
    every = (changeovers(space, np.concatenate(path)) for path in itertools.permutations(blocks))
    fewest = min((found["a"], found["b"]) for found in every)
    found = changeovers(space, _ordered(space, rows, seed))
    assert (found["a"], found["b"]) == fewest


def test_same_seed_gives_the_same_order() -> None:
    rows = _some(GUN, 105, 0)
    first, again, other = (run_order(GUN, rows, np.random.default_rng(seed)) for seed in (7, 7, 8))
    assert first.tolist() == again.tolist() != other.tolist()
    with pytest.raises(ValueError, match="plate_material is 2"):
        run_order(GUN, np.full((1, 6), 2), np.random.default_rng(0))


def test_easy_factors_change_as_often_as_by_chance() -> None:
    # A shuffled factor of 3 even levels changes in two of three runs: 2/3 of 209, give or take 4
    # deviations of 7.
    changes = changeovers(GUN, _ordered(GUN, _some(GUN, 210, 3), 3))
    for name in EASY:
        assert 112 < changes[name] < 167
    # On average over seeds, at most the (k - 1) / (n - 1) of a random order.
    rows = _some(GUN, 105, 0)
    confounding = [time_confounding(GUN, _ordered(GUN, rows, seed)) for seed in range(60)]
    for axis in (axis for axis in GUN.axes if axis.change == 0):
        assert (
            np.mean([of_order[axis.name] for of_order in confounding]) < 1.3 * (axis.size - 1) / 104
        )


def test_plate_in_two_halves_takes_three_quarters_of_time() -> None:
    # Positions -h to h in two halves: the means are -h/2 and h/2, which leaves a quarter of the
    # variance.
    rows = GUN.all_treatments()
    found = time_confounding(GUN, rows)
    assert found["plate_material"] == pytest.approx(0.75 * 810**2 / (810**2 - 1), rel=1e-12)
    assert found["velocity_level"] < 1e-4
    ordered = _ordered(GUN, GUN.all_treatments(), 5)
    blocks = [key for key, _ in itertools.groupby(ordered[:, 1].tolist())]
    assert len(blocks) == 9 and blocks == blocks[::-1]
    assert time_confounding(GUN, ordered)["anvil_material+insulator"] < 1e-6
    assert set(time_confounding(GUN, GUN.all_treatments()[:1]).values()) == {0.0}
    rng, rows = np.random.default_rng(1), _some(GUN, 105, 0)
    mean = np.mean(
        [time_confounding(GUN, rng.permutation(rows))["velocity_level"] for _ in range(800)]
    )
    assert mean == pytest.approx(2 / 104, rel=0.15)


@pytest.mark.parametrize("blocks", [2, 3, 4])
def test_blocks_take_a_steady_drift_out_of_the_plate_for_one_change_each(blocks: int) -> None:
    rows = balance_levels(GUN, 105, np.random.default_rng(0)).treatments
    ordered = rows[run_order(GUN, rows, np.random.default_rng(1), blocks=blocks)]
    assert changeovers(GUN, ordered)["plate_material"] == blocks
    assert (
        time_confounding(GUN, rows[run_order(GUN, rows, np.random.default_rng(1))])[
            "plate_material"
        ]
        > 0.7
    )
    assert time_confounding(GUN, ordered)["plate_material"] < 0.02
    assert sorted(map(tuple, ordered.tolist())) == sorted(map(tuple, rows.tolist()))


def test_random_order_changes_everything_and_bad_layouts_are_refused() -> None:
    rows = _some(GUN, 200, 1)
    shuffled = rows[run_order(GUN, rows, np.random.default_rng(1), kind="random")]
    assert changeovers(GUN, shuffled)["plate_material"] > 60
    assert max(time_confounding(GUN, shuffled).values()) < 0.1
    for layout, message in (
        ({"kind": "random", "blocks": 2}, "blocks is 2, but the order is random"),
        ({"kind": "sorted"}, "order is 'sorted'; expected one of split-plot, random"),
        ({"blocks": 0}, "blocks is 0; expected 1 to 200"),
        ({"blocks": 201}, "blocks is 201; expected 1 to 200"),
    ):
        with pytest.raises(ValueError, match=message):
            run_order(GUN, rows, np.random.default_rng(1), **layout)
