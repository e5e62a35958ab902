"""The run sheet: a plan in order of run, for the wall of the laboratory, with a box to tick for each run."""

from __future__ import annotations

import csv
import html
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..delimited_text import parse_number
from ..schema.atomic_write import atomic_file
from .plans import StoredPlan, StoredRun
from .space import Space

TICK = "☐"
_MARKS = {"planned": TICK, "done": "☑", "discarded": "✗"}


@dataclass(frozen=True)
class SheetRow:
    """A run as a person reads it. `changes` names what has to be rebuilt before it."""

    cells: tuple[str, ...]
    changes: tuple[str, ...]
    status: str


@dataclass(frozen=True)
class Sheet:
    """The table of a plan: the same content for every format."""

    title: str
    subtitle: str
    header: tuple[str, ...]
    rows: tuple[SheetRow, ...]


def sheet_of(plan: StoredPlan) -> Sheet:
    """The sheet of a stored plan; discarded runs stay on it, crossed out."""
    settings = tuple(dict.fromkeys(key for run in plan.runs for key in run.settings))
    header = ("order", "run", *plan.space.columns, *settings, "repetitions", "before it", "done", "remarks")
    rows = []
    before: StoredRun | None = None
    for run in plan.runs:
        changes = _changes(plan.space, before, run)
        rows.append(SheetRow(_cells(plan.space, settings, run, changes), changes, run.status))
        if run.status != "discarded":
            before = run
    active = [run for run in plan.runs if run.status != "discarded"]
    shots = sum(run.repetitions for run in active)
    seed = "" if plan.seed is None else f", seed {plan.seed}"
    return Sheet(
        f"Plan {plan.name}", f"{len(active)} runs, {shots} repetitions; {plan.method}{seed}", header, tuple(rows)
    )


def write_sheet(plan: StoredPlan, path: Path) -> None:
    """Write the sheet as printable HTML, CSV or XLSX, by the suffix. Raises `ValueError` for another one."""
    writers: dict[str, Callable[[Sheet, Path], None]] = {
        ".html": _write_html,
        ".htm": _write_html,
        ".csv": _write_csv,
        ".xlsx": _write_xlsx,
    }
    writer = writers.get(path.suffix.lower())
    if writer is None:
        raise ValueError(
            f"{path.name}: no sheet of format {path.suffix or 'without suffix'!r}; known: .html, .csv, .xlsx"
        )
    with atomic_file(path) as partial:
        writer(sheet_of(plan), partial)


def _changes(space: Space, before: StoredRun | None, run: StoredRun) -> tuple[str, ...]:
    """Factors that take work to change and differ from the run before, the heaviest first."""
    heavy = sorted((f for f in space.factors if f.change > 0), key=lambda f: -f.change)
    if before is None:
        return tuple(f"{f.name}: {run.row[f.column]}" for f in heavy)
    return tuple(f"{f.name}: {run.row[f.column]}" for f in heavy if run.row[f.column] != before.row[f.column])


def _cells(space: Space, settings: Sequence[str], run: StoredRun, changes: Sequence[str]) -> tuple[str, ...]:
    numbers = [f"{run.settings[key]:.4g}" if key in run.settings else "" for key in settings]
    remarks = run.reason or ""
    return (
        str(run.position),
        str(run.run),
        *(run.row[column] for column in space.columns),
        *numbers,
        str(run.repetitions),
        "; ".join(changes),
        _MARKS[run.status],
        remarks,
    )


def sheet_text(plan: StoredPlan) -> str:
    """The sheet as CSV."""
    return _csv_text(sheet_of(plan))


def _csv_text(sheet: Sheet) -> str:
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(sheet.header)
    writer.writerows(row.cells for row in sheet.rows)
    return text.getvalue()


def _write_csv(sheet: Sheet, path: Path) -> None:
    path.write_bytes(_csv_text(sheet).encode("utf-8-sig"))  # the mark tells spreadsheets that it is UTF-8


_STYLE = """
body { font: 11pt sans-serif; margin: 1.5em; }
table { border-collapse: collapse; width: 100%; }
th, td { border: 1px solid #888; padding: 0.25em 0.5em; text-align: left; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
tr.change td { border-top: 3px solid #222; }
tr.discarded td { text-decoration: line-through; color: #777; }
td.done { text-align: center; font-size: 14pt; }
td.remarks { min-width: 10em; }
@page { size: A4 landscape; margin: 1cm; }
@media print { body { margin: 0; font-size: 9pt; } }
"""


def _write_html(sheet: Sheet, path: Path) -> None:
    head = "".join(f"<th>{html.escape(name)}</th>" for name in sheet.header)
    body = "\n".join(_html_row(sheet.header, row) for row in sheet.rows)
    path.write_text(
        f"<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{html.escape(sheet.title)}</title>"
        f"<style>{_STYLE}</style></head>\n<body><h1>{html.escape(sheet.title)}</h1>"
        f"<p>{html.escape(sheet.subtitle)}</p>\n<table><thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n"
        "</tbody></table></body></html>\n",
        encoding="utf-8",
    )


def _html_row(header: Sequence[str], row: SheetRow) -> str:
    classes = " ".join([row.status, *(["change"] if row.changes else [])])
    cells = "".join(
        f"<td class='{html.escape(name.replace(' ', '-'))}'>{html.escape(cell)}</td>"
        for name, cell in zip(header, row.cells, strict=True)
    )
    return f"<tr class='{classes}'>{cells}</tr>"


def _write_xlsx(sheet: Sheet, path: Path) -> None:
    from openpyxl import Workbook
    from openpyxl.styles import Font, PatternFill
    from openpyxl.utils import get_column_letter

    book = Workbook()
    page = book.active
    assert page is not None
    page.title = "runs"
    page.append([*sheet.header])
    for cell in page[1]:
        cell.font = Font(bold=True)
    changed = PatternFill("solid", start_color="DDDDDD")
    for number, row in enumerate(sheet.rows, 2):
        page.append([_number_or_text(cell) for cell in row.cells])
        for cell in page[number]:
            if isinstance(cell.value, str):
                cell.data_type = "s"  # also what looks like a formula
            if row.changes:
                cell.fill = changed
    for column, name in enumerate(sheet.header, 1):
        widest = max([len(name), *(len(row.cells[column - 1]) for row in sheet.rows)])
        page.column_dimensions[get_column_letter(column)].width = min(widest + 2, 60)
    page.freeze_panes = "A2"
    page.print_title_rows = "1:1"
    page.page_setup.orientation = "landscape"
    made = io.BytesIO()  # a full disk in the midst of it would leave openpyxl's file open
    book.save(made)
    path.write_bytes(made.getvalue())


def _number_or_text(cell: str) -> float | int | str:
    """A number as one, so that a spreadsheet can sort by it."""
    try:
        number = parse_number(cell)
    except ValueError:
        return "".join(sign for sign in cell if sign.isprintable() or sign in "\n\t")  # XML holds no others
    return int(number) if number.is_integer() else number
