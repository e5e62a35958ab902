"""What the header of a text says by the entry of its instrument: names, units, step, start, number
of samples."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ...files.delimited_text import parse_number
from .base import RecordingError
from .contents import TIME_UNITS, name_and_unit
from .instruments import HEADER_FILE, INSTRUMENTS, SEQUENCE, TIME, Instrument
from .text_table import BLANKS, COMMENT, STATEMENT, Layout, TextTable, split

Fields = dict[str, str | list[str]]

_BESIDE_COLUMNS = 3
#: Words of instruments -> unit; None where they only say that there is a value.
_UNIT_WORDS: dict[str, str | None] = {
    **dict.fromkeys(("volt", "volts"), "V"),
    **dict.fromkeys(("ampere", "amperes", "amp", "amps"), "A"),
    **dict.fromkeys(("watt", "watts"), "W"),
    **dict.fromkeys(("", "-", "value", "unknown", "sequence", "ampl", "amplitude", "u"), None),
}
#: `CH1:1.00`, `Analog:7000`.
_PREFIXED = re.compile(r"(CH\d+|C\d+|D\d+|Analog|Digital)\s*:\s*(.*)", re.IGNORECASE)
_NUMBER = re.compile(r"[-+]?[\d.,]+(?:[eE][-+]?\d+)?")


def recognised(rows: Sequence[Sequence[str]]) -> Instrument | None:
    """The instrument whose signs all stand in these lines."""
    cells = [
        cell.rstrip(" =:") if not STATEMENT.fullmatch(cell) else cell
        for row in rows
        for cell in row
        if cell
    ]
    for instrument in INSTRUMENTS:
        if not instrument.beside and all(
            any(_is(sign, cell) for cell in cells) for sign in instrument.signs
        ):
            return instrument
    return None


def header_fields(
    lines: Sequence[str], table: TextTable, heading: Sequence[Sequence[str]] = ()
) -> Fields:
    """`# fs = 51200`, `fs: 51200`, `fs;51200` and `fs;51200;51200` in the lines above the numbers
    but `heading`."""
    fields: Fields = {}
    titles = table.titles
    for line, row in zip(lines, table.rows, strict=False):
        cells = [cell for cell in row if cell]
        match = STATEMENT.fullmatch(COMMENT.sub("", line, count=1).strip())
        if match is not None and (len(cells) < 2 or table.delimiter == BLANKS):
            fields[match.group(1).strip()] = (
                match.group(2).strip().rstrip(table.delimiter).lstrip(",;\t")
            )
        elif len(cells) > 1 and row[0] and row not in heading and row not in titles:
            fields |= _fields_of_row(cells)
    return fields


def _fields_of_row(cells: Sequence[str]) -> Fields:
    """`Segments,1,SegmentSize,2000` is two fields; otherwise the first cell is the key of the
    others."""
    keys, values = cells[::2], cells[1::2]
    if (
        len(keys) == len(values)
        and not any(map(_NUMBER.fullmatch, keys))
        and all(map(_NUMBER.fullmatch, values))
    ):
        return {key.rstrip(" =:"): value for key, value in zip(keys, values, strict=True)}
    return {cells[0].rstrip(" =:"): _values(cells)}


def layout_of(
    path: Path, instrument: Instrument, table: TextTable, decimal: str | None = None
) -> Layout:
    """By the entry of the instrument. Raises `RecordingError` naming the field that is not
    understood."""
    above = table.rows[: table.first]
    units_lines = [line for key in instrument.units if (line := _line(above, key)) is not None]
    heading = _line(above, instrument.heading)
    if heading is None and not instrument.names and units_lines and units_lines[0] > 0:
        heading = units_lines[0] - 1
    used_lines = [above[i] for i in (heading, *units_lines[:1]) if i is not None]
    fields = header_fields(table.lines[: table.first], table, used_lines)
    if heading is not None:
        fields |= _in_heading(
            above[heading], above[heading + 1] if heading + 1 < len(above) else []
        )
    names = _names(instrument, above, heading, table)
    units: list[str | None] = [None] * table.columns
    for line in units_lines:
        units = [
            unit or _unit(label)
            for unit, label in zip(units, _aligned(above[line], table), strict=True)
        ]
    if not units_lines:
        units = [
            _unit(next((_first(fields[key]) for key in instrument.units if key in fields), ""))
        ] * table.columns
    if not units_lines and heading is not None and table.titles and table.titles[-1] != names:
        units = [_unit(label) for label in table.titles[-1]]
    keys = [unit for unit in units if unit and any(_is(key, unit) for key in instrument.units)]
    units = [None if unit in keys and unit.lower() not in TIME_UNITS else unit for unit in units]
    labelled = [_labelled(instrument, name, unit) for name, unit in zip(names, units, strict=True)]
    if instrument.first:
        unit = units[0] or labelled[0][1]
        is_time = instrument.first == TIME
        labelled[0] = (
            ("time", unit if unit and unit.lower() in TIME_UNITS else "s")
            if is_time
            else ("", None)
        )
    time_unit = _first(fields.get(instrument.time_unit, "")) or None
    columns = [
        (name, time_unit if time_unit and _is("TIME", name) else unit) for name, unit in labelled
    ]
    return Layout(
        table.delimiter,
        decimal,
        table.first,
        [name for name, _ in columns],
        [unit for _, unit in columns],
        fields,
        above,
        clocks=table.clocks,
        counts_samples=instrument.first == SEQUENCE,
        step=instrument.step,
        rate=instrument.rate,
        time_unit=time_unit,
        start_s=_number(path, instrument.start, fields, _seconds(time_unit)) or 0.0,
        length=instrument.samples,
        samples=_number(path, instrument.samples, fields),
        rules=instrument.rules,
    )


def beside_layout(path: Path, lines: Sequence[str]) -> Layout | None:
    """Settings in the first three columns, time and one channel in the next two, as the first line
    shows; else None."""
    rows = [split(line, ",") for line in lines[:40]]
    top = rows[0] if rows else []
    instrument = next(
        (i for i in INSTRUMENTS if i.beside and top and _is(i.signs[0], top[0])), None
    )
    if (
        instrument is None
        or len(top) < _BESIDE_COLUMNS + 2
        or not _NUMBER.fullmatch(top[_BESIDE_COLUMNS])
    ):
        return None
    fields: Fields = {row[0]: row[1] for row in rows if len(row) > 1 and row[0]}
    rest = [""] * (len(top) - _BESIDE_COLUMNS - 2)
    settings = [""] * _BESIDE_COLUMNS
    units = [
        *settings,
        *(_first(fields.get(key, "")) for key in (instrument.time_unit, instrument.units[0])),
        *rest,
    ]
    return Layout(
        ",",
        None,
        0,
        [*settings, "time", _first(fields.get(instrument.names[0], "")) or "CH1", *rest],
        [unit or None for unit in units],
        fields,
        settings_beside=True,
        step=instrument.step,
        length=instrument.samples,
        samples=_number(path, instrument.samples, fields),
        rules=instrument.rules,
    )


def header_file_layout(path: Path, header: str, table: TextTable) -> Layout:
    """Names, unit, step and start from the file that stands beside the numbers, `Key:Value:` a
    line."""
    fields: Fields = {}
    for line in header.splitlines():
        key, *values = line.strip().rstrip(",:").split(":")
        if key and values:
            fields[key] = values[0] if len(values) == 1 else values
    width = table.columns - table.empty_at_end
    timed = _first(fields.get("TimestampState", "")).lower() == "on"
    names = next((_list(fields[key]) for key in HEADER_FILE.names if key in fields), [])
    channels = width - timed
    if len(names) != channels:
        names = [f"CH{number + 1}" for number in range(channels)]
    unit = _first(fields.get(HEADER_FILE.units[0], "")) or None
    empty = table.empty_at_end
    return Layout(
        table.delimiter,
        None,
        table.first,
        [*(["time"] if timed else []), *names, *[""] * empty],
        [*(["s"] if timed else []), *[unit] * channels, *[None] * empty],
        fields,
        step=HEADER_FILE.step,
        start_s=_number(path, HEADER_FILE.start, fields) or 0.0,
        length=HEADER_FILE.samples,
        samples=_number(path, HEADER_FILE.samples, fields),
        rules=HEADER_FILE.rules,
    )


def _is(pattern: str, cell: str) -> bool:
    return re.fullmatch(pattern, cell, re.IGNORECASE) is not None


def _line(rows: Sequence[Sequence[str]], pattern: str) -> int | None:
    """The last line whose first cell is this."""
    lines = [
        i for i, row in enumerate(rows) if pattern and row and _is(pattern, row[0].rstrip(" =:"))
    ]
    return lines[-1] if lines else None


def _values(row: Sequence[str]) -> str | list[str]:
    """The values of a line behind its key: one where all are the same, a list of numbers that
    differ, else a text."""
    values = [
        match.group(2) if (match := _PREFIXED.fullmatch(cell)) else cell for cell in row[1:] if cell
    ]
    values = [value for value in values if value != row[0]]
    if values and all(map(_NUMBER.fullmatch, values)) and len(set(values)) > 1:
        return values
    return ", ".join(dict.fromkeys(values))


def _assigns(instrument: Instrument, cell: str) -> bool:
    """Whether a cell of the heading is no name but `tInc = 1e-5`."""
    match = STATEMENT.fullmatch(cell)
    return match is not None and match.group(1) in (instrument.start, instrument.step)


def _in_heading(heading: Sequence[str], below: Sequence[str]) -> Fields:
    """`tInc = 1e-5` among the names, and numbers below the names."""
    fields: Fields = {}
    for cell in heading:
        match = STATEMENT.fullmatch(cell)
        if match is not None:
            fields[match.group(1)] = match.group(2)
    for name, value in zip(heading, below, strict=False):
        if name and _NUMBER.fullmatch(value):
            fields[name] = value
    return fields


def _names(
    instrument: Instrument, above: Sequence[list[str]], heading: int | None, table: TextTable
) -> list[str]:
    if heading is not None:
        width = table.columns - table.empty_at_end
        names = ["" if _assigns(instrument, name) else name for name in above[heading][:width]]
        return [*names, *[""] * table.columns][: table.columns]
    for key in instrument.names:
        line = _line(above, key)
        if line is None:
            continue
        row = [m.group(1) if (m := _PREFIXED.fullmatch(cell)) else cell for cell in above[line]]
        names = _aligned(row, table)
        keyed = names[0] == row[0] and not instrument.first
        return ["", *names[1:]] if keyed else names
    width = table.columns - table.empty_at_end
    numbers = range(0 if instrument.first else 1, table.columns + 1)
    return [
        f"CH{number}" if i < width else ""
        for i, number in zip(range(table.columns), numbers, strict=False)
    ]


def _aligned(row: Sequence[str], table: TextTable) -> list[str]:
    """The cells of a line above the columns; without its key where it has one cell more than there
    are columns."""
    cells = [match.group(2) if (match := _PREFIXED.fullmatch(cell)) else cell for cell in row]
    while cells and not cells[-1]:
        cells.pop()
    width = table.columns - table.empty_at_end
    return [*(cells[1:] if len(cells) == width + 1 else cells)[:width], *[""] * table.columns][
        : table.columns
    ]


def _labelled(instrument: Instrument, name: str, unit: str | None) -> tuple[str, str | None]:
    match = re.fullmatch(instrument.label, name) if instrument.label else None
    if match is not None:
        return match.group("name"), _unit(match.group("unit")) or unit
    bare, own = name_and_unit(name)
    return bare, unit or own


def _unit(text: str) -> str | None:
    inner = text[text.rfind("(") + 1 : -1] if text.endswith(")") and "(" in text else text
    word = inner.strip("[]() ")
    return _UNIT_WORDS.get(word.lower(), word) or None


def _first(value: str | list[str]) -> str:
    return value if isinstance(value, str) else (value[0] if value else "")


def _list(value: str | list[str]) -> list[str]:
    return [value] if isinstance(value, str) else value


def _seconds(unit: str | None) -> float:
    return TIME_UNITS.get((unit or "s").lower(), 1.0)


def _number(path: Path, name: str, fields: Fields, scale: float = 1.0) -> float | None:
    """A field's number; None where the file does not have it. Raises `RecordingError` where it is
    no single number."""
    value = fields.get(name)
    if not name or value is None:
        return None
    if isinstance(value, str):
        try:
            return parse_number(value) * scale
        except ValueError:
            pass
    raise RecordingError(f"{path.name}: {name} is {value!r}; expected one number for all channels")
