"""Which cases are drawn for which tier, kind and split."""

from __future__ import annotations

import pytest
from pyroshock.validation.case_plan import BENCHES, SEEDS, SPLITS, case_of_task, tasks


def test_kinds_take_turns_on_benches() -> None:
    assert [task.kind for task in tasks(6, 1, ["realistic"])] == ["gun", "hammer", "plate", "chain", "gun", "hammer"]


def test_kind_has_the_same_cases_whatever_stands_beside_it() -> None:
    alone = tasks(2, 1, ["realistic"], kinds=["hammer"])
    among = [task for task in tasks(8, 1, ["realistic"]) if task.kind == "hammer"]
    assert alone == among


def test_splits_have_other_cases_of_the_same_seed() -> None:
    seeds = {task.seed for split in SPLITS for task in tasks(4, 1, list(BENCHES), split)}
    assert len(seeds) == 4 * len(SPLITS) * len(BENCHES)


def test_every_split_has_a_seed_of_its_own() -> None:
    assert set(SEEDS) == set(SPLITS)
    assert len(set(SEEDS.values())) == len(SPLITS)


def test_realistic_case_is_drawn_again_alike() -> None:
    task = tasks(1, 1, ["realistic"], kinds=["hammer"])[0]
    case, seed = case_of_task(task)
    case_of_task.cache_clear()
    assert case_of_task(task) == (case, seed)
    assert len(case.strengths) > 1


@pytest.mark.parametrize(("tiers", "kinds", "named"), [(["loud"], [], "tier"), (["realistic"], ["rifle"], "kind")])
def test_unknown_words_are_refused_by_name(tiers: list[str], kinds: list[str], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        tasks(1, 1, tiers, kinds=kinds)
