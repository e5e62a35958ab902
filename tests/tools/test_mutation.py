"""What `make mutants` finds in a law of three lines, and what its page says of the rows that are
kept."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.processes.mutating import limits_alone, tried_alone

from tools.mutation import page, plan, session, verdicts
from tools.mutation.__main__ import PAGE, ROOT, VERDICTS
from tools.mutation.mutants import Mutant, holds, mutants_of, sample, spots
from tools.mutation.rows import Row, Rows

LAW = '''"""A law."""

from __future__ import annotations


def energy(mass: float, speed: float | None = 2.0) -> float:
    return mass * speed**2 / 2


def larger(a: float, b: float) -> float:
    return a if a > b else b


def countdown(n: int) -> int:
    while n > 0:
        n = n - 1
    return n
'''
TESTS = """from pyroshock.law import countdown, energy, larger


def test_law():
    assert energy(3.0, 2.0) == 6.0
    assert larger(1.0, 2.0) == larger(2.0, 1.0) == 2.0
    assert countdown(3) == 0
"""
MUL, GT, SUB = (
    f"Replace{name}"
    for name in ("BinaryOperator_Mul_Div", "ComparisonOperator_Gt_GtE", "BinaryOperator_Sub_Add")
)


@pytest.fixture(scope="module")
def toy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("toy") / "clone"
    (root / "tests").mkdir(parents=True)
    for name, text in (("__init__.py", ""), ("law.py", LAW), ("tests/test_law.py", TESTS)):
        (root / name).write_text(text, encoding="utf-8")
    return root


def mutants(*operators: str) -> list[Mutant]:
    return mutants_of("law.py", LAW, spots(LAW, operators))


def the(operator: str, becomes: str) -> Mutant:
    return next(each for each in mutants(operator) if each.after == becomes)


@pytest.mark.parametrize(("mutant", "what", "by", "limit_s"), [
    (the(MUL, "return mass / speed**2 / 2"), "killed", "tests/test_law.py::test_law", 60.0),
    (the(GT, "return a if a >= b else b"), "survived", "", 60.0),
    (the(SUB, "n = n + 1"), "timed out", "", 2.0),
])  # fmt: skip
def test_what_becomes_of_a_mutant(
    toy: Path, mutant: Mutant, what: str, by: str, limit_s: float
) -> None:
    one = session.Trial(mutant, plan.Target("law.py", ("tests/test_law.py",), None), limit_s)
    (outcome,) = tried_alone(toy, [one])
    assert (outcome.what, outcome.by) == (what, by) and (toy / "law.py").read_text(
        encoding="utf-8"
    ) == LAW


def test_code_that_fails_unchanged_is_refused_and_the_plan_is_of_this_tree(toy: Path) -> None:
    with pytest.raises(RuntimeError, match=r"law.py as it is: killed exit 4"):
        limits_alone(toy, [plan.Target("law.py", ("tests/test_absent.py",), None)])
    assert (
        plan.read(ROOT).chosen(("twin/gun/nominal.py",))[0].tests[0]
        == "tests/twin/gun/test_nominal.py"
    )
    assert {verdict.kind for verdict in verdicts.read(VERDICTS)} == {"equivalent", "left"}


def test_annotations_and_chosen_numbers_are_no_mutants_and_samples_follow_seeds() -> None:
    found = mutants("ReplaceBinaryOperator_BitOr_BitAnd", "NumberReplacer")
    assert {each.after for each in found if each.definition == "energy"} == {
        "def energy(mass: float, speed: float | None = 3.0) -> float:",
        "def energy(mass: float, speed: float | None = 1.0) -> float:",
        "return mass * speed** 3 / 2",
        "return mass * speed** 1 / 2",
        "return mass * speed**2 / 3",
        "return mass * speed**2 / 1",
    }
    source = "x = parameter(default=1.0, likely=(2.0, -3.0))\n"
    assert (
        len(spots(source, ["NumberReplacer"])) == 6
        and len(spots(source, ["NumberReplacer"], ["likely"])) == 2
    )
    every = spots(LAW, ["NumberReplacer"])
    assert sample(every, 4, "1") == sample(every, 4, "1") != sample(every, 4, "2")
    assert sample(every, None, "1") == every


def test_rows_go_with_their_lines_and_keep_what_was_first(tmp_path: Path) -> None:
    rows = Rows(tmp_path / "rows.csv")
    rows.add(row("a >= b", "survived", "survived"))
    rows.keep_only("law.py", lambda before: holds(LAW, before), 7)
    assert [each.of for each in rows] == [7]
    rows.keep_only("law.py", lambda before: holds(LAW.replace("a > b", "b < a"), before), 7)
    assert list(rows) == []
    rows = Rows(tmp_path / "rows.csv")
    rows.add(row("a >= b", "survived", "survived"))
    rows.add(row("a >= b", "killed", "killed"))
    rows.write()
    assert list(Rows(tmp_path / "rows.csv")) == [row("a >= b", "survived", "killed")]


def row(after: str, at_first: str, now: str) -> Row:
    return Row(
        "law.py",
        "f",
        "a > b",
        after,
        0,
        3,
        GT,
        at_first,
        now,
        "tests/t.py::test_f",
        "2026-11-22",
        9,
    )


def test_counts_tell_what_became_of_each_and_new_rows_replace_theirs(tmp_path: Path) -> None:
    kept = [
        row("a < b", "killed", "killed"),
        row("a", "survived", "killed"),
        row("b", "timed out", "timed out"),
    ]
    kept += [row(f"a >= {i}", "survived", "survived") for i in range(3)]
    said = [
        verdicts.Verdict("law.py", "a > b", ("a >= 0",), "equivalent", "one value"),
        _left("a >= 1"),
    ]
    assert "| `law.py` | 9 | 6 | 1 | 1 | 1 | 1 | 1 | 1 | 2026-11-22 |" in page.module_lines(
        kept, said
    )
    copy = tmp_path / "mutation.md"
    copy.write_text(PAGE.read_text(encoding="utf-8"), encoding="utf-8")
    page.write_table(copy, [], [])
    assert copy.read_text(encoding="utf-8") == PAGE.read_text(encoding="utf-8")
    page.write_table(copy, [row("a < b", "killed", "killed")], [])
    page.write_table(copy, [row("a < b", "survived", "survived")], [])
    added = set(copy.read_text(encoding="utf-8").splitlines()) - set(
        PAGE.read_text(encoding="utf-8").splitlines()
    )
    assert "| `law.py` | 9 | 1 | 0 | 0 | 0 | 0 | 0 | 1 | 2026-11-22 |" in added and len(added) == 2


def _left(after: str) -> verdicts.Verdict:
    return verdicts.Verdict("law.py", "a > b", (after,), "left", "costs an hour")
