"""Conditions of a listing, and its rows page by page, at a cost that follows what is listed and not
what is stored.

A condition on a column goes into the query; one on a factor is first turned into the configurations
that meet it.

A database that is asked for the first rows of a filter in order of their key either walks the keys,
which is slow where matches are rare, or collects and sorts every match, which is slow where they
are many; and it guesses which. So it is asked for a window of keys at a time: the windows begin at
the first key that can match, end at the last one, and widen or narrow until a window holds about a
page.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

from sqlalchemy import (
    BindParameter,
    ColumnElement,
    Integer,
    Row,
    Select,
    and_,
    bindparam,
    exists,
    func,
    not_,
    or_,
    select,
    text,
)
from sqlalchemy.orm import Session

from .campaigns import Campaign, Configuration, ConfigurationLevel, Factor, FactorLevel
from .impacts import ChannelFigures, Impact, Pulse, Shot
from .notes import IMPACT, Tag
from .recordings import NOT_JUDGED, SEVERITIES, QualityFinding

Table = type[Impact] | type[Shot]

#: The first page is small, for a caller who wants a few rows; each further one four times as large,
#: up to the limit.
_FIRST_ROWS, _GROWTH = 128, 4
#: A window without a match is followed by one this many times as wide.
_LEAP = 16


@dataclass(frozen=True)
class KeySpan:
    """Keys `first` to `last` hold every match; none when `last` < `first`."""

    first: int
    last: int

    def beyond(self, key: int | None) -> KeySpan:
        """The part of the span after a key.

        Parameters:
            key: The last key that is left out; None leaves out none.
        """
        return self if key is None else KeySpan(max(self.first, key + 1), self.last)


def span_of(
    session: Session, table: Table, campaign_id: int | None, configurations: list[int] | None
) -> KeySpan:
    """Where rows of a campaign with one of some configurations can lie.

    Two look-ups in an index for each configuration: asked for the least key of many, a database
    reads them all. And each in a query of its own within the one that is sent: of two in one, a
    database reads the whole table.

    Parameters:
        session: A session of the store.
        table: The class of the rows, `Impact` or `Shot`.
        campaign_id: The key of the campaign; None for all campaigns.
        configurations: The keys of the configurations; None for any.
    """
    query = _ends_of_keys(table, campaign_id is not None, configurations is not None)
    values = {"campaign": campaign_id, "configurations": configurations}
    first, last, *other = session.execute(query, values).one()
    span = _span(first, last)
    if configurations is None:
        return span
    of_them = _span(*other)
    return KeySpan(max(span.first, of_them.first), min(span.last, of_them.last))


@cache
def _ends_of_keys(table: Table, of_campaign: bool, of_configurations: bool) -> Select[Any]:
    """The least and the largest key of the rows of `campaign`, or of all; and of the rows of
    `configurations`."""
    rows, configurations = table.__table__.c, Configuration.__table__.c
    ends = [select(f(rows.id)) for f in (func.min, func.max)]
    if of_campaign:
        ends = [end.where(rows.campaign_id == bindparam("campaign")) for end in ends]
    query = select(*(end.scalar_subquery() for end in ends))
    if not of_configurations:
        return query
    of_one = [
        select(f(rows.id)).where(rows.configuration_id == configurations.id).scalar_subquery()
        for f in (func.min, func.max)
    ]
    return query.add_columns(func.min(of_one[0]), func.max(of_one[1])).where(
        configurations.id.in_(bindparam("configurations", expanding=True))
    )


def _span(first: int | None, last: int | None) -> KeySpan:
    return KeySpan(1, 0) if first is None or last is None else KeySpan(first, last)


def iter_pages(
    session: Session, query: Select[Any], key: Any, span: KeySpan, page: int
) -> Iterator[list[dict[str, Any]]]:
    """The query's rows in order of their key, a page at a time; no page is empty.

    Parameters:
        session: A session of the store.
        query: The select of the rows, without an order. It has the key as its column "id".
        key: The column of the key.
        span: The keys between which rows are looked for.
        page: The largest number of rows of a page. The first pages are smaller.
    """
    limit = min(_FIRST_ROWS, page)
    after, width = span.first - 1, 2 * limit
    while after < span.last:
        window = (
            query.where(key > after, key <= min(after + width, span.last))
            .order_by(key)
            .limit(limit)
        )
        rows = [dict(row) for row in session.execute(window).mappings()]
        if rows:
            yield rows
        end = rows[-1]["id"] if len(rows) == limit else after + width
        passed, after = end - after, end
        limit = min(_GROWTH * limit, page)
        width = min(_LEAP * width, 2 * limit * passed // len(rows)) if rows else _LEAP * width


OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "=": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}

#: The pulse in use of an impact, as its partial index has it: SQLAlchemy's own `current = 1` finds
#: no use for it in SQLite, and every pulse's row is read for its flag.
IN_USE = and_(Pulse.impact_id == Impact.id, text("pulses.current"))

#: The same of the acceleration channel with the largest peak.
LARGEST = and_(ChannelFigures.impact_id == Impact.id, text("channel_figures.largest"))

#: Figures of that channel in the listing of impacts.
CHANNEL_COLUMNS: dict[str, Any] = {
    "peak_acceleration_m_s2": ChannelFigures.peak_acceleration_m_s2,
    "pulse_duration_s": ChannelFigures.pulse_duration_s,
    "velocity_change_m_s": ChannelFigures.velocity_change_m_s,
}

IMPACT_COLUMNS: dict[str, Any] = {
    "id": Impact.id,
    "run": Impact.run,
    "repetition": Impact.repetition,
    "impact_velocity_m_s": Impact.impact_velocity_m_s,
    "contact_time_s": Pulse.contact_time_s,
    "peak_force_n": Pulse.peak_force_n,
    "impulse_n_s": Pulse.impulse_n_s,
    "compression_time_s": Pulse.compression_time_s,
    **CHANNEL_COLUMNS,
}
SHOT_COLUMNS: dict[str, Any] = {
    "id": Shot.id,
    "run": Shot.run,
    "repetition": Shot.repetition,
    "tank_pressure_pa": Shot.tank_pressure_pa,
    "bullet_mass_kg": Shot.bullet_mass_kg,
    "measured_velocity_m_s": Shot.measured_velocity_m_s,
    "measured_velocity_u_m_s": Shot.measured_velocity_u_m_s,
}

#: The listing of impacts has it beside those columns, from their findings: a note is no doubt.
QUALITY = "quality"
QUALITIES = ("ok", *SEVERITIES[1:], NOT_JUDGED)


#: Every listing has these; a tag of a shot is that of its impact.
CAMPAIGN, TAG = "campaign", "tag"


class ConditionError(ValueError):
    """A filter that cannot be read or used; the message says which one and what is expected."""


class UnknownFieldError(ConditionError):
    """A filter names no column and no factor; the message lists those there are."""


#: More configurations than these are looked up impact by impact, for they are no rare ones: each
#: costs two look-ups to tell where its impacts lie, and a statement takes no more than 65,535
#: values on PostgreSQL, 32,766 on SQLite.
_MOST_KEYS = 1_000


@dataclass(frozen=True)
class Condition:
    """`field operator value`: a column of the listing, or a factor (numbers in SI)."""

    field: str
    operator: str
    value: str | float


def restricted(
    session: Session,
    query: Select[Any],
    table: Table,
    columns: dict[str, Any],
    campaign: str | None,
    where: tuple[Condition, ...],
) -> tuple[Select[Any], Callable[[], KeySpan]]:
    """A query under a campaign and conditions, and a function that asks for the span of keys in
    which its rows lie.

    Parameters:
        session: A session of the store.
        query: The select of the rows.
        table: The class of the rows, `Impact` or `Shot`.
        columns: The columns of the listing by name, such as `IMPACT_COLUMNS`.
        campaign: The name of the campaign; None for all campaigns.
        where: Conditions, all of which a row must meet.

    Raises:
        UnknownFieldError: For a condition on neither a column nor a factor.
        ConditionError: For a column that is compared with a word, an operator other than = and !=
            for `quality`, `campaign` or `tag`, and an unknown quality.
        LookupError: For an unknown campaign.
    """
    rows = table.__table__.c
    campaign_id = None if campaign is None else get_campaign_id(session, campaign)
    if campaign_id is not None:
        query = query.where(rows.campaign_id == campaign_id)
    column_names = {*columns, CAMPAIGN, TAG, *([QUALITY] if table is Impact else [])}
    of_factors = [condition for condition in where if condition.field not in column_names]
    for condition in where:
        if condition.field == QUALITY and QUALITY in column_names:
            query = query.where(_of_quality(condition))
        elif condition.field == TAG:
            query = query.where(_has_tag(table, condition))
        elif condition.field == CAMPAIGN:
            query = query.where(_of_campaign(session, table, condition))
        elif condition.field in column_names:
            _refuse_word(condition)
            query = query.where(
                OPERATORS[condition.operator](columns[condition.field], condition.value)
            )
    if not of_factors:
        return query, partial(span_of, session, table, campaign_id, None)
    tests = [_LevelTest.of(condition) for condition in of_factors]
    # Few keys are known before the query: a database plans badly for those that it must find first.
    keys = _configurations(session, tests)
    if not keys:  # perhaps for want of a factor of this name
        tests = [test.of_known_factor(session, column_names) for test in tests]
        keys = _configurations(session, tests)
    if len(keys) <= _MOST_KEYS:
        query = query.where(rows.configuration_id.in_(keys))
        return query, partial(span_of, session, table, campaign_id, keys)
    query = query.where(
        *(rows.configuration_id.in_(test.selection(i)) for i, test in enumerate(tests))
    )
    return query, partial(span_of, session, table, campaign_id, None)


def _of_campaign(session: Session, table: Table, condition: Condition) -> ColumnElement[bool]:
    if condition.operator not in ("=", "!="):
        raise ConditionError(
            f"condition {CAMPAIGN}{condition.operator}{condition.value}; "
            f"expected = or != and a name"
        )
    matches: ColumnElement[bool] = OPERATORS[condition.operator](
        table.campaign_id, get_campaign_id(session, str(condition.value))
    )
    return matches


def _has_tag(table: Table, condition: Condition) -> ColumnElement[bool]:
    """Whether people have put a tag on the impact."""
    if condition.operator not in ("=", "!="):
        raise ConditionError(
            f"condition {TAG}{condition.operator}{condition.value}; expected = or != and a word"
        )
    tagged = exists().where(
        Tag.subject_kind == IMPACT,
        Tag.word == str(condition.value).casefold(),
        Tag.run == table.run,
        Tag.repetition == table.repetition,
        Tag.subject
        == select(Campaign.name).where(Campaign.id == table.campaign_id).scalar_subquery(),
    )
    return tagged if condition.operator == "=" else not_(tagged)


def _of_quality(condition: Condition) -> ColumnElement[bool]:
    """Of an impact's findings and its recording's, the gravest, as the listing has it; without a
    recording, none."""
    wanted = str(condition.value)
    if condition.operator not in ("=", "!=") or wanted not in QUALITIES:
        condition_text = f"{QUALITY}{condition.operator}{wanted}"
        raise ConditionError(
            f"condition {condition_text!r}; expected {QUALITY}= or "
            f"{QUALITY}!= one of {', '.join(QUALITIES)}"
        )
    graver = QUALITIES[QUALITIES.index(wanted) + 1 : -1]
    unsaid = [not_(_has_finding_of(*graver))] if graver else []
    if wanted == NOT_JUDGED:
        matches: ColumnElement[bool] = Impact.recording_id.is_(None)
    elif wanted == QUALITIES[0]:
        matches = and_(Impact.recording_id.is_not(None), *unsaid)
    else:
        matches = and_(_has_finding_of(wanted), *unsaid)
    return matches if condition.operator == "=" else not_(matches)


def _has_finding_of(*severities: str) -> ColumnElement[bool]:
    """Whether a finding of such a severity counts against an impact."""
    its_own = or_(QualityFinding.impact_id == Impact.id, QualityFinding.impact_id.is_(None))
    finding = exists().where(QualityFinding.recording_id == Impact.recording_id, its_own)
    return finding.where(QualityFinding.severity.in_(severities))


def _refuse_word(condition: Condition) -> None:
    """Every other column of a listing is a number: one database would find nothing equal to a word,
    another fail."""
    if isinstance(condition.value, str):
        raise ConditionError(
            f"{condition.field} is compared with {condition.value!r}; expected a number, in SI"
        )


def has_campaign(session: Session, name: str) -> bool:
    """Whether the store has a campaign of this name.

    Parameters:
        session: A session of the store.
        name: The name of the campaign.
    """
    return session.scalar(select(Campaign.id).where(Campaign.name == name)) is not None


def list_campaign_names(session: Session) -> list[str]:
    """Names of the newest 500 campaigns.

    Parameters:
        session: A session of the store.
    """
    return list(
        session.scalars(
            select(Campaign.name).order_by(Campaign.date.desc(), Campaign.name).limit(500)
        )
    )


def get_campaign_id(session: Session, name: str) -> int:
    """Key of a campaign.

    Parameters:
        session: A session of the store.
        name: The name of the campaign.

    Raises:
        LookupError: For an unknown campaign; the message names those there are.
    """
    key = session.scalar(select(Campaign.id).where(Campaign.name == name))
    if key is None:
        campaign_names = (
            ", ".join(session.scalars(select(Campaign.name).order_by(Campaign.name).limit(10)))
            or "none yet"
        )
        raise LookupError(f"no campaign {name!r} in the store; known: {campaign_names}")
    return key


@dataclass(frozen=True)
class _LevelTest:
    """A condition on the level of a factor, by the factor's name. `number` is the value where it is
    one, else None."""

    factor: str
    operator: str
    label: str
    number: float | None

    @classmethod
    def of(cls, condition: Condition) -> _LevelTest:
        try:
            number = float(condition.value)
        except ValueError:  # a level that is a text, such as a material
            number = None
        return cls(condition.field, condition.operator, str(condition.value), number)

    def of_known_factor(self, session: Session, columns: Collection[str]) -> _LevelTest:
        """The same of a factor that the store has, which may be named by its `listing_key`."""
        return replace(self, factor=_get_factor(session, self.factor, columns).name)

    @property
    def shape(self) -> tuple[str, bool]:
        return self.operator, self.number is not None

    def values(self, place: int) -> dict[str, Any]:
        """The parameters of `_selection` at a place."""
        number = 0.0 if self.number is None else self.number
        # SI numbers that came by different roads differ in the last digit: equality means to nine
        # digits.
        slack = 1e-9 * abs(number)
        values = {"factor": self.factor, "label": self.label, "number": number}
        values |= {"low": number - slack, "high": number + slack}
        return {f"{name}_{place}": value for name, value in values.items()}

    def selection(self, place: int) -> Select[Any]:
        return _selection(place, *self.shape).params(self.values(place))


@cache
def _selection(place: int, operator: str, is_number: bool) -> Select[Any]:
    """The configurations with such a level, of parameters that end in `place`."""

    def value(name: str) -> BindParameter[Any]:
        return bindparam(f"{name}_{place}")

    level, test = FactorLevel.__table__.c, OPERATORS[operator]
    matches: ColumnElement[bool] = test(level.label, value("label"))
    if is_number:
        near = level.number.between(value("low"), value("high"))
        exact = {"=": near, "!=": ~near}.get(operator)
        numeric = exact if exact is not None else test(level.number, value("number"))
        matches = (
            or_(numeric, and_(level.number.is_(None), matches)) if operator in "!=" else numeric
        )
    factors, levels_of_configurations = Factor.__table__.c, ConfigurationLevel.__table__.c
    factor = select(factors.id).where(factors.name == value("factor")).scalar_subquery()
    levels = select(level.id).where(level.factor_id == factor, matches)
    return select(levels_of_configurations.configuration_id).where(
        levels_of_configurations.level_id.in_(levels)
    )


@cache
def _meeting_all(shapes: tuple[tuple[str, bool], ...]) -> Select[Any]:
    """At most `most` configurations that meet tests of these shapes."""
    key = Configuration.__table__.c.id
    selections = (_selection(i, *shape) for i, shape in enumerate(shapes))
    query = select(key).where(*(key.in_(selection) for selection in selections))
    return query.limit(bindparam("most", type_=Integer))


def _configurations(session: Session, tests: list[_LevelTest]) -> list[int]:
    """Keys of the configurations that meet all tests; of more than `_MOST_KEYS`, one more than
    these."""
    values: dict[str, Any] = {"most": _MOST_KEYS + 1}
    for i, test in enumerate(tests):
        values |= test.values(i)
    query = _meeting_all(tuple(test.shape for test in tests))
    return sorted(session.connection().scalars(query, values))


def get_factor_id(session: Session, field: str, columns: Collection[str] = ()) -> int:
    """Key of a factor.

    Parameters:
        session: A session of the store.
        field: The name of the factor, or its `listing_key`.
        columns: Names of columns that the message of the error lists as well; by default none.

    Raises:
        UnknownFieldError: For an unknown factor; the message names those there are, and `columns`.
    """
    return int(_get_factor(session, field, columns).id)


def _get_factor(
    session: Session, field: str, columns: Collection[str]
) -> Row[int, str, str | None]:
    known_factors = session.execute(select(Factor.id, Factor.name, Factor.si_unit)).all()
    factors = {listing_key(row.name, row.si_unit): row for row in known_factors}
    factors |= {row.name: row for row in known_factors}
    if field not in factors:
        names = ", ".join(sorted({*factors, *columns}))
        raise UnknownFieldError(f"no column or factor {field!r}; known: {names}")
    return factors[field]


def listing_key(name: str, si_unit: str | None) -> str:
    """The key under which a factor appears in a listing: `tip_radius` in `m` is `tip_radius_m`.

    Parameters:
        name: The name of the factor as it is stored.
        si_unit: Its SI unit; None for a factor whose levels are words or numbers without a unit.
    """
    return f"{name}_{si_unit.replace('/', '_').lower()}" if si_unit else name
