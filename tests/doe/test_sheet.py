"""The run sheet: the plan in order of run, in three formats, with what has to be rebuilt before each run."""

from __future__ import annotations

import csv
from dataclasses import replace

import pytest
from pyroshock.doe.plans import StoredPlan, StoredRun
from pyroshock.doe.sheet import TICK, sheet_of, write_sheet
from pyroshock.doe.space import gun_space, shipped_factors

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
    return StoredRun(number, number, 10, status, reason, {**BASE, **changes}, {"tank_pressure_bar": 1.23456}, 0)


@pytest.fixture
def plan() -> StoredPlan:
    runs = (
        run(1),
        run(2, tip_material="PLA"),
        run(3, status="discarded", anvil_material="steel"),
        run(4, plate_material="steel", anvil_material="steel"),
    )
    return StoredPlan("spring", "lhs", 7, None, shipped_factors("gun"), gun_space(), runs)


def test_changeovers_are_told_before_the_run(plan):
    changes = [row.changes for row in sheet_of(plan).rows]
    assert changes[1] == ()  # a tip is changed in no time
    assert changes[3] == ("plate_material: steel", "anvil_material: steel")
    assert [change.split(":")[0] for change in changes[0]] == ["plate_material", "anvil_material", "insulator"]


def test_csv_has_the_treatments(plan, tmp_path):
    write_sheet(plan, tmp_path / "sheet.csv")
    with (tmp_path / "sheet.csv").open(newline="", encoding="utf-8-sig") as file:
        rows = list(csv.DictReader(file))
    assert [{key: row[key] for key in BASE} for row in rows] == [dict(r.row) for r in plan.runs]
    assert rows[0]["tank_pressure_bar"] == "1.235"
    assert [row["done"] for row in rows] == [TICK, TICK, "✗", TICK]


def test_html_escapes_and_strikes_through(plan, tmp_path):
    write_sheet(plan, tmp_path / "sheet.html")
    text = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;broke" in text and "<b>broke" not in text
    assert text.count("<tr class='discarded") == 1 and text.count("<tr class='planned") == 3
    assert "30 repetitions" in text


def test_xlsx_holds_numbers_and_texts(plan, tmp_path):
    from openpyxl import load_workbook

    formula = replace(plan, runs=(run(1, tip_material="=1+1"),))
    write_sheet(formula, tmp_path / "sheet.xlsx")
    page = load_workbook(tmp_path / "sheet.xlsx").active
    header = [cell.value for cell in page[1]]
    row = dict(zip(header, page[2], strict=True))
    assert row["tip_radius_mm"].value == 30
    assert (row["tip_material"].value, row["tip_material"].data_type) == ("=1+1", "s")
    noted = replace(plan, runs=(replace(run(1, status="discarded"), reason="bolt\x07 \x00broke, ±2 µm"),))
    write_sheet(noted, tmp_path / "sheet.xlsx")
    cells = [cell.value for cell in load_workbook(tmp_path / "sheet.xlsx").active[2]]
    assert any(isinstance(cell, str) and "bolt broke, ±2 µm" in cell for cell in cells)
    with pytest.raises(ValueError, match=r"known: \.html, \.csv, \.xlsx"):
        write_sheet(plan, tmp_path / "sheet.pdf")
