"""Some columns of many rows: impacts, shots, and what acceleration channels recorded of impacts.

A listing gives whole rows, a page at a time. A chart needs two or three quantities of every row, so
they are read here by column: a hundred thousand impacts take half a second.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

from sqlalchemy import ColumnElement, Select, Table, and_, case, func, select
from sqlalchemy.orm import Session

from .base import in_batches
from .benches import Hammer
from .campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from .conditions import (
    CAMPAIGN,
    IMPACT_COLUMNS,
    IN_USE,
    LARGEST,
    QUALITY,
    SHOT_COLUMNS,
    Condition,
    get_factor_id,
    listing_key,
    restricted,
)
from .impacts import ChannelFigures, Impact, Pulse, Shot, velocity_kind
from .listings import worst_severities
from .recordings import NOT_JUDGED, QualityFinding, RecordedChannel

#: ISO 80000-3.
_GRAVITY_M_S2 = 9.80665

#: Of rows by column: each column has a value for each row, None where there is none.
Columns = dict[str, list[Any]]

_impacts, _pulses, _figures, _channels, _shots, _hammers, _campaigns = (
    cast("Table", model.__table__)
    for model in (Impact, Pulse, ChannelFigures, RecordedChannel, Shot, Hammer, Campaign)
)


class _Stored(NamedTuple):
    """A column, and the table beside the rows' own that it needs."""

    expression: ColumnElement[Any]
    of: Table | None = None


def _of(table: Table, *names: str, own: bool = False) -> dict[str, _Stored]:
    return {name: _Stored(table.c[name], None if own else table) for name in names}


_PULSE = _of(
    _pulses,
    *("contact_time_s", "peak_force_n", "impulse_n_s", "compression_time_s"),
    *("compression_impulse_n_s", "spline_peak_force_n", "width_half_s", "width_tenth_s"),
    *("samples_in_contact", "spline_nrmse", "segmentation_difference"),
)
_FIGURE_NAMES = (
    *("peak_acceleration_m_s2", "pulse_duration_s", "velocity_change_m_s"),
    *("effective_duration_s", "energy_duration_s", "record_velocity_change_m_s"),
    *("rest_m_s2", "srs_peak_m_s2", "srs_peak_frequency_hz"),
)
_IMPACT = {
    **_of(_impacts, "id", "run", "repetition", "impact_velocity_m_s", own=True),
    **_of(_impacts, "impact_velocity_u_m_s", own=True),
}
_SHOT_NAMES = (
    *("tank_pressure_pa", "recorded_pressure_pa", "bullet_mass_kg", "bullet_length_m"),
    *("measured_velocity_m_s", "measured_velocity_u_m_s"),
)
#: What an impact was made with, where its campaign or its shot says so.
_BENCH = {
    "hammer_mass_kg": _Stored(_hammers.c.mass_kg, _hammers),
    **_of(_shots, "tank_pressure_pa", "bullet_mass_kg", "measured_velocity_m_s"),
}
#: The full scale in SI, of the units that accelerometers are described in.
_FULL_SCALE_M_S2 = case(
    (_channels.c.unit == "g", _channels.c.full_scale * _GRAVITY_M_S2),
    (_channels.c.unit.in_(("m/s2", "m/s²", "m/s^2")), _channels.c.full_scale),
    else_=None,
)
_CHANNEL = {
    "sampling_rate_hz": _Stored(_channels.c.sampling_rate_hz),
    "duration_s": _Stored(_channels.c.samples / _channels.c.sampling_rate_hz),
    "share_of_full_scale": _Stored(_figures.c.peak_acceleration_m_s2 / _FULL_SCALE_M_S2),
}
#: Words of a channel.
_CHANNEL_WORDS = {
    "channel": _Stored(_channels.c.name),
    "position": _Stored(_channels.c.position),
    "axis": _Stored(_channels.c.axis),
}
_SHOT_OF_IMPACT = and_(
    _shots.c.campaign_id == _impacts.c.campaign_id,
    _shots.c.run == _impacts.c.run,
    _shots.c.repetition == _impacts.c.repetition,
)


@dataclass(frozen=True)
class RowKind:
    """Rows of one kind: `numbers` and `words` are the columns that they have beside their factors,
    each with the table that it needs; `computed` are the words that follow from several rows."""

    table: type[Impact] | type[Shot]
    numbers: dict[str, _Stored]
    words: dict[str, _Stored]
    computed: tuple[str, ...]

    def names(self) -> tuple[str, ...]:
        """All columns but the factors."""
        return (*self.numbers, *self.words, *self.computed)


VELOCITY_KIND, FINDINGS = "velocity_kind", "findings"
KINDS: dict[str, RowKind] = {
    "impacts": RowKind(
        Impact,
        {**_IMPACT, **_PULSE, **_of(_figures, *_FIGURE_NAMES), **_BENCH},
        {},
        (CAMPAIGN, QUALITY, VELOCITY_KIND, FINDINGS),
    ),
    "shots": RowKind(
        Shot,
        _of(_shots, "id", "run", "repetition", "impact_id", *_SHOT_NAMES, own=True),
        {},
        (CAMPAIGN, VELOCITY_KIND),
    ),
    "channels": RowKind(
        Impact,
        {**_of(_figures, *_FIGURE_NAMES, own=True), **_CHANNEL, **_IMPACT, **_PULSE, **_BENCH},
        _CHANNEL_WORDS,
        (CAMPAIGN, QUALITY, VELOCITY_KIND, FINDINGS),
    ),
}
#: Columns by which a row is known; every answer has them.
KEYS = ("id", "campaign_id", "run", "repetition", "configuration_id")


def factor_keys(session: Session) -> dict[str, str]:
    """The factors of the store.

    Parameters:
        session: A session of the store.

    Returns:
        The name of each factor by its key in a listing, in the order in which they were stored.
    """
    query = select(Factor.name, Factor.si_unit).order_by(Factor.id)
    return {listing_key(name, si_unit): name for name, si_unit in session.execute(query)}


def read_columns(
    session: Session,
    kind: str,
    names: Sequence[str],
    campaign: str | None = None,
    where: tuple[Condition, ...] = (),
    channel: str | None = None,
) -> Columns:
    """Columns of all rows that match.

    Parameters:
        session: A session of the store.
        kind: "impacts", "shots" or "channels".
        names: The columns: those of the kind, and factors by name or by key in a listing.
        campaign: The name of the campaign; by default (None) all campaigns.
        where: Conditions, all of which a row must meet; of a channel, its impact. They may be on
            each column of numbers of the kind, on factors, and on `quality` and `campaign`.
        channel: The name of the channel whose rows are read; by default (None) all channels.

    Returns:
        The columns of `names` and those of `KEYS`, in the order of the keys of impacts or shots. Of
        a channel, `id` is its impact's.

    Raises:
        UnknownFieldError: For a condition on nothing known, and a column that there is not.
        ConditionError: For a column of numbers that is compared with a word.
        LookupError: For an unknown campaign.
    """
    of_kind = KINDS[kind]
    table = cast("Table", of_kind.table.__table__)
    stored = of_kind.numbers | of_kind.words
    chosen = {name: stored[name] for name in names if name in stored}
    known_factors = factor_keys(session)
    factors = {
        name: get_factor_id(session, name, of_kind.names())
        for name in names
        if name in known_factors or (name not in chosen and name not in of_kind.computed)
    }
    more = [table.c.recording_id.label("recording_id"), table.c.velocity_source]
    expressions = [stored_column.expression.label(name) for name, stored_column in chosen.items()]
    # a column that is chosen and a key is asked for once
    keys = [table.c[name].label(name) for name in KEYS if name not in chosen]
    conditions = _condition_columns(of_kind, known_factors)
    conditioned = [conditions[c.field] for c in where if c.field in conditions]
    query = _joined(kind, select(*expressions, *keys, *more), [*chosen.values(), *conditioned])
    if channel is not None:
        query = query.where(_channels.c.name == channel)
    columns = {name: column.expression for name, column in conditions.items()}
    query, _ = restricted(session, query, of_kind.table, columns, campaign, where)
    order = [table.c.id] if kind != "channels" else [table.c.id, _channels.c.name]
    rows = session.connection().execute(query.order_by(*order)).all()
    labels = [*chosen, *(name for name in KEYS if name not in chosen), "recording_id", "source"]
    values: Columns = {name: [] for name in labels}
    values |= {
        name: list(part) for name, part in zip(labels, zip(*rows, strict=True), strict=False)
    }
    for name, factor in factors.items():
        levels = _levels(session, factor)
        of_configurations = [levels.get(key) for key in values["configuration_id"]]
        values[name] = [
            level if value is None else value
            for value, level in zip(
                values.get(name, of_configurations), of_configurations, strict=True
            )
        ]
    _compute(session, values, [name for name in names if name in of_kind.computed])
    return {name: values[name] for name in dict.fromkeys((*names, *KEYS))}


def _condition_columns(of_kind: RowKind, factors: Collection[str]) -> dict[str, _Stored]:
    """The columns that conditions are on. A key that a listing gives to a factor is the factor
    here, too."""
    listed = SHOT_COLUMNS if of_kind.table is Shot else IMPACT_COLUMNS
    return {
        name: column
        for name, column in of_kind.numbers.items()
        if name in listed or name not in factors
    }


def _joined(kind: str, query: Select[Any], needed: Sequence[_Stored]) -> Select[Any]:
    """The rows of a kind with those tables beside them that columns need."""
    if kind == "shots":
        return query.select_from(_shots)
    tables = {column.of for column in needed}
    parts: Any = _impacts
    if kind == "channels":
        parts = _figures.join(_impacts, _figures.c.impact_id == _impacts.c.id).join(
            _channels, _figures.c.channel_id == _channels.c.id
        )
    if _pulses in tables:
        parts = parts.outerjoin(_pulses, IN_USE)
    if _figures in tables:
        parts = parts.outerjoin(_figures, LARGEST)
    if _shots in tables:
        parts = parts.outerjoin(_shots, _SHOT_OF_IMPACT)
    if _hammers in tables:
        parts = parts.join(_campaigns, _impacts.c.campaign_id == _campaigns.c.id)
        parts = parts.outerjoin(_hammers, _campaigns.c.hammer_id == _hammers.c.id)
    return query.select_from(parts)


def _levels(session: Session, factor: int) -> dict[int, float | str]:
    """The level of a factor by configuration: a number in SI, or a word."""
    query = (
        select(ConfigurationLevel.configuration_id, FactorLevel.number, FactorLevel.label)
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .where(FactorLevel.factor_id == factor)
    )
    return {
        key: label if number is None else number for key, number, label in session.execute(query)
    }


def _compute(session: Session, values: Columns, names: Sequence[str]) -> None:
    """Adds columns that follow from several rows."""
    if CAMPAIGN in names:
        campaign_names = campaign_facts(session)
        values[CAMPAIGN] = [campaign_names[key][1] for key in values["campaign_id"]]
    if VELOCITY_KIND in names:
        values[VELOCITY_KIND] = [velocity_kind(source) for source in values["source"]]
    if QUALITY in names:
        rows = _finding_rows(values)
        worst = worst_severities(session, rows)
        values[QUALITY] = [
            NOT_JUDGED if row["recording_id"] is None else worst.get(row["id"], "ok")
            for row in rows
        ]
    if FINDINGS in names:
        rows = _finding_rows(values)
        counts = _finding_counts(session, rows)
        values[FINDINGS] = [
            None
            if row["recording_id"] is None
            else counts[row["recording_id"], row["id"]] + counts[row["recording_id"], None]
            for row in rows
        ]


def _finding_rows(values: Columns) -> list[dict[str, Any]]:
    return [
        {"id": key, "recording_id": recording}
        for key, recording in zip(values["id"], values["recording_id"], strict=True)
    ]


def _finding_counts(
    session: Session, rows: Sequence[dict[str, Any]]
) -> defaultdict[tuple[int, int | None], int]:
    """Findings of every severity by recording and impact; None of the recording as a whole."""
    counts: defaultdict[tuple[int, int | None], int] = defaultdict(int)
    recordings = sorted({row["recording_id"] for row in rows if row["recording_id"] is not None})
    by = (QualityFinding.recording_id, QualityFinding.impact_id)
    for keys in in_batches(recordings):
        query = select(*by, func.count()).where(QualityFinding.recording_id.in_(keys))
        for recording, impact, count in session.execute(query.group_by(*by)):
            counts[recording, impact] = count
    return counts


def campaign_facts(session: Session) -> dict[int, tuple[str, str]]:
    """What the order of recording and a column of names need of every campaign.

    Parameters:
        session: A session of the store.

    Returns:
        The date (ISO 8601) and the name by the campaign's key.
    """
    query = select(Campaign.id, Campaign.date, Campaign.name)
    return {key: (date.isoformat(), name) for key, date, name in session.execute(query)}
