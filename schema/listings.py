"""Listings: plain rows, page by page, filtered in the database; and the pulses of a filter, thinned
evenly there.

A page is three queries however long it is (impacts with their pulse in use, the configurations that
are new on it, the findings), and `conditions` cuts them so that a listing costs what it returns and
not what the store holds.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from itertools import islice
from typing import Any

from sqlalchemy import ColumnElement, Row, Select, bindparam, case, exists, func, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from .base import in_batches
from .campaign_counts import hit_counts
from .campaigns import (
    Campaign,
    ConfigurationLevel,
    Factor,
    FactorLevel,
    PlannedRun,
    is_day_unknown,
    stated_day,
)
from .conditions import (
    CAMPAIGN,
    CHANNEL_COLUMNS,
    IMPACT_COLUMNS,
    IN_USE,
    LARGEST,
    OPERATORS,
    QUALITY,
    SHOT_COLUMNS,
    Condition,
    KeySpan,
    UnknownFieldError,
    get_campaign_id,
    get_factor_id,
    iter_pages,
    listing_key,
    restricted,
)
from .configurations import iter_levels
from .impacts import ChannelFigures, Impact, Pulse, Shot, velocity_kind
from .notes import Tag
from .recordings import NOT_JUDGED, SEVERITIES, QualityFinding
from .run_states import run_status

PAGE = 2000


def is_tagged(word: str) -> ColumnElement[bool]:
    """Whether people have put a tag on a campaign, for queries of `Campaign`.

    Parameters:
        word: The tag; letters' case does not count.
    """
    return exists().where(
        Tag.subject_kind == CAMPAIGN, Tag.word == word.casefold(), Tag.subject == Campaign.name
    )


def list_campaigns(session: Session, tag: str | None = None) -> list[dict[str, Any]]:
    """Every campaign with its counts.

    Parameters:
        session: A session of the store.
        tag: A tag that the campaigns have; by default (None) all are listed.

    Returns:
        A row for each campaign, by date and name, with `name`, `kind`, `date` (ISO 8601; None where
        nobody knows it, and these come last), the numbers of its `impacts` and `shots`, and
        `planned` and `done`, which are runs of the plans that it works off.
    """
    hits = hit_counts(session)
    plans = list_plan_counts(session)
    query = select(Campaign.id, Campaign.name, Campaign.kind, Campaign.date)
    if tag is not None:
        query = query.where(is_tagged(tag))
    return [
        {
            "name": name,
            "kind": kind,
            "date": stated_day(date),
            "impacts": hits[key][0],
            "shots": hits[key][1],
            "planned": plans.get(key, (0, 0))[0],
            "done": plans.get(key, (0, 0))[1],
        }
        for key, name, kind, date in session.execute(
            query.order_by(is_day_unknown(), Campaign.date, Campaign.name)
        )
    ]


def list_plan_counts(
    session: Session, campaigns: list[int] | None = None
) -> dict[int, tuple[int, int]]:
    """Runs, and those that are done, of the plans that campaigns work off.

    Parameters:
        session: A session of the store.
        campaigns: The keys of the campaigns; by default (None) all.

    Returns:
        The numbers of planned and of done runs by the campaign's key, for the campaigns that work
        off a plan.
    """
    counts: dict[int, tuple[int, int]] = {}
    keys = {} if campaigns is None else {"campaigns": campaigns}
    for table in (Impact, Shot):
        for campaign, planned, finished in session.execute(_plan_counts(table, bool(keys)), keys):
            counts[campaign] = (planned, int(finished))
    return counts


@cache
def _plan_counts(table: type[Impact] | type[Shot], of_campaigns: bool) -> Select[Any]:
    """Of `campaigns`, or of all: the key, and the planned and the done runs of the plans that its
    hits are of.

    Of all campaigns, the hits are looked up by their planned run, for a database would rather read
    every hit.
    """
    hit_condition = (
        table.campaign_id.in_(bindparam("campaigns", expanding=True))
        if of_campaigns
        else table.planned_run_id.in_(select(PlannedRun.id))
    )
    plans_of_campaigns = (
        select(table.campaign_id, PlannedRun.plan_id)
        .join(PlannedRun, table.planned_run_id == PlannedRun.id)
        .where(hit_condition)
        .distinct()
        .subquery()
    )
    done_runs = func.sum(case((run_status() == "done", 1), else_=0))
    query = select(plans_of_campaigns.c.campaign_id, func.count(), done_runs).join(
        PlannedRun, PlannedRun.plan_id == plans_of_campaigns.c.plan_id
    )
    return query.group_by(plans_of_campaigns.c.campaign_id)


def iter_impacts(
    session: Session,
    campaign: str | None = None,
    where: tuple[Condition, ...] = (),
    page: int = PAGE,
    after: int | None = None,
) -> Iterator[dict[str, Any]]:
    """Impacts in order of their key, factors included, with the numbers of the pulse in use and
    those of the acceleration channel with the largest peak.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; by default (None) all campaigns.
        where: Conditions, all of which a row must meet; by default none.
        page: The largest number of rows that are fetched at a time; by default `PAGE`.
        after: The key beyond which rows are listed; by default (None) from the first.

    Raises:
        UnknownFieldError: For a condition on nothing known.
        LookupError: For an unknown campaign.
        ValueError: For a column that is compared with a word.
    """
    query, find_span = restricted(session, _impacts(), Impact, IMPACT_COLUMNS, campaign, where)
    span = find_span().beyond(after)
    yield from _impact_rows(session, iter_pages(session, query, Impact.id, span, page))


def _impacts() -> Select[Any]:
    columns = (
        Campaign.name.label("campaign"),
        Impact.configuration_id,
        Impact.recording_id,
        Impact.velocity_source,
        *_labelled(IMPACT_COLUMNS),
    )
    query = select(*columns).select_from(Impact).join(Campaign, Impact.campaign_id == Campaign.id)
    return query.outerjoin(Pulse, IN_USE).outerjoin(ChannelFigures, LARGEST)


def _impact_rows(
    session: Session, pages: Iterable[list[dict[str, Any]]]
) -> Iterator[dict[str, Any]]:
    """Rows of a listing from pages of rows of `_impacts`."""
    configurations = _Configurations(session)
    for rows in pages:
        quality = worst_severities(session, rows)
        configurations.learn({row["configuration_id"] for row in rows})
        for row in rows:
            yield {
                "id": row["id"],
                "campaign": row["campaign"],
                "run": row["run"],
                "repetition": row["repetition"],
                **configurations[row["configuration_id"]],
                "impact_velocity_m_s": row["impact_velocity_m_s"],
                "velocity_kind": velocity_kind(row["velocity_source"]),
                "contact_time_s": row["contact_time_s"],
                "peak_force_n": row["peak_force_n"],
                "impulse_n_s": row["impulse_n_s"],
                "compression_time_s": row["compression_time_s"],
                "quality": NOT_JUDGED
                if row["recording_id"] is None
                else quality.get(row["id"], "ok"),
                **{name: row[name] for name in CHANNEL_COLUMNS},
            }


def iter_shots(
    session: Session,
    campaign: str | None = None,
    where: tuple[Condition, ...] = (),
    page: int = PAGE,
    after: int | None = None,
) -> Iterator[dict[str, Any]]:
    """Shots in order of their key.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; by default (None) all campaigns.
        where: Conditions, all of which a row must meet; by default none.
        page: The largest number of rows that are fetched at a time; by default `PAGE`.
        after: The key beyond which rows are listed; by default (None) from the first.

    Raises:
        UnknownFieldError: As `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: As `iter_impacts`.
    """
    columns = (
        Campaign.name.label("campaign"),
        *_labelled(SHOT_COLUMNS),
        Campaign.gun_id.label("gun_id"),
    )
    query = select(*columns).select_from(Shot).join(Campaign, Shot.campaign_id == Campaign.id)
    query, find_span = restricted(session, query, Shot, SHOT_COLUMNS, campaign, where)
    for rows in iter_pages(session, query, Shot.id, find_span().beyond(after), page):
        yield from rows


Rows = list[dict[str, Any]]


def list_impacts_sorted(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    column: str,
    *,
    descending: bool = False,
    offset: int = 0,
    limit: int = 100,
) -> tuple[Rows, bool]:
    """Impacts in order of a column of the listing or of a factor. Impacts without a value come
    last; equal ones are in order of their key.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which a row must meet.
        column: The column of the order, or a factor by its name or by its `listing_key`.
        descending: Whether the largest value comes first; by default the smallest does.
        offset: The number of rows that are passed over first; by default none.
        limit: The largest number of rows, 1 or more; by default 100.

    Returns:
        At most `limit` rows as `iter_impacts` gives them, and whether more follow.

    Raises:
        UnknownFieldError: For a column that there is not, and as `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: For a limit below 1, and as `iter_impacts`.
    """
    _check_limit(limit)
    query = select(Impact.id).select_from(Impact).join(Campaign, Impact.campaign_id == Campaign.id)
    query = query.outerjoin(Pulse, IN_USE).outerjoin(ChannelFigures, LARGEST)
    query, find_span = restricted(session, query, Impact, IMPACT_COLUMNS, campaign, where)
    span = find_span()
    query, orders = _ordered(session, query.where(Impact.id.between(span.first, span.last)), column)
    keys_of_order = [
        part
        for order in orders
        for part in (order.is_(None), order.desc() if descending else order)
    ]
    keys = list(
        session.scalars(query.order_by(*keys_of_order, Impact.id).offset(offset).limit(limit + 1))
    )
    query = _impacts().where(Impact.id.in_(keys[:limit]))
    rows = [dict(row) for row in session.execute(query).mappings()]
    by_key = {row["id"]: row for row in _impact_rows(session, [rows] if rows else [])}
    return [by_key[key] for key in keys[:limit]], len(keys) > limit


#: Columns of the listing that are figures of a pulse or of a channel. Where none is asked for,
#: these tables are not read to count impacts.
_FIGURE_COLUMNS = {
    name for name, column in IMPACT_COLUMNS.items() if column.class_ in (Pulse, ChannelFigures)
}


def count_impacts(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    most: int,
    until: int | None = None,
) -> int:
    """How many impacts a listing has, counted up to one more than `most`: beyond, a person asks for
    no exact number, and the database reads no further.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which a row must meet.
        most: The largest number that is counted.
        until: The last key that is counted; by default (None) there is none.

    Raises:
        UnknownFieldError: As `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: As `iter_impacts`.
    """
    query = select(Impact.id).select_from(Impact).join(Campaign, Impact.campaign_id == Campaign.id)
    if any(condition.field in _FIGURE_COLUMNS for condition in where):
        query = query.outerjoin(Pulse, IN_USE).outerjoin(ChannelFigures, LARGEST)
    restriction = restricted(session, query, Impact, IMPACT_COLUMNS, campaign, where)
    return _count(session, restriction, Impact.id, most, until)


def count_shots(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    most: int,
    until: int | None = None,
) -> int:
    """How many shots a listing has, counted up to one more than `most`.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which a row must meet.
        most: The largest number that is counted.
        until: The last key that is counted; by default (None) there is none.

    Raises:
        UnknownFieldError: As `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: As `iter_impacts`.
    """
    query = select(Shot.id).select_from(Shot).join(Campaign, Shot.campaign_id == Campaign.id)
    restriction = restricted(session, query, Shot, SHOT_COLUMNS, campaign, where)
    return _count(session, restriction, Shot.id, most, until)


def _count(
    session: Session,
    restriction: tuple[Select[Any], Callable[[], KeySpan]],
    key: Any,
    most: int,
    until: int | None,
) -> int:
    query, find_span = restriction
    span = find_span()
    last = span.last if until is None else min(span.last, until)
    keys = query.where(key.between(span.first, last)).limit(most + 1).subquery()
    return session.scalars(select(func.count()).select_from(keys)).one()


def _ordered(session: Session, query: Select[Any], column: str) -> tuple[Select[Any], list[Any]]:
    """The query with what the order needs, and the expressions of the order."""
    if column in IMPACT_COLUMNS:
        return query, [IMPACT_COLUMNS[column]]
    if column == CAMPAIGN:
        return query, [Campaign.name]
    if column == QUALITY:
        return query, [_quality_rank()]
    factor = get_factor_id(session, column, {*IMPACT_COLUMNS, CAMPAIGN, QUALITY})
    levels = (
        select(
            ConfigurationLevel.configuration_id.label("configuration"),
            FactorLevel.number,
            FactorLevel.label,
        )
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .where(FactorLevel.factor_id == factor)
        .subquery()
    )
    return query.outerjoin(levels, levels.c.configuration == Impact.configuration_id), [
        levels.c.number,
        levels.c.label,
    ]


def _quality_rank() -> Any:
    """0 where nothing was found, higher the graver the worst finding is."""
    ranks = {severity: rank for rank, severity in enumerate(SEVERITIES)}
    its_own = or_(QualityFinding.impact_id == Impact.id, QualityFinding.impact_id.is_(None))
    worst = select(func.max(case(ranks, value=QualityFinding.severity, else_=0)))
    worst = worst.where(QualityFinding.recording_id == Impact.recording_id, its_own)
    return func.coalesce(worst.correlate(Impact).scalar_subquery(), 0)


def list_levels(session: Session, most: int = 60, fewest: int = 2) -> dict[str, list[float | str]]:
    """Levels that the store has of each factor, by its key in a listing.

    Parameters:
        session: A session of the store.
        most: The largest number of levels, by default 60; a factor of more is left out.
        fewest: The smallest number of levels, by default 2; a factor of fewer is left out.

    Returns:
        The levels of each factor, numbers in SI or words.
    """
    query = select(Factor.name, Factor.si_unit, FactorLevel.number, FactorLevel.label)
    query = query.join(FactorLevel, FactorLevel.factor_id == Factor.id).order_by(
        Factor.id, FactorLevel.number, FactorLevel.label
    )
    levels: dict[str, list[float | str]] = {}
    for name, si_unit, number, label in session.execute(query):
        levels.setdefault(listing_key(name, si_unit), []).append(
            label if number is None else number
        )
    return {key: values for key, values in levels.items() if fewest <= len(values) <= most}


def list_thumbnails(session: Session, impacts: Sequence[int]) -> dict[int, list[float]]:
    """The 20 forces (N) of the pulse in use of each impact.

    Parameters:
        session: A session of the store.
        impacts: The keys of the impacts.

    Returns:
        The forces by the key of the impact; none for one without a pulse.
    """
    query = select(Pulse.impact_id, Pulse.force_points_n).where(
        Pulse.impact_id.in_(impacts), Pulse.current
    )
    return {impact: list(forces) for impact, forces in session.execute(query)}


def list_impacts_page(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    after: int | None,
    limit: int,
) -> tuple[Rows, int | None]:
    """One page of the listing of impacts.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which a row must meet.
        after: The key beyond which the page begins; None from the first.
        limit: The largest number of rows, 1 or more.

    Returns:
        At most `limit` rows as `iter_impacts` gives them, and the key that the next page goes on
        from; None on the last page.

    Raises:
        UnknownFieldError: As `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: For a limit below 1, and as `iter_impacts`.
    """
    _check_limit(limit)
    return _page(iter_impacts(session, campaign, where, limit + 1, after), limit)


def list_shots_page(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    after: int | None,
    limit: int,
) -> tuple[Rows, int | None]:
    """One page of the listing of shots.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which a row must meet.
        after: The key beyond which the page begins; None from the first.
        limit: The largest number of rows, 1 or more.

    Returns:
        At most `limit` rows as `iter_shots` gives them, and the key that the next page goes on
        from; None on the last page.

    Raises:
        UnknownFieldError: As `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: For a limit below 1, and as `iter_impacts`.
    """
    _check_limit(limit)
    return _page(iter_shots(session, campaign, where, limit + 1, after), limit)


def impacts_of_shots(session: Session, shots: Sequence[int]) -> dict[int, int]:
    """The impact of each of these shots that has one, by the shot's key.

    Parameters:
        session: A session of the store.
        shots: The keys of the shots, a page of them.
    """
    rows = session.execute(select(Shot.id, Shot.impact_id).where(Shot.id.in_(shots)))
    return {shot: impact for shot, impact in rows if impact is not None}


def _check_limit(limit: int) -> None:
    if limit < 1:
        raise ValueError(f"limit is {limit!r}; expected 1 or more rows")


def _page(rows: Iterator[dict[str, Any]], limit: int) -> tuple[Rows, int | None]:
    """One row more than asked for tells whether there is a next page."""
    page_rows = list(islice(rows, limit + 1))
    return page_rows[:limit], page_rows[limit - 1]["id"] if len(page_rows) > limit else None


def _labelled(columns: dict[str, Any]) -> list[Any]:
    return [column.label(name) for name, column in columns.items()]


class _Configurations:
    """Factors of configurations, each asked for once."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._known: dict[int, dict[str, Any]] = {}

    def learn(self, keys: set[int]) -> None:
        new = sorted(keys - self._known.keys())
        self._known |= {key: {} for key in new}
        for row in iter_levels(self._session, new):
            self._known[row.configuration][listing_key(row.factor, row.si_unit)] = row.level

    def __getitem__(self, key: int) -> dict[str, Any]:
        return self._known[key]


def worst_severities(session: Session, rows: list[dict[str, Any]]) -> dict[int, str]:
    """Worst severity per impact, where it is more than a note: of its own findings and its
    recording's.

    Parameters:
        session: A session of the store.
        rows: The `id` and the `recording_id` of each impact.

    Returns:
        "warning" or "reject" by the key of the impact, for those that have one.
    """
    recordings = sorted({row["recording_id"] for row in rows if row["recording_id"] is not None})
    columns = (QualityFinding.recording_id, QualityFinding.impact_id, QualityFinding.severity)
    doubts = select(*columns).where(QualityFinding.severity.in_(SEVERITIES[1:])).distinct()
    severities: defaultdict[tuple[int, int | None], set[str]] = defaultdict(set)
    for some in in_batches(recordings):
        for recording, impact, severity in session.execute(
            doubts.where(QualityFinding.recording_id.in_(some))
        ):
            severities[recording, impact].add(severity)
    worst: dict[int, str] = {}
    for row in rows:
        of_impact = (
            severities[row["recording_id"], row["id"]] | severities[row["recording_id"], None]
        )
        if of_impact:
            worst[row["id"]] = max(of_impact, key=SEVERITIES.index)
    return worst


__all__ = [
    "OPERATORS",
    "Condition",
    "UnknownFieldError",
    "get_campaign_id",
    "iter_impacts",
    "iter_shots",
    "list_campaigns",
    "list_impacts_page",
    "list_shots_page",
    "listing_key",
]


def list_pulses(
    session: Session,
    campaign: str | None,
    where: tuple[Condition, ...],
    most: int | None,
    columns: tuple[InstrumentedAttribute[Any], ...],
) -> tuple[Sequence[Row[Any]], int]:
    """The pulses in use of the impacts that match, in order of impacts, and how many match.

    Parameters:
        session: A session of the store.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which an impact must meet.
        most: The largest number of pulses, 1 or more; None for all. Where more match, the database
            takes them evenly over the order of impacts, the first one included.
        columns: What a row holds: columns of `Pulse` and `Impact`.

    Raises:
        UnknownFieldError: As `iter_impacts`.
        LookupError: As `iter_impacts`.
        ValueError: For fewer than one, and as `iter_impacts`.
    """
    if most is not None and most < 1:
        raise ValueError(f"most is {most!r}; expected 1 or more pulses")
    impact, pulse = Impact.__table__.c, Pulse.__table__.c
    with_channels = any(condition.field in CHANNEL_COLUMNS for condition in where)
    query = _pulses_in_use(columns, with_channels)
    query, find_span = restricted(session, query, Impact, IMPACT_COLUMNS, campaign, where)
    # Not by the session, which takes half as long again for rows of tables.
    connection = session.connection()
    if most is None:
        rows = connection.execute(query).all()
        return rows, len(rows)
    span = find_span()
    query = query.where(impact.id.between(span.first, span.last))
    # No more than fit between the first key and the last: a small store need not count.
    fits = span.last - span.first < most
    unordered = query.order_by(None)
    total = 0 if fits else connection.scalar(unordered.with_only_columns(func.count())) or 0
    if total <= most:
        rows = connection.execute(query).all()
        return rows, len(rows)
    numbered = unordered.with_only_columns(
        pulse.id,
        impact.id.label("impact"),
        (func.row_number().over(order_by=impact.id) - 1).label("place"),
    ).subquery()
    # Of `total` places these are as many as wanted: those where place * most / total has just
    # passed a whole number.
    chosen = select(numbered.c.id).where(numbered.c.place * most % total < most)
    keys = connection.scalars(chosen.order_by(numbered.c.impact).limit(most)).all()
    of_keys = _pulses_in_use(columns, with_channels=False)
    return [
        row
        for some in in_batches(keys)
        for row in connection.execute(of_keys.where(pulse.id.in_(some)))
    ], total


@cache
def _pulses_in_use(
    columns: tuple[InstrumentedAttribute[Any], ...], with_channels: bool
) -> Select[Any]:
    pulses = Impact.__table__.join(Pulse.__table__, IN_USE)
    if with_channels:
        pulses = pulses.outerjoin(ChannelFigures.__table__, LARGEST)
    # Of the tables: a row of the models' own columns takes several times as long.
    query = select(*(column.property.columns[0] for column in columns)).select_from(pulses)
    return query.order_by(Impact.__table__.c.id)
