"""What a command that has made a plan gives back."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .common import errors_as_one_line, note, print_table, write_json

if TYPE_CHECKING:
    from ...doe.plans import StoredPlan


def tell_plan(stored: StoredPlan, rows: Iterable[dict[str, Any]], json_to: str | None, out: Path | None) -> None:
    """The plan as CSV in `out`, as JSON in `json_to`; `rows` of it as a table where neither is asked for."""
    from ..plans.tables import plan_as_json, write_table

    if out is not None:
        with errors_as_one_line():
            write_table(stored, out)
        note(f"written: {out}")
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
    elif out is None:
        print_table(rows, "no runs")
