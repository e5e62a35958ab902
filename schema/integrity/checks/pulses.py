"""Every stored pulse can be drawn, and its fine force peaks where its row says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from sqlalchemy import Connection, select

from ...campaigns import Campaign
from ...impacts import Impact, Pulse
from ...series import SeriesError, as_floats, content_bytes
from ..findings import IntegrityFinding, Scope

ADVICE = (
    "cut the recording again with other settings (pyroshock extract CAMPAIGN --threshold …), or "
    "restore the store from its backup"
)
#: A pulse's row with its force, and where it belongs.
PulseRow = Any

_PAGE = 200
#: More points than a pulse of minutes has: a few bytes may declare gigabytes.
_MOST_POINTS = 4_000_000


def check_pulses(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Pulses whose fine force is damaged or peaks elsewhere than their row says."""
    for row in _iter_pulses(connection, scope):
        problem = _problem(row)
        if problem is not None:
            place = {
                "campaign": row.campaign,
                "run": row.run,
                "repetition": row.repetition,
                "pulse": row.id,
            }
            yield IntegrityFinding("pulses", problem, ADVICE, place)


def _problem(row: PulseRow) -> str | None:
    points = content_bytes(row.fine_force_n) // 8
    fitting = row.contact_time_s / row.fine_period_s + 2 if row.fine_period_s > 0 else 0
    if not 0 < points <= min(fitting, _MOST_POINTS):
        return (
            f"{points} points of its fine force do not fit a contact of {row.contact_time_s:.3g} s"
        )
    try:
        fine = as_floats(row.fine_force_n, "its fine force")
    except SeriesError as error:
        return str(error)
    peak = float(fine.max())
    if peak != row.spline_peak_force_n:
        return f"its fine force peaks at {peak:.6g} N, its row says {row.spline_peak_force_n:.6g} N"
    return None


def _iter_pulses(connection: Connection, scope: Scope) -> Iterator[PulseRow]:
    query = (
        select(
            Campaign.name.label("campaign"),
            Impact.run,
            Impact.repetition,
            Pulse.id,
            Pulse.contact_time_s,
            Pulse.fine_period_s,
            Pulse.fine_force_n,
            Pulse.spline_peak_force_n,
        )
        .select_from(Pulse)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
    )
    return scope.iter_rows(connection, query, Impact.campaign_id, Pulse.id, _PAGE)
