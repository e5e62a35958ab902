"""The run sheet: a plan in order of run, for the wall of the laboratory, with a box for each
repetition of a run."""

from __future__ import annotations

import html
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..files.atomic_write import atomic_file
from ..files.delimited_text import parse_number
from ..files.spreadsheet_guard import GuardedCsv
from .plans import StoredPlan, StoredRun
from .space import Space

#: Predicted quantities: column of the sheet, and the factor from SI to its unit.
_EXPECTED = {
    "velocity_m_s": ("expected_velocity_m_s", 1.0),
    "contact_time_s": ("expected_contact_time_ms", 1e3),
    "peak_force_n": ("expected_peak_force_kn", 1e-3),
}
TICK, TICKED, REPEAT, CROSS = "☐", "☑", "↻", "✗"
#: Endings of columns, the longest first, and the units that they stand for.
_UNITS = {
    "_m_s": "m/s",
    "_bar": "bar",
    "_mm": "mm",
    "_kg": "kg",
    "_ms": "ms",
    "_kn": "kN",
    "_pa": "Pa",
    "_g": "g",
    "_m": "m",
}


@dataclass(frozen=True)
class SheetRow:
    """A run as a person reads it.

    `changes` names what has to be rebuilt before it; `differs` says of each cell whether it is a
    setting that differs from the run before.
    """

    cells: tuple[str, ...]
    changes: tuple[str, ...]
    status: str
    differs: tuple[bool, ...]


@dataclass(frozen=True)
class Sheet:
    """The table of a plan: the same content for every format. `labels` are the words and units of
    the `header`."""

    title: str
    subtitle: str
    header: tuple[str, ...]
    labels: tuple[str, ...]
    rows: tuple[SheetRow, ...]
    #: How many columns behind the settings say what is expected, with 90 % bands.
    expected: int = 0

    @property
    def setting_labels(self) -> tuple[str, ...]:
        """Label with unit of each setting."""
        return self.labels[self._settings]

    @property
    def _settings(self) -> slice:
        return slice(2, len(self.header) - 4 - self.expected)

    def settings_of(self, row: SheetRow) -> list[tuple[str, str, bool]]:
        """Label, value ("–" where the run has none), and whether it differs from the run before, of
        each setting.

        Parameters:
            row: A row of this sheet.
        """
        cells = (cell or "–" for cell in row.cells[self._settings])
        return list(zip(self.setting_labels, cells, row.differs[self._settings], strict=True))

    def expected_of(self, row: SheetRow) -> list[tuple[str, str]]:
        """Label, and median with 90 % band, of each quantity that was predicted of a run.

        Parameters:
            row: A row of this sheet.
        """
        place = slice(len(self.header) - 4 - self.expected, len(self.header) - 4)
        return [
            (label, cell)
            for label, cell in zip(self.labels[place], row.cells[place], strict=True)
            if cell
        ]


def sheet_of(plan: StoredPlan) -> Sheet:
    """The sheet of a stored plan; discarded runs stay on it, crossed out.

    Parameters:
        plan: The plan as it stands, with its runs in order of position.
    """
    settings = tuple(dict.fromkeys(key for run in plan.runs for key in run.settings))
    predicted = [name for name in _EXPECTED if any(name in run.expected for run in plan.runs)]
    header = (
        "order",
        "run",
        *plan.space.columns,
        *settings,
        *(_EXPECTED[name][0] for name in predicted),
        "repetitions",
        "set-up change",
        "done",
        "remarks",
    )
    rows = []
    before: StoredRun | None = None
    for run in plan.runs:
        changes = _changes(plan.space, before, run)
        cells = _cells(plan.space, settings, predicted, run, changes)
        rows.append(
            SheetRow(
                cells, changes, run.status, _differs(plan.space, settings, before, run, len(cells))
            )
        )
        if run.status != "discarded":
            before = run
    active = [run for run in plan.runs if run.status != "discarded"]
    shots = sum(run.repetitions for run in active)
    seed = "" if plan.seed is None else f", seed {plan.seed}"
    return Sheet(
        f"Plan {plan.name}",
        f"{len(active)} runs, {shots} repetitions; {plan.method}{seed}",
        header,
        tuple(map(column_label, header)),
        tuple(rows),
        len(predicted),
    )


def column_label(column: str) -> str:
    """The words and the unit of a column: `tip_radius_mm` -> `tip radius (mm)`.

    Parameters:
        column: The name of the column in a plan's table.
    """
    for ending, unit in _UNITS.items():
        if column.endswith(ending) and len(column) > len(ending):
            return f"{column.removesuffix(ending).replace('_', ' ')} ({unit})"
    return column.replace("_", " ")


def boxes(run: StoredRun) -> str:
    """A box for each repetition, ticked where it is recorded, with an arrow where it is rejected
    and to be repeated.

    A cross for a run that was discarded.

    Parameters:
        run: A run of a stored plan.
    """
    if run.status == "discarded":
        return CROSS
    numbered = [
        *((number, TICKED) for number in run.accepted),
        *((number, REPEAT) for number in run.rejected),
    ]
    marks = [mark for _, mark in sorted(numbered)]
    while REPEAT in marks and marks.count(TICKED) + marks.count(REPEAT) > run.repetitions:
        marks.remove(REPEAT)  # a further repetition has taken its place
    return "".join(marks[: run.repetitions]).ljust(run.repetitions, TICK)


def _expected(run: StoredRun, quantity: str) -> str:
    """`5.62 (4.9–6.3)`: the median with its 90 % band; empty for a run without a prediction."""
    band = run.expected.get(quantity)
    if band is None:
        return ""
    median, lower, upper = (_three_digits(_EXPECTED[quantity][1] * value) for value in band)
    return f"{median} ({lower}–{upper})"


def _three_digits(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _differs(
    space: Space, settings: Sequence[str], before: StoredRun | None, run: StoredRun, cells: int
) -> tuple[bool, ...]:
    """Of each cell of a row, whether it is a setting that has changed since the run before; of the
    first run, none."""
    if before is None:
        return (False,) * cells
    factors = [run.row[column] != before.row[column] for column in space.columns]
    numbers = [run.settings.get(key) != before.settings.get(key) for key in settings]
    changed = [False, False, *factors, *numbers]
    return (*changed, *(False,) * (cells - len(changed)))


def write_sheet(plan: StoredPlan, path: Path) -> None:
    """Write the sheet of a plan as a file.

    Parameters:
        plan: The plan as it stands.
        path: The file, which becomes printable HTML, CSV or XLSX by its suffix.

    Raises:
        ValueError: For another suffix.
    """
    writers: dict[str, Callable[[Sheet, Path], None]] = {
        ".html": _write_html,
        ".htm": _write_html,
        ".csv": _write_csv,
        ".xlsx": _write_xlsx,
    }
    writer = writers.get(path.suffix.lower())
    if writer is None:
        raise ValueError(
            f"{path.name}: no sheet of format "
            f"{path.suffix or 'without suffix'!r}; known: .html, .csv, .xlsx"
        )
    with atomic_file(path) as partial:
        writer(sheet_of(plan), partial)


def _changes(space: Space, before: StoredRun | None, run: StoredRun) -> tuple[str, ...]:
    """Factors that take work to change and differ from the run before, the heaviest first."""
    heavy = sorted((f for f in space.factors if f.change > 0), key=lambda f: -f.change)
    changed = [
        f.column for f in heavy if before is None or run.row[f.column] != before.row[f.column]
    ]
    return tuple(f"{column_label(column)}: {run.row[column]}" for column in changed)


def _cells(
    space: Space,
    settings: Sequence[str],
    predicted: Sequence[str],
    run: StoredRun,
    changes: Sequence[str],
) -> tuple[str, ...]:
    numbers = [f"{run.settings[key]:.4g}" if key in run.settings else "" for key in settings]
    remarks = "; ".join(words for words in (run.state if run.repeats else "", run.reason) if words)
    return (
        str(run.position),
        str(run.run),
        *(run.row[column] for column in space.columns),
        *numbers,
        *(_expected(run, name) for name in predicted),
        str(run.repetitions),
        "; ".join(changes),
        boxes(run),
        remarks,
    )


def sheet_text(plan: StoredPlan) -> str:
    """The sheet of a plan as CSV.

    Parameters:
        plan: The plan as it stands.
    """
    return _csv_text(sheet_of(plan))


def _csv_text(sheet: Sheet) -> str:
    text = io.StringIO()
    writer = GuardedCsv(text)
    writer.write_row(sheet.header)
    writer.write_rows(row.cells for row in sheet.rows)
    return text.getvalue()


def _write_csv(sheet: Sheet, path: Path) -> None:
    path.write_bytes(
        _csv_text(sheet).encode("utf-8-sig")
    )  # the mark tells spreadsheets that it is UTF-8


_STYLE = """
body { font: 11pt sans-serif; margin: 1.5em; }
table { border-collapse: collapse; width: 100%; }
th, td { border: 1px solid #888; padding: 0.25em 0.5em; text-align: left; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
tr.change td { border-top: 3px solid #222; }
td.differs { font-weight: bold; }
p.fields span { display: inline-block; border-bottom: 1px solid #222; min-width: 14em;
  margin: 0 2em 0 0.5em; }
tr.discarded td { text-decoration: line-through; color: #777; }
td.done { text-align: center; font-size: 14pt; letter-spacing: 0.1em; min-width: 7em; }
td.remarks { min-width: 10em; }
@page { size: A4 landscape; margin: 1cm; }
@media print { body { margin: 0; font-size: 9pt; } }
"""


def _write_html(sheet: Sheet, path: Path) -> None:
    head = "".join(f"<th>{html.escape(label)}</th>" for label in sheet.labels)
    body = "\n".join(_html_row(sheet.header, row) for row in sheet.rows)
    hint = (
        "Bold settings differ from the run before; a thick line above a run is a set-up change. "
        f"{REPEAT} is a repetition that is rejected: record it again."
    )
    if sheet.expected:
        hint += " Expected values are medians with 90 % bands, predicted before the shot."
    fields = "<p class='fields'>Operator <span>&nbsp;</span> Date <span>&nbsp;</span></p>"
    path.write_text(
        "<!doctype html>\n<html lang='en'><head><meta charset='utf-8'>"
        "<meta http-equiv='Content-Security-Policy' content=\"default-src "
        "'none'; style-src 'unsafe-inline'; "
        "form-action 'none'; base-uri 'none'\">"  # it asks for nothing, whatever names it holds
        f"<title>{html.escape(sheet.title)}</title>"
        f"<style>{_STYLE}</style></head>\n<body><h1>{html.escape(sheet.title)}</h1>"
        f"<p>{html.escape(sheet.subtitle)}. "
        f"{hint}</p>\n{fields}\n<table><thead><tr>{head}</tr></thead>\n<tbody>\n"
        f"{body}\n</tbody></table></body></html>\n",
        encoding="utf-8",
    )


def _html_row(header: Sequence[str], row: SheetRow) -> str:
    classes = " ".join([row.status, *(["change"] if row.changes else [])])
    cells = "".join(
        f"<td class='{html.escape(name.replace(' ', '-'))}{' differs' if differs else ''}'>"
        f"{html.escape(cell)}</td>"
        for name, cell, differs in zip(header, row.cells, row.differs, strict=True)
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
            if row.differs[cell.column - 1]:
                cell.font = Font(bold=True)
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
        return "".join(
            sign for sign in cell if sign.isprintable() or sign in "\n\t"
        )  # XML holds no others
    return int(number) if number.is_integer() else number
