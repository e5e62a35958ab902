"""Plans in the store: what was planned comes back, its state with it, and its run sheet in three
formats."""

from __future__ import annotations

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.doe.designs.base import Design
from pyroshock.doe.plans import (
    NoteMissingError,
    PlanExistsError,
    StoredPlan,
    StoredRun,
    UnknownPlanError,
    add_plan,
    discard_run,
    extend_plan,
    list_plans,
    read_plan,
    tick_run,
)
from pyroshock.doe.sheet import TICK, boxes, column_label, sheet_of, write_sheet
from pyroshock.doe.space import gun_space, shipped_factors
from pyroshock.schema.campaigns import PlannedRun
from pyroshock.schema.session import Store, Writer, count_rows, open_store
from sqlalchemy import select
from support.stores.planned_runs import find_fault, record_run

FACTORS = shipped_factors("gun")


@pytest.fixture
def store(tables_url):
    with open_store(tables_url, Writer("test", "0"), create=True) as store:
        yield store


def design(n: int = 12, seed: int = 1) -> Design:
    space = gun_space()
    chosen = np.random.default_rng(seed).choice(space.size, n, replace=False)
    return Design(space, space.all_treatments()[chosen], "lhs", seed)


def planned(store: Store, name: str = "spring", n: int = 12) -> Design:
    made = design(n)
    settings = [{"tank_pressure_bar": 1.0 + 0.1 * i} for i in range(n)]
    add_plan(store, name, FACTORS, made, repetitions=3, settings=settings)
    return made


def read(store: Store, name: str = "spring"):
    with store.reading() as session:
        return read_plan(session, name)


def test_plan_comes_back_as_it_was_made(store):
    made = planned(store)
    plan = read(store)
    assert plan.treatments().tolist() == made.treatments.tolist()
    assert (plan.method, plan.seed, plan.space) == ("lhs", 1, made.space)
    assert [run.run for run in plan.runs] == list(range(1, 13))
    assert plan.runs[3].settings == {"tank_pressure_bar": 1.3}
    assert {(run.status, run.repetitions, run.accepted) for run in plan.runs} == {
        ("planned", 3, ())
    }
    with store.reading() as session:
        row = session.scalars(select(PlannedRun).where(PlannedRun.run == 2)).one()
        levels = {
            level.factor.name: level.number or level.label for level in row.configuration.levels
        }
    assert levels["tank_pressure"] == pytest.approx(1.1e5)
    assert levels["tip_radius"] == pytest.approx(1e-3 * float(row.treatment["tip_radius_mm"]))
    assert levels["velocity_level"] == row.treatment["velocity_level"]


def test_name_is_taken_once(store):
    planned(store)
    before = count_rows(store)
    with pytest.raises(PlanExistsError, match="'spring' is in the store already"):
        planned(store)
    assert count_rows(store) == before
    with pytest.raises(UnknownPlanError, match=r"no plan 'autumn'.*spring"):
        read(store, "autumn")
    space = gun_space()
    rows = [{**row, "tip_material": "unobtainium"} for row in space.rows(design(2).treatments)]
    with pytest.raises(ValueError, match=r"run 13: tip_material is 'unobtainium'"):
        extend_plan(store, "spring", rows, repetitions=3)
    assert count_rows(store) == before


def test_discarded_run_is_out_with_its_reason_and_further_runs_go_to_the_end(store):
    planned(store)
    discard_run(store, "spring", 4, "tip broke")
    plan = read(store)
    assert [(run.run, run.reason) for run in plan.runs if run.status == "discarded"] == [
        (4, "tip broke")
    ]
    assert len(plan.treatments("planned", "done")) == 11
    assert extend_plan(store, "spring", design(2, seed=5).rows, repetitions=1) == [13, 14]
    plan = read(store)
    assert [run.position for run in plan.runs] == list(range(1, 15))
    assert plan.runs[-1].repetitions == 1


@pytest.mark.parametrize(("run", "reason", "said"), [(99, "x", "no run 99"), (1, " ", "no reason")])
def test_discarding_needs_a_run_and_a_reason(store, run, reason, said):
    planned(store)
    with pytest.raises(ValueError, match=said):
        discard_run(store, "spring", run, reason)


def run_of(store: Store, number: int) -> StoredRun:
    return next(stored for stored in read(store).runs if stored.run == number)


def decided(store: Store, number: int) -> tuple[str, str | None]:
    stored = run_of(store, number)
    return stored.status, stored.reason


def test_run_is_done_when_its_repetitions_are_recorded_and_accepted(store):
    planned(store)
    record_run(store, "spring", 4, (1, 2))
    assert (run_of(store, 4).status, run_of(store, 4).state) == ("planned", "2 of 3 recorded")
    record_run(store, "spring", 4, (3,))
    find_fault(store, "spring", 4, 3, "warning")
    assert (run_of(store, 4).status, run_of(store, 4).state) == ("done", "done")
    with store.reading() as session:
        (row,) = list_plans(session)
    assert (row["runs"], row["planned"], row["done"], row["discarded"], row["repeat"]) == (
        12,
        11,
        1,
        0,
        0,
    )


def test_rejected_repetition_asks_for_a_repeat_until_it_is_recorded_again(store):
    planned(store)
    record_run(store, "spring", 4, (1, 2, 3))
    find_fault(store, "spring", 4, 2)
    stored = run_of(store, 4)
    assert (stored.status, stored.accepted, stored.rejected, stored.repeats) == (
        "planned",
        (1, 3),
        (2,),
        1,
    )
    assert stored.state == "repeat 1 of 3: repetition 2 is rejected" and boxes(stored) == "☑↻☑"
    find_fault(store, "spring", 4, 3)
    assert run_of(store, 4).state == "repeat 2 of 3: repetitions 2, 3 are rejected"
    with store.reading() as session:
        assert [(row["planned"], row["repeat"]) for row in list_plans(session)] == [(12, 1)]
    record_run(store, "spring", 4, (4,))
    assert (run_of(store, 4).repeats, boxes(run_of(store, 4))) == (1, "☑↻☑")
    record_run(store, "spring", 4, (5,))
    assert (run_of(store, 4).state, boxes(run_of(store, 4))) == ("done", "☑☑☑")


def test_dead_accelerometer_asks_for_no_repeat_and_a_bad_force_does(store):
    planned(store)
    record_run(store, "spring", 4, (1, 2, 3))
    find_fault(store, "spring", 4, 1, quantity="acceleration")
    assert run_of(store, 4).state == "done"
    find_fault(store, "spring", 4, 1, quantity="force")
    assert run_of(store, 4).rejected == (1,)


def test_what_is_begun_and_rejected_says_both(store):
    planned(store)
    record_run(store, "spring", 4, (1,))
    find_fault(store, "spring", 4, 1)
    assert run_of(store, 4).state == "0 of 3 recorded; repeat 1 of 3: repetition 1 is rejected"
    assert boxes(run_of(store, 4)) == "↻☐☐"


def test_decision_is_kept_with_its_note_until_it_changes(store):
    planned(store)
    tick_run(store, "spring", 4, status="discarded", note=" tip broke ")
    tick_run(store, "spring", 4, status="discarded", note="tip and anvil broke")
    assert decided(store, 4) == ("discarded", "tip and anvil broke")
    tick_run(store, "spring", 4, status="planned", note=" ")
    assert decided(store, 4) == ("planned", None)
    record_run(store, "spring", 4)
    ticked = tick_run(store, "spring", 4, status="done", note="the plate cracked; one is enough")
    assert (ticked.run, ticked.status, ticked.state) == (4, "done", "done with 1 of 3")
    tick_run(store, "spring", 4, status="done")
    assert decided(store, 4) == ("done", "the plate cracked; one is enough")
    assert tick_run(store, "spring", 4, status="planned").state == "1 of 3 recorded"
    assert decided(store, 4) == ("planned", None)


def test_nobody_makes_a_run_done_that_is_not_recorded(store):
    planned(store)
    for note in (None, "I saw it"):
        with pytest.raises(
            ValueError, match=r"run 4 of plan 'spring' is not done: 0 of 3 repetitions .* Ingest"
        ):
            tick_run(store, "spring", 4, status="done", note=note)
    record_run(store, "spring", 4, (1, 2))
    with pytest.raises(
        NoteMissingError, match=r"run 4 of plan 'spring' has 2 of 3 repetitions; .* write a note"
    ):
        tick_run(store, "spring", 4, status="done")
    find_fault(store, "spring", 4, 1)
    find_fault(store, "spring", 4, 2)
    with pytest.raises(
        ValueError, match=r"0 of 3 repetitions are recorded and accepted \(2 rejected\)"
    ):
        tick_run(store, "spring", 4, status="done", note="good enough")
    assert decided(store, 4) == ("planned", None)


def test_decision_for_fewer_repetitions_falls_with_the_last_of_them(store):
    planned(store)
    record_run(store, "spring", 4, (1, 2))
    tick_run(store, "spring", 4, status="done", note="two are enough")
    find_fault(store, "spring", 4, 1)
    assert run_of(store, 4).state == "done with 1 of 3"
    find_fault(store, "spring", 4, 2)
    assert (run_of(store, 4).status, run_of(store, 4).repeats) == ("planned", 2)


def test_completely_recorded_run_is_opened_by_discarding_a_recording_alone(store):
    planned(store)
    record_run(store, "spring", 4, (1, 2, 3))
    with pytest.raises(
        ValueError, match=r"run 4 of plan 'spring' is done: 3 of 3 .* discard its recording"
    ):
        tick_run(store, "spring", 4, status="planned", note="the plate had slipped")
    assert (
        tick_run(store, "spring", 4, status="done", note="with the new tip").reason
        == "with the new tip"
    )
    find_fault(store, "spring", 4, 2)
    assert (
        run_of(store, 4).state == "repeat 1 of 3: repetition 2 is rejected"
    )  # the note decided nothing
    tick_run(store, "spring", 4, status="discarded", note="the plate had slipped")
    record_run(store, "spring", 4, (4,))
    assert run_of(store, 4).status == "discarded"
    assert tick_run(store, "spring", 4, status="planned").status == "done"


@pytest.mark.parametrize(
    ("plan", "run", "status", "kind", "said"),
    [
        ("autumn", 1, "done", UnknownPlanError, r"no plan 'autumn' in the store; there: spring"),
        ("spring", 99, "done", ValueError, "plan 'spring' has no run 99"),
        (
            "spring",
            1,
            "fired",
            ValueError,
            "status of run 1 is 'fired'; expected one of planned, done, discarded",
        ),
        ("spring", 1, "discarded", NoteMissingError, "say why run 1 is discarded"),
    ],
)
def test_tick_that_cannot_be_changes_nothing(store, plan, run, status, kind, said):
    planned(store)
    with pytest.raises(kind, match=said):
        tick_run(store, plan, run, status=status)
    assert {stored.status for stored in read(store).runs} == {"planned"}


BASE = {
    "plate_material": "aluminum",
    "anvil_material": "none",
    "insulator": "none",
    "tip_material": "steel",
    "tip_radius_mm": "30",
    "bullet_mass_kg": "0.5",
    "velocity_level": "low",
}


def run(number: int, status: str = "planned", **changes: str) -> StoredRun:
    reason = "<b>broke</b>" if status == "discarded" else None
    return StoredRun(
        number, number, 10, status, reason, {**BASE, **changes}, {"tank_pressure_bar": 1.23456}
    )


@pytest.fixture
def plan() -> StoredPlan:
    runs = (
        run(1),
        run(2, tip_material="PLA"),
        run(3, status="discarded", anvil_material="steel"),
        run(4, plate_material="steel", anvil_material="steel"),
    )
    return StoredPlan("spring", "lhs", 7, None, shipped_factors("gun"), gun_space(), runs)


def test_changeovers_are_told_before_the_run(plan, tmp_path):
    changes = [row.changes for row in sheet_of(plan).rows]
    assert changes[1] == ()  # a tip is changed in no time
    assert changes[3] == ("plate material: steel", "anvil material: steel")
    assert [change.split(":")[0] for change in changes[0]] == [
        "plate material",
        "anvil material",
        "insulator",
    ]
    write_sheet(plan, tmp_path / "sheet.csv")
    with (tmp_path / "sheet.csv").open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    assert [{key: row[key] for key in BASE} for row in rows] == [dict(r.row) for r in plan.runs]
    assert rows[0]["tank_pressure_bar"] == "1.235"
    assert [row["done"] for row in rows] == [10 * TICK, 10 * TICK, "✗", 10 * TICK]
    recorded = replace(plan.runs[0], accepted=(1, 2, 3))
    assert boxes(recorded) == 3 * "☑" + 7 * TICK
    write_sheet(plan, tmp_path / "sheet.html")
    text = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;broke" in text and "<b>broke" not in text
    assert text.count("<tr class='discarded") == 1 and text.count("<tr class='planned") == 3
    assert "30 repetitions" in text and "<th>tip radius (mm)</th>" in text and "Operator" in text
    # only what differs from the run before it is bold; a discarded run is no run before
    tip = BASE["tip_material"]
    assert re.findall(r"differs'>([^<]*)", text) == ["PLA", "steel", tip, "steel", "steel", tip]


def test_xlsx_holds_numbers_and_texts(plan, tmp_path):
    from openpyxl import load_workbook

    formula = replace(plan, runs=(run(1, tip_material="=1+1"),))
    write_sheet(formula, tmp_path / "sheet.xlsx")
    page = load_workbook(tmp_path / "sheet.xlsx").active
    header = [cell.value for cell in page[1]]
    row = dict(zip(header, page[2], strict=True))
    assert row["tip_radius_mm"].value == 30
    assert (row["tip_material"].value, row["tip_material"].data_type) == ("=1+1", "s")
    noted = replace(
        plan, runs=(replace(run(1, status="discarded"), reason="bolt\x07 \x00broke, ±2 µm"),)
    )
    write_sheet(noted, tmp_path / "sheet.xlsx")
    cells = [cell.value for cell in load_workbook(tmp_path / "sheet.xlsx").active[2]]
    assert any(isinstance(cell, str) and "bolt broke, ±2 µm" in cell for cell in cells)
    with pytest.raises(ValueError, match=r"known: \.html, \.csv, \.xlsx"):
        write_sheet(plan, tmp_path / "sheet.pdf")


@pytest.mark.parametrize(
    ("column", "label"),
    [("tip_radius_mm", "tip radius (mm)"), ("impact_velocity_m_s", "impact velocity (m/s)"),
     ("run", "run"), ("tank_pressure_bar", "tank pressure (bar)"),
     ("set-up change", "set-up change")],
)  # fmt: skip
def test_column_of_a_sheet_is_named_in_words_with_its_unit(column, label):
    assert column_label(column) == label
