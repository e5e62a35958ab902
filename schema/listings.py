"""Listings: plain rows, page by page, filtered in the database.

A page is three queries however long it is (impacts with their pulse in use, the configurations that are new on it,
the findings), and `pages` cuts them so that a listing costs what it returns and not what the store holds.
"""

from __future__ import annotations

import operator
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Integer, Select, and_, func, or_, select
from sqlalchemy.orm import Session

from .campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from .impacts import Impact, Pulse
from .pages import Span, Table, iter_pages, span_of
from .plans import PlannedRun
from .quality import SEVERITIES, QualityFinding
from .shots import Shot

PAGE = 2000

OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}

_IMPACT_COLUMNS: dict[str, Any] = {
    "id": Impact.id,
    "run": Impact.run,
    "repetition": Impact.repetition,
    "impact_velocity_m_s": Impact.impact_velocity_m_s,
    "contact_time_s": Pulse.contact_time_s,
    "peak_force_n": Pulse.peak_force_n,
    "impulse_n_s": Pulse.impulse_n_s,
    "compression_time_s": Pulse.compression_time_s,
}
_SHOT_COLUMNS: dict[str, Any] = {
    "id": Shot.id,
    "run": Shot.run,
    "repetition": Shot.repetition,
    "tank_pressure_pa": Shot.tank_pressure_pa,
    "bullet_mass_kg": Shot.bullet_mass_kg,
    "measured_velocity_m_s": Shot.measured_velocity_m_s,
    "measured_velocity_u_m_s": Shot.measured_velocity_u_m_s,
}


class UnknownFieldError(ValueError):
    """A filter names no column and no factor; the message lists those there are."""


@dataclass(frozen=True)
class Condition:
    """`field operator value`: a column of the listing, or a factor (numbers in SI)."""

    field: str
    operator: str
    value: str | float


def list_campaigns(session: Session) -> list[dict[str, Any]]:
    """Every campaign with its counts; `planned` and `done` are runs of the plans that it works off."""
    impacts = _count_by_campaign(session, Impact)
    shots = _count_by_campaign(session, Shot)
    plans = _plan_counts(session)
    columns = (Campaign.id, Campaign.name, Campaign.kind, Campaign.date)
    return [
        {
            "name": name,
            "kind": kind,
            "date": date.isoformat(),
            "impacts": impacts.get(key, 0),
            "shots": shots.get(key, 0),
            "planned": plans.get(key, (0, 0))[0],
            "done": plans.get(key, (0, 0))[1],
        }
        for key, name, kind, date in session.execute(select(*columns).order_by(Campaign.date, Campaign.name))
    ]


def _count_by_campaign(session: Session, table: type[Impact] | type[Shot]) -> dict[int, int]:
    rows = session.execute(select(table.campaign_id, func.count()).group_by(table.campaign_id))
    return dict(iter(rows))


def _plan_counts(session: Session) -> dict[int, tuple[int, int]]:
    counts: dict[int, tuple[int, int]] = {}
    for table in (Impact, Shot):
        touched = (
            select(table.campaign_id, PlannedRun.plan_id)
            .join(PlannedRun, table.planned_run_id == PlannedRun.id)
            .distinct()
            .subquery()
        )
        done = func.sum(func.coalesce((PlannedRun.status == "done").cast(Integer), 0))
        query = select(touched.c.campaign_id, func.count(), done).join(
            PlannedRun, PlannedRun.plan_id == touched.c.plan_id
        )
        for campaign, planned, finished in session.execute(query.group_by(touched.c.campaign_id)):
            counts[campaign] = (planned, int(finished))
    return counts


def iter_impacts(
    session: Session, campaign: str | None = None, where: tuple[Condition, ...] = (), page: int = PAGE
) -> Iterator[dict[str, Any]]:
    """Impacts in order of their key, factors included, with the numbers of the pulse in use.

    Raises `UnknownFieldError` for a condition on nothing known, `LookupError` for an unknown campaign.
    """
    columns = (
        Campaign.name.label("campaign"),
        Impact.configuration_id,
        Impact.recording_id,
        *_labelled(_IMPACT_COLUMNS),
    )
    query = (
        select(*columns)
        .select_from(Impact)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
    )
    query, span = _restricted(session, query, Impact, _IMPACT_COLUMNS, campaign, where)
    configurations = _Configurations(session)
    for rows in iter_pages(session, query, Impact.id, span, page):
        quality = _quality(session, rows)
        configurations.learn({row["configuration_id"] for row in rows})
        for row in rows:
            yield {
                "id": row["id"],
                "campaign": row["campaign"],
                "run": row["run"],
                "repetition": row["repetition"],
                **configurations[row["configuration_id"]],
                "impact_velocity_m_s": row["impact_velocity_m_s"],
                "contact_time_s": row["contact_time_s"],
                "peak_force_n": row["peak_force_n"],
                "impulse_n_s": row["impulse_n_s"],
                "compression_time_s": row["compression_time_s"],
                "quality": quality.get(row["id"], "ok"),
            }


def iter_shots(
    session: Session, campaign: str | None = None, where: tuple[Condition, ...] = (), page: int = PAGE
) -> Iterator[dict[str, Any]]:
    """Shots in order of their key. Raises as `iter_impacts`."""
    columns = (Campaign.name.label("campaign"), *_labelled(_SHOT_COLUMNS), Campaign.gun_id.label("gun_id"))
    query = select(*columns).select_from(Shot).join(Campaign, Shot.campaign_id == Campaign.id)
    query, span = _restricted(session, query, Shot, _SHOT_COLUMNS, campaign, where)
    for rows in iter_pages(session, query, Shot.id, span, page):
        yield from rows


def _labelled(columns: dict[str, Any]) -> list[Any]:
    return [column.label(name) for name, column in columns.items()]


def _restricted(
    session: Session,
    query: Select[Any],
    table: Table,
    columns: dict[str, Any],
    campaign: str | None,
    where: tuple[Condition, ...],
) -> tuple[Select[Any], Span]:
    """`query` under a campaign and conditions, and where its rows lie."""
    campaign_id = None if campaign is None else get_campaign_id(session, campaign)
    if campaign_id is not None:
        query = query.where(table.campaign_id == campaign_id)
    of_factors = [condition for condition in where if condition.field not in columns]
    for condition in where:
        if condition.field in columns:
            query = query.where(OPERATORS[condition.operator](columns[condition.field], condition.value))
    if not of_factors:
        return query, span_of(session, table, campaign_id, None)
    # The keys are known before the query: a database plans badly for those that it must find first.
    keys = set.intersection(*(_matching_configurations(session, condition, columns) for condition in of_factors))
    found = sorted(keys)
    return query.where(table.configuration_id.in_(found)), span_of(session, table, campaign_id, found)


def get_campaign_id(session: Session, name: str) -> int:
    """Key of a campaign; `LookupError` naming those there are otherwise."""
    key = session.scalar(select(Campaign.id).where(Campaign.name == name))
    if key is None:
        known = ", ".join(session.scalars(select(Campaign.name).order_by(Campaign.name).limit(10))) or "none yet"
        raise LookupError(f"no campaign {name!r} in the store; known: {known}")
    return key


def _matching_configurations(session: Session, condition: Condition, columns: dict[str, Any]) -> set[int]:
    factor = _factor(session, condition.field, columns)
    test = OPERATORS[condition.operator]
    matches: ColumnElement[bool] = test(FactorLevel.label, str(condition.value))
    try:
        number = float(condition.value)
    except ValueError:
        pass
    else:
        # SI numbers that came by different roads differ in the last digit: equality means to nine digits.
        slack = 1e-9 * abs(number)
        near = FactorLevel.number.between(number - slack, number + slack)
        exact = {"=": near, "!=": ~near}.get(condition.operator)
        numeric = exact if exact is not None else test(FactorLevel.number, number)
        matches = or_(numeric, and_(FactorLevel.number.is_(None), matches)) if condition.operator in "!=" else numeric
    levels = select(FactorLevel.id).where(FactorLevel.factor_id == factor, matches)
    matching = select(ConfigurationLevel.configuration_id).where(ConfigurationLevel.level_id.in_(levels))
    return set(session.scalars(matching))


def _factor(session: Session, field: str, columns: dict[str, Any]) -> int:
    known_factors = session.execute(select(Factor.id, Factor.name, Factor.si_unit)).all()
    factors = {listing_key(name, si_unit): key for key, name, si_unit in known_factors}
    factors |= {name: key for key, name, _ in known_factors}
    if field not in factors:
        known = ", ".join(sorted({*factors, *columns}))
        raise UnknownFieldError(f"no column or factor {field!r}; known: {known}")
    return factors[field]


def listing_key(name: str, si_unit: str | None) -> str:
    """The key under which a factor appears in a listing: `tip_radius` in `m` is `tip_radius_m`."""
    return f"{name}_{si_unit.replace('/', '_').lower()}" if si_unit else name


class _Configurations:
    """Factors of configurations, each asked for once."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._known: dict[int, dict[str, Any]] = {}

    def learn(self, keys: set[int]) -> None:
        new = sorted(keys - self._known.keys())
        for i in range(0, len(new), 500):  # SQLite allows a limited number of variables
            self._learn(new[i : i + 500])

    def _learn(self, keys: list[int]) -> None:
        self._known |= {key: {} for key in keys}
        query = (
            select(
                ConfigurationLevel.configuration_id,
                Factor.name,
                Factor.si_unit,
                FactorLevel.label,
                FactorLevel.number,
            )
            .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
            .join(Factor, FactorLevel.factor_id == Factor.id)
            .where(ConfigurationLevel.configuration_id.in_(keys))
            .order_by(Factor.id)
        )
        for key, name, si_unit, label, number in self._session.execute(query):
            self._known[key][listing_key(name, si_unit)] = label if number is None else number

    def __getitem__(self, key: int) -> dict[str, Any]:
        return self._known[key]


def _quality(session: Session, rows: list[dict[str, Any]]) -> dict[int, str]:
    """Worst severity per impact of a page, where it is more than a note: of its own findings and its recording's."""
    recordings = sorted({row["recording_id"] for row in rows if row["recording_id"] is not None})
    columns = (QualityFinding.recording_id, QualityFinding.impact_id, QualityFinding.severity)
    doubts = select(*columns).where(QualityFinding.severity.in_(SEVERITIES[1:])).distinct()
    said: defaultdict[tuple[int, int | None], set[str]] = defaultdict(set)
    for i in range(0, len(recordings), 500):  # SQLite allows a limited number of variables
        of_some = doubts.where(QualityFinding.recording_id.in_(recordings[i : i + 500]))
        for recording, impact, severity in session.execute(of_some):
            said[recording, impact].add(severity)
    worst: dict[int, str] = {}
    for row in rows:
        mine = said.get((row["recording_id"], row["id"]), set()) | said.get((row["recording_id"], None), set())
        if mine:
            worst[row["id"]] = max(mine, key=SEVERITIES.index)
    return worst
