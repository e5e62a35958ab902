"""Text as laboratories and instruments write it: any usual delimiter or blanks, decimal comma, units, rate above; also
CSV of Tektronix oscilloscopes, with settings above the columns, or, in the old form, beside them."""

from __future__ import annotations

import re
from contextlib import ExitStack
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .base import ReadingOptions, RecordingError, rate_from_step
from .contents import RATE_NAMES, RATE_UNITS, TIME_UNITS, Contents, in_memory, name_and_unit
from .recording import ArrayReader
from .text import BLANKS, Layout, read_text, sniff, split

if TYPE_CHECKING:
    import pandas as pd


_SETTINGS_COLUMNS = 3
_WHOLE = "0.0% to 100.0%"


def header_beside_samples(lines: list[str]) -> Layout | None:
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


_SPOKEN_RATES = frozenset(
    {"sampling_frequency", "sample_frequency", "samplerate", "samplingrate", "sample_rate", "samples_per_second"}
)
_SPOKEN_STEPS = frozenset(
    {"sample_interval", "sampling_interval", "sampling_period", "sample_period", "time_step", "dt", "delta_t"}
)
_NUMBER_AND_UNIT = re.compile(r"([-+\d.,eE]+|nan|inf)\s*([A-Za-zµμ/]*)")
#: What pandas reads as NaN.
_MISSING = re.compile(
    r"(?<!\S)(?:#N/A|#NA|-?1\.#IND|-?1\.#QNAN|<NA>|N/A|NA|NULL|None|n/a|null|[-+]?nan|[-+]?NaN|[-+]?NAN)(?!\S)"
)
#: A step printed with fewer digits than these is taken as it is.
_PRINTED_STEP = 5e-6


class CsvReader(ArrayReader):
    """UTF-8, UTF-16 or Windows-1252. Every column is float64: the text says no type. An empty field is NaN.

    A file cut at the end of a line cannot be told from a shorter one, unless it states `# samples = N`. One whose last
    line has no end may be cut inside its last number: editors leave it out, so the file is read, and its channels'
    header says `last_line_without_end`; a file that states its samples was written by a program, and is refused.
    """

    format = "csv"
    suffixes = (".csv", ".tsv", ".txt", ".dat", ".asc")

    def contents(self, path: Path, _: ExitStack, options: ReadingOptions) -> Contents:
        text = read_text(path, may_lack_last_end=True)
        text = text.replace("∞", "inf")  # PicoScope, of a voltage beyond its range
        whole = text.endswith("\n")
        text = text if whole else text + "\n"
        lines = text[: 1 << 18].split("\n")[:-1]
        layout = header_beside_samples(lines) or above(sniff(path, lines, options))
        contents = table_contents(path, text, layout)
        samples = contents.arrays[0].samples if contents.arrays else 0
        refuse_fewer(path, layout, samples)
        _refuse_other_length(path, layout, samples, whole)
        if not whole:
            contents.header["last_line_without_end"] = True
        return contents


def table_contents(path: Path, text: str, layout: Layout) -> Contents:
    """The named columns of a text, whose last line has an end, and what stands above them. Raises `RecordingError`."""
    table = _table(path, text, layout)
    columns = zip(layout.names, layout.units, strict=True)
    arrays = [in_memory(name, table[i].to_numpy(), unit=unit) for i, (name, unit) in enumerate(columns) if name]
    return Contents(arrays, _stated_rate(path, layout), dict(layout.statements))


def _table(path: Path, text: str, layout: Layout) -> pd.DataFrame:
    """The columns as float64, numbered. Raises `RecordingError` when a line has a field too few or too many."""
    import pandas as pd

    body = text.split("\n", layout.first)[layout.first]
    by_blanks = layout.delimiter == BLANKS
    names = range(len(layout.names))
    # Of a column that is left out pandas overlooks a field too many: only settings beside the numbers are left out.
    wanted = [i for i in names if layout.names[i]] if layout.settings_beside else None
    table = pd.read_csv(
        StringIO(body),
        sep=r"\s+" if by_blanks else layout.delimiter,
        decimal=layout.decimal,
        header=None,
        names=names,
        usecols=wanted,
        index_col=False,
        dtype=np.float64,
        float_precision="round_trip",
        skipinitialspace=True,
    )
    # pandas fills a short line with NaN, as if the file had said so.
    if by_blanks:
        _refuse_short_lines(path, body, table)
        return table
    delimiters, expected = body.count(layout.delimiter), (len(names) - 1) * len(table)
    if delimiters != expected:
        raise RecordingError(
            f"{path.name}: {len(table)} lines of {len(names)} fields need {expected} delimiters, found {delimiters}; "
            "a line is cut or damaged"
        )
    return table


def _refuse_short_lines(path: Path, body: str, table: pd.DataFrame) -> None:
    """Between blanks there is no empty field: every NaN must be written."""
    missing = int(table.isna().to_numpy().sum())
    written = len(_MISSING.findall(body)) if missing else 0
    if missing != written:
        raise RecordingError(
            f"{path.name}: {len(table)} lines of {table.shape[1]} fields lack {missing - written} numbers; "
            "a line is cut or damaged"
        )


def _refuse_other_length(path: Path, layout: Layout, rows: int, whole: bool) -> None:
    stated = next((value for key, value in layout.statements.items() if key.lower() == "samples"), None)
    if stated is not None and not whole:
        raise RecordingError(f"{path.name}: its last line has no line end, so its last number may be cut")
    if stated is not None and stated != str(rows):
        raise RecordingError(f"{path.name}: states {stated} samples and holds {rows}; it is cut or damaged")


def _stated_rate(path: Path, layout: Layout) -> float | None:
    """The rate in hertz of a line such as `# fs = 51200`, `Sampling rate [kHz]: 51,2` or `Sample Interval,4e-09`."""
    for key, value in layout.statements.items():
        name, unit = name_and_unit(key)
        spoken = re.sub(r"[\s-]+", "_", name.lower())
        is_step = spoken in _SPOKEN_STEPS
        if not is_step and spoken not in RATE_NAMES | _SPOKEN_RATES:
            continue
        match = _NUMBER_AND_UNIT.fullmatch(value)
        word = ((match.group(2) if match else "") or unit or ("s" if is_step else "")).lower()
        scale = TIME_UNITS.get(word) if is_step else RATE_UNITS.get(word)
        try:
            number = float((match.group(1) if match else value).replace(layout.decimal, "."))
        except ValueError:
            number = np.nan
        if scale is None or np.isnan(number) or (is_step and number <= 0.0):
            expected = "a step above 0 in s, ms, us or ns" if is_step else "a number in Hz, kHz or MHz"
            raise RecordingError(f"{path.name}: {key!r} is {value!r}; expected {expected}")
        return rate_from_step(number * scale, _precision(value)) if is_step else number * scale
    return None


def _precision(number: str) -> float:
    """Relative half of the last digit of a step of six digits or more; of fewer, 1e-9: it is meant exactly."""
    digits = len(re.sub(r"[eE].*|[^\d]", "", number).lstrip("0"))
    return _PRINTED_STEP if digits == 6 else 1e-9
