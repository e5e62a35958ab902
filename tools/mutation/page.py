"""The tables of docs/mutation.md, from the kept rows and the verdicts."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

from .rows import Row
from .verdicts import Verdict, verdict_of

_BEGIN, _END = "<!-- {}: written by make mutants -->", "<!-- end of {} -->"
_COLUMNS = ("mutants", "tried", "killed at first", "killed since", "timed out", "equivalent", "left", "not looked at")


def counted(rows: Sequence[Row], verdicts: list[Verdict]) -> str:
    """A line for each module, and one for all."""
    by_module: dict[str, list[Row]] = defaultdict(list)
    for row in rows:
        by_module[row.module].append(row)
    lines = [f"| module | {' | '.join(_COLUMNS)} | last tried |", "| --- |" + " ---: |" * len(_COLUMNS) + " --- |"]
    sums = [0] * len(_COLUMNS)
    for module, some in sorted(by_module.items()):
        numbers = _numbers(some, verdicts)
        sums = [a + b for a, b in zip(sums, numbers, strict=True)]
        lines.append(f"| `{module}` | {_cells(numbers)} | {max(row.date for row in some)} |")
    return "\n".join([*lines, f"| all | {_cells(sums)} |  |"])


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
    lines += [line for row in rows if row.at_first == "survived" for line in _line(row, verdict_of(row, verdicts))]
    return "\n".join(lines)


def _line(row: Row, verdict: Verdict | None) -> Iterator[str]:
    if row.now == "survived":
        said = f"{verdict.kind}: {verdict.why}" if verdict else "not looked at"
    else:
        said = (
            verdict.why if verdict and verdict.kind == "tested" else f"{row.now} since: `{row.by.rpartition('/')[2]}`"
        )
    yield f"| `{row.module}` {row.definition} | {_code(row.before)} | {_code(row.after)} | {said} |"


def _code(text: str) -> str:
    """A bar ends a cell, also within code."""
    return f"`{text}`".replace("|", "\\|")


def written(path: Path, tables: dict[str, str]) -> None:
    """Puts each table between its two marks. Raises `ValueError` where a page lacks them."""
    text = path.read_text(encoding="utf-8")
    for name, table in tables.items():
        begin, end = _BEGIN.format(name), _END.format(name)
        if text.count(begin) != 1 or text.count(end) != 1:
            raise ValueError(f"{path.name}: expected the marks {begin!r} and {end!r}, once each")
        before, _, rest = text.partition(begin)
        text = f"{before}{begin}\n{table}\n{end}{rest.partition(end)[2]}"
    path.write_text(text, encoding="utf-8")
