"""The figures of impacts and shots are those that were written; `pulses` asks the same of a pulse's."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from sqlalchemy import Connection, select

from ... import figures
from ...campaigns import Campaign
from ...impacts import Impact
from ...plain import from_plain
from ...shots import Shot
from ..findings import Finding
from .scope import RESTORE, Scope

_PAGE = 2000
_OF: tuple[tuple[type[Impact] | type[Shot], tuple[str, ...]], ...] = ((Impact, figures.IMPACT), (Shot, figures.SHOT))
#: Is read as it is stored: a text that need not be JSON.
_POINTS = "force_points_n"


def check_figures(connection: Connection, scope: Scope) -> Iterator[Finding]:
    """Impacts and shots whose figures (velocities, pressures, masses) have another SHA-256 than the recorded one."""
    for table, columns in _OF:
        own = [getattr(table, name) for name in ("id", "figures_sha256", *columns)]
        query = select(Campaign.name.label("campaign"), *own).join(Campaign, table.campaign_id == Campaign.id)
        query, after = scope.within(query.order_by(table.id).limit(_PAGE), table.campaign_id), 0
        while page := connection.execute(query.where(table.id > after)).mappings().all():
            after = page[-1]["id"]
            for row in page:
                problem = figures_problem(dict(row), columns)
                if problem is not None:
                    place = {key: row[key] for key in ("campaign", "run", "repetition")}
                    yield Finding("figures", problem, RESTORE, {**place, "table": table.__tablename__})


def figures_problem(row: Mapping[str, Any], columns: tuple[str, ...]) -> str | None:
    """What is wrong with the figures of a row beside their SHA-256; None where they are those that were written."""
    recorded = row["figures_sha256"]
    if recorded is None:
        return "its row does not say the SHA-256 of its figures"
    found = figures.figures_hash(_decoded(row), columns)
    if found == recorded:
        return None
    return f"a figure was altered: its figures have the SHA-256 {found[:12]}…, its row says {recorded[:12]}…"


def _decoded(row: Mapping[str, Any]) -> Mapping[str, Any]:
    if _POINTS not in row:
        return row
    try:
        return {**row, _POINTS: from_plain(json.loads(row[_POINTS]))}
    except (TypeError, ValueError):
        return row
