"""What campaign.toml and the table of runs say, as plain content: written to a folder, and read
back the same.

A form, a proposal and a folder of files are three ways to have this content. It may be incomplete
or wrong: only the ingest judges it (`campaign_tables.read_campaign_tables`).
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...files.spreadsheet_guard import GuardedCsv
from ...files.toml_text import read_toml_text, toml_table
from .campaign_file import FILE as CAMPAIGN
from .runs_table import FILES
from .tables import read_table

RUNS = FILES[0]
#: Tables of campaign.toml in the order in which people read them.
_ORDER = ("campaign", "bench", "channels", "recordings", "force", "factors", "known")
#: Path of keys of campaign.toml -> what stands behind its value.
Remarks = Mapping[tuple[str, ...], str]


@dataclass(frozen=True)
class CampaignDescription:
    """`tables` are those of campaign.toml; `rows` of the table of runs have a text for each of
    `columns`. Keys without a value are left out of both files."""

    tables: Mapping[str, Any]
    columns: tuple[str, ...] = ()
    rows: tuple[Mapping[str, str], ...] = field(default_factory=tuple)

    def value(self, *keys: str) -> Any:
        """The value behind a path of keys.

        Parameters:
            keys: The path, such as "bench", "gun", "travel_m".

        Returns:
            The value as TOML has it; None where nothing is stated.
        """
        table: Any = self.tables
        for key in keys:
            if not isinstance(table, Mapping):
                return None
            table = table.get(key)
        return table

    def campaign_text(self, remarks: Remarks | None = None, missing: Remarks | None = None) -> str:
        """The text of campaign.toml.

        Parameters:
            remarks: What stands as a comment behind a value, by its path of keys; by default
                nothing.
            missing: Comments in the place of values that are missing, by their path of keys. A
                table that lacks all of its values consists of comments.
        """
        lines = list(_lines(self.tables, (), remarks or {}, missing or {}))
        return "\n".join(lines).strip("\n") + "\n"

    def runs_text(self) -> str:
        """The text of runs.csv: a header, and a line for each row."""
        text = io.StringIO(newline="")
        writer = GuardedCsv(text, line_end="\n")
        writer.write_row(self.columns)
        for row in self.rows:
            writer.write_row(row.get(column, "") for column in self.columns)
        return text.getvalue()

    def write(self, folder: Path) -> None:
        """Write both files into a folder, over earlier ones.

        Parameters:
            folder: The campaign folder, which exists.

        Raises:
            OSError: Where the folder cannot be written to.
        """
        (folder / CAMPAIGN).write_text(self.campaign_text(), encoding="utf-8", newline="")
        if self.columns:
            (folder / RUNS).write_text(self.runs_text(), encoding="utf-8", newline="")


def read_description(folder: Path) -> CampaignDescription:
    """What the two files of a folder say; a file that is missing says nothing.

    Parameters:
        folder: The campaign folder.

    Raises:
        ValueError: For a file that is no TOML, or no table.
    """
    tables: dict[str, Any] = {}
    if (folder / CAMPAIGN).is_file():
        tables = toml_table(read_toml_text(folder / CAMPAIGN))
    columns, rows = read_rows(folder)
    return CampaignDescription(tables, columns, rows)


def read_rows(folder: Path) -> tuple[tuple[str, ...], tuple[Mapping[str, str], ...]]:
    """Columns and rows of the folder's table of runs, of whatever content; none where there is no
    table.

    Parameters:
        folder: The campaign folder.

    Raises:
        IngestError: For a table that cannot be read as one.
    """
    for name in FILES:
        if (folder / name).is_file():
            header, lines = read_table(folder / name, name)
            return tuple(header), tuple(cells for _, cells in lines)
    return (), ()


def _lines(
    stated: Mapping[str, Any] | None, path: tuple[str, ...], remarks: Remarks, missing: Remarks
) -> Iterator[str]:
    """Values of a table with their comments, then the tables within; None of a table that is not
    stated, and has comments alone."""
    table = stated or {}
    nested = [key for key, value in table.items() if isinstance(value, Mapping)]
    own = [key for key in table if key not in nested]
    absent = [keys for keys in missing if keys[:-1] == path]
    if path and (own or absent or stated == {}):
        yield _header(path)
    for key in own:
        yield _line(key, table[key], remarks.get((*path, key), ""))
    for keys in absent:
        yield f"# {_key(keys[-1])} =    # {missing[keys]}"
    if own or absent:
        yield ""
    below = [*nested, *(keys[len(path)] for keys in missing if _is_below(keys, path))]
    names = dict.fromkeys(below)
    ordered = sorted(names, key=_place) if not path else names
    for key in ordered:
        if key not in own:
            yield from _lines(table.get(key), (*path, key), remarks, missing)


def _is_below(keys: tuple[str, ...], path: tuple[str, ...]) -> bool:
    return len(keys) > len(path) + 1 and keys[: len(path)] == path


def _place(key: str) -> int:
    return _ORDER.index(key) if key in _ORDER else len(_ORDER)


def _header(path: tuple[str, ...]) -> str:
    return f"[{'.'.join(_key(key) for key in path)}]"


def _key(key: str) -> str:
    import tomli_w

    if re.fullmatch(r"[A-Za-z0-9_-]+", key):
        return key
    return tomli_w.dumps({key: 0}).removesuffix(" = 0\n")


def _line(key: str, value: object, remark: str) -> str:
    import tomli_w

    # A list stands on one line: its values are few, and a comment follows.
    text = _inline(value) if isinstance(value, list | tuple) else ""
    line = f"{_key(key)} = {text}" if text else tomli_w.dumps({key: value}).rstrip("\n")
    return f"{line}  # {remark}" if remark else line


def _inline(value: object) -> str:
    import tomli_w

    if isinstance(value, list | tuple):
        return f"[{', '.join(_inline(part) for part in value)}]"
    return tomli_w.dumps({"a": value}).removeprefix("a = ").rstrip("\n")
