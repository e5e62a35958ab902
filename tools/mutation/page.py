"""The table of docs/measurements/mutation.md and the list of survivors, from the kept rows and the
verdicts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from .rows import Row
from .verdicts import Verdict, verdict_of

_BEGIN, _END = "<!-- modules: written by make mutants -->", "<!-- end of modules -->"
_COLUMNS = (
    "mutants",
    "tried",
    "killed at first",
    "killed since",
    "timed out",
    "equivalent",
    "left",
    "not looked at",
)
_HEADER = (
    f"| module | {' | '.join(_COLUMNS)} | last tried |",
    "| --- |" + " ---: |" * len(_COLUMNS) + " --- |",
)


def write_table(path: Path, rows: Sequence[Row], verdicts: list[Verdict]) -> None:
    """Put a line for each module that `rows` tell of into the page; those of other modules stay.

    Raises `ValueError` where the page lacks the marks of the table.
    """
    text = path.read_text(encoding="utf-8")
    if text.count(_BEGIN) != 1 or text.count(_END) != 1:
        raise ValueError(f"{path.name}: expected the marks {_BEGIN!r} and {_END!r}, once each")
    before, _, rest = text.partition(_BEGIN)
    table, _, after = rest.partition(_END)
    lines = {_module_of(line): line for line in table.splitlines() if line.startswith("| `")}
    lines |= {_module_of(line): line for line in module_lines(rows, verdicts)}
    written = [
        *_HEADER,
        *(line for _, line in sorted(lines.items())),
        _sum_of(list(lines.values())),
    ]
    path.write_text(
        f"{before}{_BEGIN}\n" + "\n".join(written) + f"\n{_END}{after}", encoding="utf-8"
    )


def module_lines(rows: Sequence[Row], verdicts: list[Verdict]) -> list[str]:
    """A line of the table for each module."""
    by_module: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_module[row.module].append(row)
    return [
        f"| `{module}` | {_cells(_numbers(some, verdicts))} | {max(row.date for row in some)} |"
        for module, some in sorted(by_module.items())
    ]


def _module_of(line: str) -> str:
    return line.split("`")[1]


def _sum_of(lines: Sequence[str]) -> str:
    numbers = [[int(cell.replace(",", "")) for cell in line.split("|")[2:-2]] for line in lines]
    return f"| all | {_cells([sum(column) for column in zip(*numbers, strict=True)])} |  |"


def _numbers(rows: Sequence[Row], verdicts: list[Verdict]) -> list[int]:
    killed = [row for row in rows if row.now == "killed"]
    at_first = sum(row.at_first == "killed" for row in killed)
    alive = [verdict_of(row, verdicts) for row in rows if row.now == "survived"]
    kinds = [each.kind if each else "" for each in alive]
    late = sum(row.now == "timed out" for row in rows)
    unseen = len(kinds) - kinds.count("equivalent") - kinds.count("left")
    return [
        rows[0].of,
        len(rows),
        at_first,
        len(killed) - at_first,
        late,
        kinds.count("equivalent"),
        kinds.count("left"),
        unseen,
    ]


def _cells(numbers: Sequence[int]) -> str:
    return " | ".join(f"{number:,}" for number in numbers)


def survivors(rows: Sequence[Row], verdicts: list[Verdict]) -> str:
    """A line for each mutant that survived at first, by verdict: what became of it and why."""
    lines = ["| where | line | became | verdict |", "| --- | --- | --- | --- |"]
    lines += [
        line
        for row in rows
        if row.at_first == "survived"
        for line in _line(row, verdict_of(row, verdicts))
    ]
    return "\n".join(lines)


def _line(row: Row, verdict: Verdict | None) -> Iterator[str]:
    if row.now == "survived":
        said = f"{verdict.kind}: {verdict.why}" if verdict else "not looked at"
    else:
        said = (
            verdict.why
            if verdict and verdict.kind == "tested"
            else f"{row.now} since: `{row.by.rpartition('/')[2]}`"
        )
    yield f"| `{row.module}` {row.definition} | {_code(row.before)} | {_code(row.after)} | {said} |"


def _code(text: str) -> str:
    """A bar ends a cell, also within code."""
    return f"`{text}`".replace("|", "\\|")
