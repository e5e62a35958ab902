"""The first inputs of the long run, without guidance: the same targets, damage and rules, a few of each."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from fuzzing.oracle import FINDING, judge
from fuzzing.target import ACCEPTED, REFUSED, Target
from fuzzing.targets import TARGETS

#: A whole ingest takes as long as a hundred tables. What may crash its library is left to the long run's processes.
INPUTS, SLOW_INPUTS = 25, 4
SHORT = {name: target for name, target in TARGETS.items() if not target.may_crash}


@pytest.mark.parametrize("name", SHORT)
def test_damaged_input_is_accepted_whole_or_refused(name: str, tmp_path: Path) -> None:
    target, rng = SHORT[name], Random(f"short run of {name}")
    seeds = list(target.seeds())
    for _n in range(INPUTS if target.weight >= 1 else SLOW_INPUTS):
        data = target.mutate(rng.choice(seeds), rng, seeds)
        outcome = judge(target, data, tmp_path / "x")
        assert outcome.kind != FINDING, f"{outcome.where}\n{outcome.detail}\n{data[:300]!r}"


@pytest.mark.parametrize("name", [name for name in SHORT if SHORT[name].weight >= 1])
def test_every_seed_is_accepted(name: str, tmp_path: Path) -> None:
    """Else the campaign would damage what is refused anyway."""
    target = SHORT[name]
    assert {judge(target, data, tmp_path / "x").kind for data in target.seeds()} == {ACCEPTED}


@pytest.mark.parametrize(
    ("error", "kind"),
    [
        (ValueError("input.csv: no number"), REFUSED),
        (ValueError("no number"), FINDING),
        (KeyError("force"), FINDING),
        (SystemExit(3), FINDING),
        (MemoryError(), FINDING),
    ],
)
def test_anything_but_a_refusal_that_names_the_file_is_found(error: BaseException, kind: str, tmp_path: Path) -> None:
    assert judge(_raising(error), b"", tmp_path / "x").kind == kind


def test_lack_of_memory_behind_a_refusal_is_found(tmp_path: Path) -> None:
    refusal = ValueError("input.csv: damaged")
    refusal.__cause__ = MemoryError()
    assert judge(_raising(refusal), b"", tmp_path / "x").kind == FINDING


def _raising(error: BaseException) -> Target:
    def use(data: bytes, folder: Path) -> str:
        raise error

    return Target("a reader", use, list, lambda data, rng, others: data, (ValueError,), "input.csv", ())
