"""CSV of Tektronix oscilloscopes: settings above the columns, or, in the old form, beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from .base import RecordingError
from .csv_layout import Layout, split

_SETTINGS_COLUMNS = 3
_WHOLE = "0.0% to 100.0%"


def beside(lines: list[str]) -> Layout | None:
    """The old form, of one channel: `Record Length,2500,Points,-0.0005,0.02` and so on; None for any other file.

    Settings stand in the first three columns, time in seconds and the channel in the next two.
    """
    rows = [split(line, ",") for line in lines[:40]]
    if not rows or rows[0][:1] != ["Record Length"] or len(rows[0]) < _SETTINGS_COLUMNS + 2:
        return None
    settings = {row[0]: row[1] for row in rows if len(row) > 1 and row[0]}
    extra = len(rows[0]) - _SETTINGS_COLUMNS - 2
    names = ["", "", "", "time", settings.get("Source") or "CH1", *[""] * extra]
    units = [None, None, None, settings.get("Horizontal Units"), settings.get("Vertical Units"), *[None] * extra]
    return Layout(",", ".", 0, names, units, settings, settings_beside=True)


def above(layout: Layout) -> Layout:
    """The newer form: units and the step of the columns from the lines above them; any other file as it is."""
    rows = {row[0]: row for row in layout.above if row and row[0]}
    if "Sample Interval" not in rows or not any(name.upper() == "TIME" for name in layout.names):
        return layout
    width = len(layout.names)
    vertical = [*rows.get("Vertical Units", []), *[""] * width][:width]
    time_unit = ([*rows.get("Horizontal Units", []), "", ""])[1]
    units = [
        own or ((time_unit if name.upper() == "TIME" else unit) or None)
        for name, own, unit in zip(layout.names, layout.units, vertical, strict=True)
    ]
    settings = {key: row[1] for key, row in rows.items() if len(row) > 1 and row[1]}
    return replace(layout, units=units, statements=layout.statements | settings)


def refuse_fewer(path: Path, layout: Layout, samples: int) -> None:
    """Raise `RecordingError` where a whole record has fewer lines than its `Record Length`: the file is cut."""
    stated = layout.statements.get("Record Length")
    if stated is None or layout.statements.get("Gating", _WHOLE) != _WHOLE:
        return
    try:
        length = float(stated)
    except ValueError:
        return
    if samples < length:
        raise RecordingError(f"{path.name}: states a Record Length of {length:g} and holds {samples} lines; it is cut")
