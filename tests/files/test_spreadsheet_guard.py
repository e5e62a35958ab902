"""Texts in CSV that a spreadsheet would take for formulas: guarded wherever we write, and read as
they were."""

from __future__ import annotations

import ast
import csv
import io
from pathlib import Path

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.files.delimited_text import table_rows
from pyroshock.files.spreadsheet_guard import (
    GuardedCsv,
    guarded,
    guarded_frame,
    guarding,
    without_guard,
)
from pyroshock.tools.structure import product_files

ROOT = Path(__file__).resolve().parents[2]
#: Writers of what other programs read: campaign folders of the virtual bench, whose files the
#: exchange format states.
FOR_PROGRAMS = {"virtualbench/plate/modes.py", "virtualbench/recorder.py"}
FORMULAS = [
    "=1+1", "=HYPERLINK(\"http://evil.example\")", "+cmd|' /C calc'!A0", "-2+3+cmd|' /C calc'!A0",
    "@SUM(1;1)",
    "\t=1+1", "\r=1+1", "\n=1+1", "＝1+1", "－1+A1", "-A1", "+1-1", "--1", "'=1+1",
]  # fmt: skip


@pytest.mark.parametrize("text", FORMULAS)
def test_a_formula_becomes_a_text_and_is_read_as_it_was(text: str) -> None:
    assert guarded(text) == f"'{text}" and without_guard(guarded(text)) == text


@pytest.mark.parametrize("cell", [
    "-5", "-5.2", "+3e-4", "-1,5", "-.5", "-2.", -5.2, -3, None, float("nan"), "-", "+", "",
    "steel", "a=b", "it's", "5-3", "'quoted'", "5 bar", True,
])  # fmt: skip
def test_numbers_and_other_texts_stay(cell: object) -> None:
    assert guarded(cell) is cell


@given(st.text(max_size=12))
def test_every_text_comes_back_and_none_is_a_formula(text: str) -> None:
    shown = guarded(text)
    assert without_guard(shown) == text
    assert (
        not shown.startswith(("=", "+", "-", "@"))
        or len(shown) == 1
        or shown.lstrip("+-")[:1] in "0123456789.,"
    )


@given(
    st.lists(
        st.text("=+-@'ab1 ", min_size=1, max_size=6).map(str.strip).filter(bool),
        min_size=1,
        max_size=4,
    )
)
def test_a_row_comes_back_through_a_file(cells: list[str]) -> None:
    stream = io.StringIO(newline="")
    GuardedCsv(stream).write_row(["x", *cells])
    ((_, (_, *read)),) = table_rows(stream.getvalue())
    assert read == cells


def test_programs_get_texts_as_they_are() -> None:
    with guarding(False):
        assert guarded("=1+1") == "=1+1"
    assert guarded("=1+1") == "'=1+1"


def test_a_frame_is_guarded_in_its_cells_and_names() -> None:
    frame = guarded_frame(pd.DataFrame({"=a": ["=1", "b"], "n": [-1.5, 2.0]}))
    assert list(frame.columns) == ["'=a", "n"] and list(frame["'=a"]) == ["'=1", "b"]
    assert frame["n"].dtype == float and frame["n"].sum() == 0.5


def test_rows_are_written_as_csv_quotes_them() -> None:
    stream = io.StringIO(newline="")
    writer = GuardedCsv(stream, line_end="\n")
    writer.write_row(["a,b", "=c"])
    writer.write_rows([[-1.5, None], ["x", 'say "y"']])
    assert list(csv.reader(io.StringIO(stream.getvalue()))) == [
        ["a,b", "'=c"],
        ["-1.5", ""],
        ["x", 'say "y"'],
    ]


def _calls(tree: ast.AST) -> set[str]:
    return {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}


def test_the_product_writes_csv_nowhere_else() -> None:
    """`to_csv` only of a guarded frame, or where the text is read back at once."""
    places = {}
    for file in product_files(ROOT):
        if "csv" not in file.text:
            continue
        calls = _calls(file.tree)
        if writers := {
            call
            for call in calls
            if call in ("csv.writer", "csv.DictWriter") or call.endswith("to_csv")
        }:
            places[file.path.as_posix()] = writers
    assert (
        places
        == {
            "files/spreadsheet_guard.py": {"csv.writer"},
            "virtualbench/plate/modes.py": {"csv.writer"},
            "virtualbench/recorder.py": {"csv.DictWriter"},
            "app/operations/train/datasets.py": {"guarded_frame(frame).to_csv"},
            "app/library/plans.py": {"guarded_frame(table).to_csv"},
            "app/operations/tune/service.py": {"table.to_csv"},
        }
        and places.keys() >= FOR_PROGRAMS
    )
