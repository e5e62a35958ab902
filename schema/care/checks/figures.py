"""The figures of impacts, shots and acceleration channels are those that were written; `pulses` asks the same of a
pulse's."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

from sqlalchemy import Connection, select

from ... import figures
from ...campaigns import Campaign
from ...impacts import ChannelFigures, Impact
from ...json_floats import from_plain
from ...recordings import RecordedChannel
from ...shots import Shot
from ...tables import metadata
from ..findings import IntegrityFinding
from ..rows import stored_columns
from .scope import RESTORE, Scope

_PAGE = 2000
_OF: tuple[tuple[type[Impact] | type[Shot], tuple[str, ...]], ...] = ((Impact, figures.IMPACT), (Shot, figures.SHOT))
#: Are read as they are stored: a text that need not be JSON.
_LISTS = ("force_points_n", "srs_frequency_hz", "srs_maximax_m_s2")


def check_figures(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Impacts, shots and acceleration channels whose figures (velocities, pressures, masses, peaks) have another
    SHA-256 than the recorded one."""
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
                    yield IntegrityFinding("figures", problem, RESTORE, {**place, "table": table.__tablename__})
    yield from _channel_figures(connection, scope)


def _channel_figures(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Figures of acceleration channels that have another SHA-256 than the recorded one."""
    table = metadata.tables[ChannelFigures.__tablename__]
    wanted = ("id", "figures_sha256", *figures.CHANNEL)
    own = [column for column in stored_columns(table) if column.name in wanted]
    place = (Campaign.name.label("campaign"), Impact.run, Impact.repetition, RecordedChannel.name.label("channel"))
    query = select(*place, *own).join_from(table, Impact, table.c.impact_id == Impact.id)
    query = query.join(Campaign, Impact.campaign_id == Campaign.id)
    query = query.join(RecordedChannel, table.c.channel_id == RecordedChannel.id)
    query, after = scope.within(query.order_by(table.c.id).limit(_PAGE), Impact.campaign_id), 0
    while page := connection.execute(query.where(table.c.id > after)).mappings().all():
        after = page[-1]["id"]
        for row in page:
            problem = figures_problem(dict(row), figures.CHANNEL)
            if problem is not None:
                where = {key: row[key] for key in ("campaign", "run", "repetition", "channel")}
                yield IntegrityFinding("figures", problem, RESTORE, {**where, "table": table.name})


def figures_problem(row: Mapping[str, Any], columns: tuple[str, ...]) -> str | None:
    """What is wrong with the figures of a row beside their SHA-256; None where they are those that were written."""
    recorded = row["figures_sha256"]
    if recorded is None:
        return "its row does not say the SHA-256 of its figures"
    computed_hash = figures.figures_hash(_decoded(row), columns)
    if computed_hash == recorded:
        return None
    return f"a figure was altered: its figures have the SHA-256 {computed_hash[:12]}…, its row says {recorded[:12]}…"


def _decoded(row: Mapping[str, Any]) -> Mapping[str, Any]:
    decoded = dict(row)
    for name in _LISTS:
        try:
            decoded[name] = from_plain(json.loads(row[name]))
        except (KeyError, TypeError, ValueError):
            continue
    return decoded
