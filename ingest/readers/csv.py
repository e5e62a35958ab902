"""CSV as laboratories write it: any usual delimiter, decimal comma, units in the header, rate above the numbers."""

from __future__ import annotations

import re
from contextlib import ExitStack
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .base import RecordingError
from .contents import RATE_NAMES, RATE_UNITS, Contents, held, name_and_unit
from .csv_layout import Layout, sniff
from .recording import ArrayReader
from .text import read_text

if TYPE_CHECKING:
    import pandas as pd

_SPOKEN_RATES = frozenset({"sampling_frequency", "sample_frequency", "samplerate", "samplingrate", "sample_rate"})
_NUMBER_AND_UNIT = re.compile(r"([-+\d.,eE]+|nan|inf)\s*([A-Za-z/]*)")


class CsvReader(ArrayReader):
    """UTF-8 text. Every column comes back as float64: the text says no type. An empty field is NaN.

    A file cut at the end of a line cannot be told from a shorter one, unless it states `# samples = N`. One whose last
    line has no end may be cut inside its last number: editors leave it out, so the file is read, and its channels'
    header says `last_line_without_end`; a file that states its samples was written by a program, and is refused.
    """

    format = "csv"
    suffixes = (".csv", ".tsv", ".txt")

    def contents(self, path: Path, _: ExitStack) -> Contents:
        text = read_text(path, may_lack_last_end=True)
        whole = text.endswith("\n")
        text = text if whole else text + "\n"
        layout = sniff(path, text[: 1 << 18].split("\n")[:-1])
        table = _table(path, text, layout)
        _refuse_other_length(path, layout, len(table), whole)
        columns = zip(layout.names, layout.units, table.columns, strict=True)
        # A column without a name cannot be asked for: row numbers, or a delimiter at the end of every line.
        arrays = [held(name, table[column].to_numpy(), unit=unit) for name, unit, column in columns if name]
        doubt = {} if whole else {"last_line_without_end": True}
        return Contents(arrays, _stated_rate(path, layout), dict(layout.statements) | doubt)


def _table(path: Path, text: str, layout: Layout) -> pd.DataFrame:
    """The columns as float64, numbered. Raises `RecordingError` when a line has a field too few or too many."""
    import pandas as pd

    body = text.split("\n", layout.first)[layout.first]
    names = range(len(layout.names))
    table = pd.read_csv(
        StringIO(body),
        sep=layout.delimiter,
        decimal=layout.decimal,
        header=None,
        names=names,
        index_col=False,
        dtype=np.float64,
        float_precision="round_trip",
        skipinitialspace=True,
    )
    # pandas fills a short line with NaN, as if the file had said so.
    delimiters, expected = body.count(layout.delimiter), (len(names) - 1) * len(table)
    if delimiters != expected:
        raise RecordingError(
            f"{path.name}: {len(table)} lines of {len(names)} fields need {expected} delimiters, found {delimiters}; "
            "a line is cut or damaged"
        )
    return table


def _refuse_other_length(path: Path, layout: Layout, rows: int, whole: bool) -> None:
    stated = next((value for key, value in layout.statements.items() if key.lower() == "samples"), None)
    if stated is not None and not whole:
        raise RecordingError(f"{path.name}: its last line has no line end, so its last number may be cut")
    if stated is not None and stated != str(rows):
        raise RecordingError(f"{path.name}: states {stated} samples and holds {rows}; it is cut or damaged")


def _stated_rate(path: Path, layout: Layout) -> float | None:
    """The rate in hertz of a line such as `# fs = 51200`, `Sampling rate [kHz]: 51,2` or `fs;51200 Hz`."""
    for key, value in layout.statements.items():
        name, unit = name_and_unit(key)
        if re.sub(r"[\s-]+", "_", name.lower()) not in RATE_NAMES | _SPOKEN_RATES:
            continue
        match = _NUMBER_AND_UNIT.fullmatch(value)
        scale = RATE_UNITS.get(((match.group(2) if match else "") or unit or "").lower())
        try:
            number = float((match.group(1) if match else value).replace(layout.decimal, "."))
        except ValueError:
            number = np.nan
        if scale is None or np.isnan(number):
            raise RecordingError(f"{path.name}: {key!r} is {value!r}; expected a number in Hz, kHz or MHz")
        return number * scale
    return None
