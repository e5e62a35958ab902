"""How much of each room the tests ran, of what `make coverage` counted; `--floor` holds it to
`covered.toml`.

`--page` writes the table of docs/measurements/coverage.md; `--set-floor` puts the floor below what
was counted.
"""

from __future__ import annotations

import json
import sys
import tempfile
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
FLOOR = HERE / "covered.toml"
PAGE = ROOT / "docs" / "measurements" / "coverage.md"
#: Points between what is counted and the floor: tests that wait for other processes take other
#: branches by chance.
MARGIN = 1.0
#: Between these the page holds the table.
_BEGIN, _END = "<!-- rooms: written by make coverage -->", "<!-- end of rooms -->"


@dataclass(frozen=True)
class Covered:
    """Statements and branches of a room or a file, and those that ran."""

    name: str
    statements: int
    statements_run: int
    branches: int
    branches_run: int

    @property
    def percent(self) -> float:
        """Of statements and branches together, as coverage.py reckons it; 100 where there is
        nothing to run."""
        wanted = self.statements + self.branches
        return 100.0 * (self.statements_run + self.branches_run) / wanted if wanted else 100.0

    def row(self) -> str:
        lines, ways = (
            f"{self.statements_run} of {self.statements}",
            f"{self.branches_run} of {self.branches}",
        )
        return f"| `{self.name}` | {lines} | {ways} | {self.percent:.1f} % |"


HEADER = "| room | statements | branches | covered |\n| --- | --- | --- | --- |"


def by_file(counted: Mapping[str, Any]) -> list[Covered]:
    """Of coverage.py's JSON report, in its order."""
    return [_covered(path, file["summary"]) for path, file in counted["files"].items()]


def _covered(name: str, found: Mapping[str, Any]) -> Covered:
    counts = (
        found["num_statements"],
        found["covered_lines"],
        found["num_branches"],
        found["covered_branches"],
    )
    return Covered(name, *counts)


def by_room(files: list[Covered]) -> list[Covered]:
    """Rooms in the order of their names, and the whole at the end. A room is a folder of the
    package."""
    rooms = sorted({file.name.split("/")[0] for file in files if "/" in file.name})
    return [
        *(_sum(room, [f for f in files if f.name.startswith(f"{room}/")]) for room in rooms),
        _sum("all", files),
    ]


def _sum(name: str, files: list[Covered]) -> Covered:
    total: Counter[str] = Counter()
    for file in files:
        total.update(
            s=file.statements, sr=file.statements_run, b=file.branches, br=file.branches_run
        )
    return Covered(name, total["s"], total["sr"], total["b"], total["br"])


def below(rooms: list[Covered], floor: Mapping[str, float]) -> Iterator[str]:
    """A line for each room that is under its floor, or has none."""
    for room in rooms:
        least = floor.get(room.name)
        if least is None:
            yield (
                f"{room.name}: no floor in {FLOOR.name}; "
                f"set one: python -m tools.covered --set-floor"
            )
        elif room.percent < least:
            yield f"{room.name}: {room.percent:.2f} % covered, under its floor of {least:g} %"


def floor_text(rooms: list[Covered]) -> str:
    """`covered.toml`: `MARGIN` below what was counted, to a tenth."""
    lines = (f"{room.name} = {max(0.0, room.percent - MARGIN):.1f}" for room in rooms)
    return (
        "# Per cent of statements and branches below which `make coverage` fails.\n"
        + "\n".join(lines)
        + "\n"
    )


def page_text(text: str, rooms: list[Covered], day: str) -> str:
    """The page with the table renewed. Raises `ValueError` where its marks are gone."""
    before, begin, rest = text.partition(_BEGIN)
    _, end, after = rest.partition(_END)
    if not (begin and end):
        raise ValueError(f"{PAGE.name}: expected {_BEGIN} and {_END} around the table")
    table = "\n".join([HEADER, *(room.row() for room in rooms)])
    return f"{before}{begin}\nCounted on {day}.\n\n{table}\n{end}{after}"


def counted() -> Mapping[str, Any]:
    from coverage import Coverage

    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "covered.json"
        count = Coverage(config_file=str(ROOT / "pyproject.toml"))
        count.load()
        # Of this tree alone: copies of it that tests have run are gone by now.
        count.json_report(outfile=str(out), include=[f"{ROOT}/*"])
        found: Mapping[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return found


def main(words: list[str]) -> int:
    """0: nothing is below its floor, or nobody asked; 1: what is, and where."""
    files = by_file(counted())
    rooms = by_room(files)
    print(HEADER, *(room.row() for room in rooms), sep="\n")
    print("\nleast covered:", *(f"  {f.percent:5.1f} %  {f.name}" for f in _least(files)), sep="\n")
    if "--set-floor" in words:
        FLOOR.write_text(floor_text(rooms), encoding="utf-8")
    if "--page" in words:
        day = f"{datetime.now(tz=UTC):%Y-%m-%d}"
        PAGE.write_text(page_text(PAGE.read_text(encoding="utf-8"), rooms, day), encoding="utf-8")
    floor = tomllib.loads(FLOOR.read_text(encoding="utf-8"))
    wrong = list(below(rooms, floor)) if "--floor" in words else []
    print(*wrong, sep="\n", file=sys.stderr, end="\n" if wrong else "")
    return 1 if wrong else 0


def _least(files: list[Covered]) -> list[Covered]:
    return sorted((file for file in files if file.statements > 5), key=lambda file: file.percent)[
        :15
    ]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
