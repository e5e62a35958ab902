"""Plans made by one function for the command line and the web, and what a page shows of their quality."""

from __future__ import annotations

import json

import pytest
from pyroshock.app.plan.planning import make_plan
from pyroshock.app.plan.quality import plan_page
from pyroshock.doe.designs.methods import METHODS
from pyroshock.doe.plans import PlanExistsError, add_plan, discard_run, read_plan, tick_run
from pyroshock.doe.space import gun_space, shipped_factors
from support.stores.stores import opened


@pytest.fixture
def store(tmp_path):
    with opened(f"sqlite:///{tmp_path / 'lab.db'}", create=True) as store:
        yield store


def read(store, name):
    with store.reading() as session:
        return read_plan(session, name)


def test_same_seed_makes_the_same_plan(store):
    first, second = (make_plan(store, "lhs", name, runs=12, repetitions=2, seed=7) for name in ("a", "b"))
    assert [run.row for run in first.runs] == [run.row for run in second.runs]
    assert (len(first.runs), first.method, first.seed, first.runs[0].repetitions) == (12, "lhs", 7, 2)
    assert all(run.settings["tank_pressure_bar"] > 0 for run in first.runs)


def test_drawn_seed_is_kept_and_makes_the_plan_again(store):
    drawn = make_plan(store, "lhs", "a", runs=12)
    again = make_plan(store, "lhs", "b", runs=12, seed=drawn.seed)
    assert [run.row for run in drawn.runs] == [run.row for run in again.runs]


def test_factorial_of_a_hammer_has_every_treatment(store):
    made = make_plan(store, "factorial", "h", kind="hammer", seed=1)
    assert len({json.dumps(dict(run.row)) for run in made.runs}) == len(made.runs) == made.space.size == 180


def test_table_keeps_its_numbers(store, tmp_path):
    space = gun_space()
    rows = space.rows(space.all_treatments()[[5, 2]])
    table = tmp_path / "in.csv"
    lines = [",".join(["run", *space.columns])]
    lines += [",".join([str(number), *row.values()]) for number, row in zip((9, 4), rows, strict=True)]
    table.write_text("\n".join(lines), encoding="utf-8")
    made = make_plan(store, "import", "t", table=table)
    assert [(run.run, dict(run.row)) for run in made.runs] == [(9, rows[0]), (4, rows[1])]


@pytest.mark.parametrize(
    ("method", "own", "said"),
    [
        ("magic", {}, f"method is 'magic'; expected one of {', '.join(METHODS)}"),
        ("lhs", {}, "runs is None; expected 1 or more"),
        ("lhs", {"runs": 3, "seed": -1}, "seed is -1; expected 0 or more"),
        ("lhs", {"runs": 3, "repetitions": 0}, "repetitions is 0; expected 1 or more"),
        ("lhs", {"runs": 3, "kind": "sling"}, "kind is 'sling'; expected one of hammer, gun"),
        ("import", {}, "no table to import"),
        ("lhs", {"runs": 3, "options": {"face": "ccf"}}, "unknown option 'face'; the method has: criterion"),
        ("lhs", {"runs": 3, "ranges": {"humidity": (1, 2)}}, "no factor 'humidity'"),
        ("plackett-burman", {}, "anvil_material\\+insulator has 5 levels without order"),
    ],
)
def test_what_cannot_be_planned_stores_nothing(store, method, own, said):
    with pytest.raises(ValueError, match=said):
        make_plan(store, method, "a", **own)
    with pytest.raises(ValueError, match="the plan has no name"):
        make_plan(store, "lhs", " ", runs=3)
    with pytest.raises(LookupError, match="no plan 'a'"):
        read(store, "a")


def test_name_that_is_taken_is_refused(store):
    make_plan(store, "lhs", "a", runs=3, seed=1)
    with pytest.raises(PlanExistsError, match="'a' is in the store already"):
        make_plan(store, "lhs", "a", runs=4, seed=1)
    assert len(read(store, "a").runs) == 3


def test_page_counts_levels_changes_and_states(store):
    """Two treatments that differ in the tip alone, fired a a b: one change of tip, no other."""
    space = gun_space()
    treatments = space.all_treatments()
    tips = [axis.name for axis in space.axes].index("tip_material")
    alike = treatments[(treatments == treatments[0])[:, [i for i in range(treatments.shape[1]) if i != tips]].all(1)]
    from pyroshock.doe.designs.base import Design

    add_plan(store, "p", shipped_factors("gun"), Design(space, alike[[0, 0, 1]], "lhs", 1), repetitions=1)
    tick_run(store, "p", 1, status="done")
    page = plan_page(read(store, "p"))
    assert page["counts"] == {"planned": 2, "done": 1, "discarded": 0, "begun": 0}
    assert {each["factor"]: each["changes"] for each in page["changes"] if each["changes"]} == {"tip_material": 1}
    levels = next(each for each in page["levels"] if each["axis"] == "tip_material")
    assert [each["runs"] for each in levels["levels"]] == [2, 1, 0]
    assert levels["share"] == 1.0
    # of positions -1, 0, 1 the levels' means are -0.5 and 1: between groups 2 * 0.25 + 1 of 2
    assert next(each["share"] for each in page["time"] if each["axis"] == "tip_material") == pytest.approx(0.75)
    runs = next(each for each in page["figures"] if each["name"] == "runs")
    assert (runs["value"], runs["text"], runs["better"]) == (3, "3", "neither")
    json.dumps(page, allow_nan=False)


def test_page_of_a_plan_without_runs_is_empty(store):
    make_plan(store, "lhs", "a", runs=1, seed=1)
    json.dumps(plan_page(read(store, "a")), allow_nan=False)
    discard_run(store, "a", 1, "tip broke")
    page = plan_page(read(store, "a"))
    assert page == {"counts": {"planned": 0, "done": 0, "discarded": 1, "begun": 0}} | {
        name: [] for name in ("figures", "levels", "changes", "time")
    }
