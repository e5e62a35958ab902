"""The rows that are kept: what became of each mutant that was tried, at first and now."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path


@dataclass(frozen=True)
class Row:
    """A mutant (its first five fields name it), and its trials."""

    module: str
    definition: str
    before: str
    after: str
    nth: int
    line: int
    operator: str
    at_first: str  # survived, killed, timed out
    now: str
    by: str  # the test that killed it
    date: str  # of the last trial
    of: int  # mutants of the module at that time

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        return self.module, self.definition, self.before, self.after, self.nth


class Rows:
    """Rows in a CSV file, in the order of modules and lines."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows: dict[tuple[str, str, str, str, int], Row] = {}
        if path.exists():
            with path.open(encoding="utf-8", newline="") as file:
                read = [_row(values) for values in csv.DictReader(file)]
            self._rows = {row.key: row for row in read}

    def __iter__(self) -> Iterator[Row]:
        return iter(
            sorted(self._rows.values(), key=lambda row: (row.module, row.line, row.after, row.nth))
        )

    def find(self, key: tuple[str, str, str, str, int]) -> Row | None:
        return self._rows.get(key)

    def add(self, row: Row) -> None:
        """A trial; what a mutant did at first stays."""
        known = self._rows.get(row.key)
        self._rows[row.key] = replace(row, at_first=known.at_first) if known else row

    def keep_only(self, module: str, holds: Callable[[str], bool], of: int) -> None:
        """Drops a module's rows whose line its source no longer has; the others are of so many
        mutants."""
        here = {key: row for key, row in self._rows.items() if row.module == module}
        kept = {key: replace(row, of=of) for key, row in here.items() if holds(row.before)}
        self._rows = {key: row for key, row in self._rows.items() if key not in here} | kept

    def write(self) -> None:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        partly = self.path.with_suffix(".part")
        with partly.open("w", encoding="utf-8", newline="") as file:
            table = csv.DictWriter(file, [each.name for each in fields(Row)], lineterminator="\n")
            table.writeheader()
            table.writerows(asdict(row) for row in self)
        partly.replace(self.path)


def _row(values: dict[str, str]) -> Row:
    numbers = {name: int(values[name]) for name in ("nth", "line", "of")}
    return Row(**{**values, **numbers})  # type: ignore[arg-type]
