"""What a person found of each survivor: verdicts.toml beside this file."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

from .rows import Row

KINDS = ("equivalent", "tested", "left")


@dataclass(frozen=True)
class Verdict:
    """`equivalent`: nothing that can be seen changes; `tested`: a test kills it since; `left`:
    neither, and why."""

    module: str
    before: str
    after: tuple[str, ...]  # none: every change of that line
    kind: str
    why: str

    def speaks_of(self, row: Row) -> bool:
        return (row.module, row.before) == (self.module, self.before) and (
            not self.after or row.after in self.after
        )


def read(path: Path) -> list[Verdict]:
    """Raises `ValueError` for an entry of another form."""
    if not path.exists():
        return []
    return [
        _verdict(each)
        for each in tomllib.loads(path.read_text(encoding="utf-8")).get("verdict", [])
    ]


def _verdict(entry: dict[str, object]) -> Verdict:
    kinds = [kind for kind in KINDS if kind in entry]
    if len(kinds) != 1 or set(entry) - {"module", "before", "after", *KINDS}:
        raise ValueError(f"{entry}: expected module, before, after, and one of {', '.join(KINDS)}")
    after = entry.get("after", [])
    assert isinstance(after, list)
    return Verdict(
        str(entry["module"]), str(entry["before"]), tuple(after), kinds[0], str(entry[kinds[0]])
    )


def verdict_of(row: Row, verdicts: list[Verdict]) -> Verdict | None:
    """The first that speaks of a mutant."""
    return next((each for each in verdicts if each.speaks_of(row)), None)
