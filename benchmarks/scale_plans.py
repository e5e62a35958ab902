"""The plans of a question's statements, as the database tells them, in a few lines."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from pyroshock.schema.session import Store
from sqlalchemy import Engine, event
from sqlalchemy.orm import Session

_EXPLAIN = "EXPLAIN (ANALYZE, BUFFERS, FORMAT JSON) "
#: Nodes that only pass rows on tell nothing.
_SILENT = ("Gather", "Gather Merge", "Materialize", "Memoize", "Hash", "Result", "Subquery Scan", "Unique", "Limit")


@dataclass(frozen=True)
class Plans:
    """How many statements a question was, and the dearest one's plan: lines, from the last step to the first."""

    statements: int
    milliseconds: float
    lines: tuple[str, ...]

    @property
    def scanned(self) -> tuple[str, ...]:
        """Tables that are read from end to end in it."""
        return tuple(line.split()[3] for line in self.lines if line.strip().startswith(("Seq Scan", "Parallel Seq")))


def plans_of(store: Store, ask: Callable[[Session], object]) -> Plans:
    """Asks once, and has every statement of it explained."""
    with _listening(store.engine) as said, store.reading() as session:
        ask(session)
    explained = []
    with store.engine.connect() as connection:
        for statement, parameters in said:
            found: Any = connection.exec_driver_sql(_EXPLAIN + statement, parameters).scalar_one()
            explained.append(found[0])
    dearest = max(explained, key=lambda one: float(one["Execution Time"]))
    return Plans(len(said), float(dearest["Execution Time"]), tuple(_lines(dearest["Plan"], 0)))


@contextmanager
def _listening(engine: Engine) -> Iterator[list[tuple[str, Any]]]:
    said: list[tuple[str, Any]] = []

    def hear(_connection: Any, _cursor: Any, statement: str, parameters: Any, *_: Any) -> None:
        if statement.lstrip().startswith("SELECT"):
            said.append((statement, parameters))

    event.listen(engine, "before_cursor_execute", hear)
    try:
        yield said
    finally:
        event.remove(engine, "before_cursor_execute", hear)


def _lines(node: dict[str, Any], depth: int) -> Iterator[str]:
    silent = node["Node Type"] in _SILENT
    if not silent:
        yield "  " * depth + _line(node)
    for child in node.get("Plans", []):
        yield from _lines(child, depth if silent else depth + 1)


def _line(node: dict[str, Any]) -> str:
    """`Index Scan on impacts by ix_impacts_campaign_id_id: 50 rows, 0.1 ms, 4 pages`."""
    what = [node["Node Type"]]
    if "Relation Name" in node:
        what.append(f"on {node['Relation Name']}")
    if "Index Name" in node:
        what.append(f"by {node['Index Name']}")
    loops = int(node["Actual Loops"])
    rows = f"{round(node['Actual Rows'] * loops):,} rows".replace(",", " ")
    pages = int(node.get("Shared Hit Blocks", 0)) + int(node.get("Shared Read Blocks", 0))
    times = f" in {loops} loops" if loops > 1 else ""
    spent = node["Actual Total Time"] * loops
    return f"{' '.join(what)}: {rows}{times}, {spent:{'.3g' if spent < 999 else '.0f'}} ms, {pages} pages"
