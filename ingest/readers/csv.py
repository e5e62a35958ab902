"""Text as laboratories and instruments write it: any usual delimiter or blanks, decimal comma,
thousands apart, units, rate or step above, time as numbers or as clock times; and what
oscilloscopes and recorders write, by the entries of `instruments`."""

from __future__ import annotations

import re
from contextlib import ExitStack
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ...files.number_notation import Notation
from .base import ReadingOptions, RecordingError
from .clock_times import elapsed_seconds, is_date_text
from .contents import Array, Contents, in_memory, is_unit
from .field_rules import FieldRule, harmless, used
from .file_fields import refuse_unread_fields
from .instrument_header import beside_layout, header_file_layout
from .instruments import SCREEN_FIELDS
from .recording import ArrayReader
from .text import read_text, sniff, tabulate, with_given_names
from .text_numbers import settled
from .text_rate import rate_fields, stated_rate
from .text_table import BLANKS, Layout

if TYPE_CHECKING:
    import pandas as pd

_WHOLE = "0.0% to 100.0%"
#: What pandas reads as NaN.
_MISSING = re.compile(
    r"(?<!\S)(?:#N/A|#NA|-?1\.#IND|-?1\.#QNAN|<NA>|N/A|NA|NULL|None|n/a|null|[-+]?nan|[-+]?NaN|"
    r"[-+]?NAN)(?!\S)"
)
#: A table of numbers alone, whose header is a file of its own.
_NUMBERS_ALONE = ".wfm.csv"
_TIME_SAYS = "the time column says when the samples were taken"
#: Of files that have a time column.
_TIMED = tuple(
    harmless(f"*{word}*", _TIME_SAYS) for word in ("trigger", "delay", "start", "t0", "x0")
)
_LONGEST_KEY = 5  # words
_UNIT_FIELDS = ("unit", "units", "vertical units", "y unit", "y units", "einheit")


class CsvReader(ArrayReader):
    """UTF-8, UTF-16 or Windows-1252. Every column is float64: the text says no type. An empty field
    is NaN.

    A file cut at the end of a line cannot be told from a shorter one, unless it states `# samples =
    N`. One whose last line has no end may be cut inside its last number: editors leave it out, so
    the file is read, and its channels' header says `last_line_without_end`; a file that states its
    samples was written by a program, and is refused.

    Clock times count from the first sample, whose time of day is `first_sample_at` in the header of
    the channels.
    """

    format = "csv"
    suffixes = (".csv", ".tsv", ".txt", ".dat", ".asc")
    fields: ClassVar[tuple[FieldRule, ...]] = (
        used(
            "fs, sample rate, sampling frequency and their like", "sampling rate, in Hz, kHz or MHz"
        ),
        used("dt, sample interval, sampling period and their like", "step, in s, ms, us or ns"),
        used("samples", "number of samples: another number of lines is refused"),
        used("unit", "unit of a single channel that has none"),
        harmless("*trigger*, *delay*, *start*, t0, x0", f"beside a time column: {_TIME_SAYS}"),
        *SCREEN_FIELDS,
    )

    def contents(self, path: Path, _: ExitStack, options: ReadingOptions) -> Contents:
        text = read_text(path, may_lack_last_end=True)
        text = text.replace("∞", "inf")  # PicoScope, of a voltage beyond its range
        whole = text.endswith("\n")
        text = text if whole else text + "\n"
        lines = text[: 1 << 18].split("\n")[:-1]
        layout = _layout(path, lines, options)
        contents = table_contents(path, text, layout)
        samples = contents.arrays[0].samples if contents.arrays else 0
        _refuse_counter(path, contents, options)
        _refuse_unread(path, layout, contents, options)
        _refuse_fewer(path, layout, samples, options)
        ends_empty = not layout.names[-1] and text.endswith(f"{layout.delimiter}\n")
        _refuse_other_length(path, layout, samples, whole or ends_empty)
        if not whole:
            contents.header["last_line_without_end"] = True
        return contents


def _layout(path: Path, lines: list[str], options: ReadingOptions) -> Layout:
    header = path.with_name(path.name[: -len(_NUMBERS_ALONE)] + path.suffix)
    if path.name.lower().endswith(_NUMBERS_ALONE) and (header.is_file() or not options.columns):
        if not header.is_file():
            raise RecordingError(
                f"{path.name}: line 1 ({lines[0][:40] if lines else ''!r}) holds numbers already; "
                f"the instrument writes names, units, rate and start into {header.name} beside it, "
                "which is not there; copy it here, or give columns and sampling_rate_hz under "
                "[recordings] in campaign.toml"
            )
        table = tabulate(path, lines, options)[0]
        return with_given_names(
            header_file_layout(path, read_text(header, may_lack_last_end=True), table), options
        )
    numbers = path.with_name(f"{path.stem}.Wfm{path.suffix}")
    try:
        return beside_layout(path, lines) or sniff(path, lines, options)
    except RecordingError as error:
        if numbers.is_file():
            raise RecordingError(
                f"{path.name}: is the header of {numbers.name}; read that file instead"
            ) from error
        raise


def table_contents(path: Path, text: str, layout: Layout) -> Contents:
    """The named columns of a text, whose last line has an end, and what stands above them. Raises
    `RecordingError`."""
    body = text.split("\n", layout.first)[layout.first]
    try:
        body, delimiter, decimal = settled(body, layout.delimiter, layout.decimal)
    except ValueError as error:
        raise RecordingError(f"{path.name}: {error}") from error
    table = _table(path, body, layout, delimiter, decimal)
    rate_hz = stated_rate(path, layout, Notation(decimal))
    header: dict[str, Any] = dict(layout.statements)
    arrays = [
        in_memory(name, table[i].to_numpy(), unit=unit)
        for i, (name, unit) in enumerate(zip(layout.names, layout.units, strict=True))
        if name and i not in layout.clocks
    ]
    if layout.clocks:
        header |= _first_clock(layout, table)
    if not any(array.is_time for array in arrays):
        times = _other_times(path, layout, table, rate_hz)
        if times is not None:
            arrays.append(in_memory("time", times, unit="s"))
        elif rate_hz is not None:
            arrays = [replace(array, rate_hz=rate_hz, start_s=layout.start_s) for array in arrays]
    return Contents(_with_stated_unit(arrays, layout), rate_hz, header)


def _other_times(
    path: Path, layout: Layout, table: pd.DataFrame, rate_hz: float | None
) -> NDArray[np.float64] | None:
    """Seconds (n,) from a column that counts samples, or from dates and times of day; None where
    there is neither."""
    if layout.counts_samples and rate_hz is not None:
        count = table[0].to_numpy()
        steps = np.flatnonzero(np.diff(count) != 1)
        if steps.size:
            raise RecordingError(
                f"{path.name}: its sequence number goes from {count[steps[0]]:g} to "
                f"{count[steps[0] + 1]:g}; expected steps of one; a line is missing or damaged"
            )
        return layout.start_s + count / rate_hz
    dates, clocks = _date_and_clock(layout, table)
    if clocks is None:
        return None
    try:
        return elapsed_seconds(clocks, dates)
    except ValueError as error:
        raise RecordingError(f"{path.name}: {error}") from error


def _date_and_clock(
    layout: Layout, table: pd.DataFrame
) -> tuple[list[str] | None, list[str] | None]:
    """The columns of dates and of times of day (with their date or without)."""
    columns: list[list[str]] = [table[i].tolist() for i in layout.clocks]
    dates = next((column for column in columns if is_date_text(str(column[0]).strip())), None)
    return dates, next((column for column in columns if column is not dates), None)


def _first_clock(layout: Layout, table: pd.DataFrame) -> dict[str, str]:
    return {
        "first_sample_at": " ".join(
            str(column[0]).strip() for column in _date_and_clock(layout, table) if column
        )
    }


def _with_stated_unit(arrays: list[Array], layout: Layout) -> list[Array]:
    """The unit that a line above states, for the only channel, where it has none."""
    stated = next(
        (
            v
            for key, v in layout.statements.items()
            if key.lower() in _UNIT_FIELDS and isinstance(v, str)
        ),
        "",
    )
    channels = [array for array in arrays if not array.is_time and not array.is_rate]
    if len(channels) != 1 or channels[0].unit or not is_unit(stated):
        return arrays
    return [replace(array, unit=stated) if array is channels[0] else array for array in arrays]


def _table(path: Path, body: str, layout: Layout, delimiter: str, decimal: str) -> pd.DataFrame:
    """The columns as float64, numbered. Raises `RecordingError` when a line has a field too few or
    too many."""
    import pandas as pd

    by_blanks = delimiter == BLANKS
    body = _without_empty_end(body, delimiter)
    names = range(len(layout.names))
    # Of a column that is left out pandas overlooks a field too many: only settings beside the
    # numbers are left out.
    wanted = [i for i in names if layout.names[i]] if layout.settings_beside else None
    kinds: Any = (
        {i: str if i in layout.clocks else np.float64 for i in names}
        if layout.clocks
        else np.float64
    )
    table = pd.read_csv(
        StringIO(body),
        sep=r"\s+" if by_blanks else delimiter,
        decimal=decimal,
        header=None,
        names=names,
        usecols=wanted,
        index_col=False,
        dtype=kinds,
        float_precision="round_trip",
        skipinitialspace=True,
    )
    # pandas fills a short line with NaN, as if the file had said so.
    if by_blanks:
        _refuse_short_lines(path, body, table)
        return table
    delimiters, expected = body.count(delimiter), (len(names) - 1) * len(table)
    if delimiters != expected:
        raise RecordingError(
            f"{path.name}: {len(table)} lines of {len(names)} fields need {expected} delimiters, "
            f"found {delimiters}; a line is cut or damaged"
        )
    return table


def _without_empty_end(body: str, delimiter: str) -> str:
    """Without lines at the end that hold delimiters alone."""
    end = body.rstrip("\n" + delimiter + " ")
    return body[: body.find("\n", len(end)) + 1] if body.count("\n", len(end)) > 1 else body


def _refuse_short_lines(path: Path, body: str, table: pd.DataFrame) -> None:
    """Between blanks there is no empty field: every NaN must be written."""
    missing = int(table.isna().to_numpy().sum())
    written = len(_MISSING.findall(body)) if missing else 0
    if missing != written:
        raise RecordingError(
            f"{path.name}: {len(table)} lines of {table.shape[1]} fields lack {missing - written} "
            "numbers; a line is cut or damaged"
        )


def _refuse_counter(path: Path, contents: Contents, options: ReadingOptions) -> None:
    """Raise `RecordingError` where the laboratory calls a column time that counts samples."""
    for array in contents.arrays if options.columns else ():
        if array.is_time and array.name in options.columns and array.samples > 1:
            values = array.take(0, array.samples)
            if np.all(values == values[0] + np.arange(values.size)):
                raise RecordingError(
                    f"{path.name}: columns calls {array.name!r} what counts {values[0]:g}, "
                    f'{values[1]:g} and on, which as seconds is 1 Hz; name that column "" and give '
                    f'sampling_rate_hz under [recordings] in campaign.toml, or write "{array.name} '
                    '[s]" where it is seconds'
                )


def _refuse_unread(path: Path, layout: Layout, contents: Contents, options: ReadingOptions) -> None:
    timed = any(array.is_time for array in contents.arrays)
    units = {array.unit for array in contents.arrays if not array.is_time and not array.is_rate}
    unit = next(iter(units)) if len(units) == 1 else None
    rules = (*layout.rules, *(_TIMED if timed else ()), *SCREEN_FIELDS)
    rates = rate_fields(layout)
    # a key of many words is a sentence with a colon in it
    fields = {
        key: value
        for key, value in layout.statements.items()
        if key not in rates and len(key.split()) <= _LONGEST_KEY
    }
    refuse_unread_fields(
        path, rules, fields, "the file", options, unit=unit, rate_hz=contents.rate_hz
    )


def _refuse_fewer(path: Path, layout: Layout, samples: int, options: ReadingOptions) -> None:
    """Raise `RecordingError` where a whole record has fewer lines than its header states: the file
    is cut."""
    if (
        layout.statements.get("Gating", _WHOLE) != _WHOLE
        or layout.length in options.harmless_fields
    ):
        return
    if layout.samples is not None and samples < layout.samples:
        raise RecordingError(
            f"{path.name}: states a {layout.length} of {layout.samples:g} and "
            f"holds {samples} lines; it is cut"
        )


def _refuse_other_length(path: Path, layout: Layout, rows: int, whole: bool) -> None:
    stated = next(
        (value for key, value in layout.statements.items() if key.lower() == "samples"), None
    )
    if (stated is not None or layout.samples) and not whole:
        raise RecordingError(
            f"{path.name}: its last line has no line end, so its last number may be cut"
        )
    if stated is not None and stated != str(rows):
        raise RecordingError(
            f"{path.name}: states {stated} samples and holds {rows}; it is cut or damaged"
        )
