"""Every table that a person may open in a spreadsheet: a level that is a formula there is text in
it, numbers are numbers, and programs get both as they are."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyroshock as ps
import pytest
from support.processes.web_client import sqlite, window
from support.stores.hammer_stores import full_campaign, rows_of
from support.stores.stores import ingested, run_pyroshock

#: The level of a factor of the laboratory's own, and a number below zero.
FORMULA, OFFSET = '=HYPERLINK("http://evil.example","x")', -1.5
GUARDED = f"'{FORMULA}"
AS_IT_IS = "--no-spreadsheet-guard"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a store, lab.db, with a campaign and a plan whose levels are formulas to a
    spreadsheet."""
    folder = tmp_path_factory.mktemp("guarded")
    url = sqlite(folder)
    rows = [
        {**row, "batch": FORMULA if row["run"] == 1 else "plain", "offset": OFFSET}
        for row in rows_of(4)
    ]
    ingested(url, full_campaign(folder / "campaigns" / "many", "many", recordings=4, rows=rows))
    factors = (
        f"name = 'own'\nkind = 'hammer'\n[[factors]]\nname = 'lot'\nkind = "
        f"'categorical'\nlevels = ['{FORMULA}', 'b']\n"
    )
    (folder / "factors.toml").write_text(factors, encoding="utf-8")
    plan_options = ("--factors", folder / "factors.toml", "--seed", "1", "--db", url)
    run_pyroshock("plan", "factorial", "planned", *plan_options, "--out", folder / "plan.csv")
    return folder


def cells(text: str) -> set[str]:
    return {
        cell
        for row in csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""))
        for cell in row
    }


#: What writes CSV -> the words of the command; OUT is a file, and without it the table is printed.
COMMANDS: dict[str, tuple[str, ...]] = {
    "export": ("export", "impacts", "--out", "OUT"),
    "export pulses": ("export", "pulses", "--out", "OUT"),
    "listing": ("impacts", "--csv"),
    "query": ("query", "select label, -1.5 as offset_mm from factor_levels", "--csv"),
    "query to a file": (
        "query",
        "select label, -1.5 as offset_mm from factor_levels",
        "--out",
        "OUT",
    ),
    "run sheet": ("plan", "sheet", "planned", "--out", "OUT"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_guards_texts_and_leaves_them_to_programs(
    lab: Path, tmp_path: Path, name: str
) -> None:
    out = tmp_path / "out.csv"
    words = [str(out) if word == "OUT" else word for word in COMMANDS[name]]
    tables = []
    for more in ((), (AS_IT_IS,)):
        printed = run_pyroshock(*words, "--db", sqlite(lab), *more).stdout
        tables.append(
            cells(out.read_text(encoding="utf-8") if "OUT" in COMMANDS[name] else printed)
        )
    for_people, for_programs = tables
    assert GUARDED in for_people and FORMULA not in for_people
    assert FORMULA in for_programs and GUARDED not in for_programs
    if name != "run sheet":
        assert str(OFFSET) in for_people & for_programs


def test_a_dataset_is_guarded(tmp_path: Path) -> None:
    url, out = sqlite(tmp_path), tmp_path / "out.csv"
    ingested(url, full_campaign(tmp_path / "campaigns" / "many", "=many"))
    run_pyroshock("dataset", "build", "pulses", "--from", "=many", "--db", url)
    run_pyroshock("dataset", "export", "pulses", "--out", out, "--db", url)
    assert "'=many" in cells(out.read_text()) and "=many" not in cells(out.read_text())
    run_pyroshock("dataset", "export", "pulses", "--out", out, "--db", url, AS_IT_IS)
    assert "=many" in cells(out.read_text())


def test_the_table_of_a_plan_is_guarded_and_imported_as_it_was(lab: Path, tmp_path: Path) -> None:
    plan_options = ("--factors", lab / "factors.toml", "--db", sqlite(tmp_path))
    table = (lab / "plan.csv").read_text()
    assert GUARDED in cells(table) and FORMULA not in cells(table)
    run_pyroshock(
        "plan", "import", "b", lab / "plan.csv", *plan_options, "--out", tmp_path / "again.csv"
    )
    assert (tmp_path / "again.csv").read_text() == table
    run_pyroshock(
        "plan",
        "import",
        "c",
        lab / "plan.csv",
        *plan_options,
        "--out",
        tmp_path / "c.csv",
        AS_IT_IS,
    )
    assert FORMULA in cells((tmp_path / "c.csv").read_text())


def test_a_campaign_folder_that_is_begun_from_a_plan_reads_back_its_levels(
    lab: Path, tmp_path: Path
) -> None:
    from pyroshock.ingest.folder.tables import read_table

    run_pyroshock(
        "campaigns",
        "init",
        tmp_path / "new",
        "--kind",
        "hammer",
        "--plan",
        "planned",
        "--db",
        sqlite(lab),
    )
    runs = tmp_path / "new" / "runs.csv"
    assert GUARDED in cells(runs.read_text(encoding="utf-8"))
    _, rows = read_table(runs, runs.name)
    assert {row["lot"] for _, row in rows} == {FORMULA, "b"}


PAGES: dict[str, Callable[[Any], dict[str, str]]] = {
    "/campaigns/many/export": lambda guard: {"what": "impacts", "format": "csv", **guard},
    "/plans/planned/sheet.csv": lambda guard: guard,
}


@pytest.mark.parametrize("address", PAGES)
def test_pages_guard_the_files_that_they_save(lab: Path, address: str) -> None:
    with window(sqlite(lab), folders=(lab / "campaigns",)) as (client, _):
        for_people = cells(client.get(address, params=PAGES[address]({})).text)
        for_programs = cells(
            client.get(address, params=PAGES[address]({"spreadsheet_guard": "false"})).text
        )
    assert GUARDED in for_people and FORMULA in for_programs and FORMULA not in for_people


def test_the_library_guards_the_run_sheet(lab: Path) -> None:
    with ps.open(sqlite(lab)) as store:
        plan = store.plan.open("planned")
        assert GUARDED in cells(plan.sheet()) and FORMULA in cells(
            plan.sheet(spreadsheet_guard=False)
        )
