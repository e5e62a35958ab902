"""Impacts and shots as DataFrames: one query for the rows, one for the factors, one for the findings.

The listing of the command line goes page by page and row by row (`schema.listings`); a frame is made of whole columns,
with the same names, order and values.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from ...schema.campaigns import Campaign, ConfigurationLevel, Factor, FactorLevel
from ...schema.conditions import CHANNEL_COLUMNS, IMPACT_COLUMNS, IN_USE, LARGEST, listing_key, restricted
from ...schema.impacts import ChannelFigures, Impact, Pulse, velocity_kind
from ...schema.recordings import NOT_JUDGED, SEVERITIES, QualityFinding
from ..filters import parse_where
from .frames import with_units

if TYPE_CHECKING:
    import pandas as pd
    from sqlalchemy.orm import Session

#: Before the factors, and behind them, in the order of the listing.
_FIRST = ("id", "campaign", "run", "repetition")
_FIGURES = ("contact_time_s", "peak_force_n", "impulse_n_s", "compression_time_s")


def impacts_frame(
    session: Session, campaign: str | None = None, where: str | Iterable[str] = (), limit: int | None = None
) -> pd.DataFrame:
    """The rows of `pyroshock impacts`, in order of their key; a factor that an impact does not have is missing there.

    Raises as `schema.listings.iter_impacts`.
    """
    import numpy as np
    import pandas as pd

    conditions = parse_where((where,) if isinstance(where, str) else tuple(where))
    columns = {
        "campaign": Campaign.name,
        "configuration": Impact.configuration_id,
        "recording": Impact.recording_id,
        "source": Impact.velocity_source,
        **IMPACT_COLUMNS,
    }
    query = select(*(column.label(name) for name, column in columns.items())).select_from(Impact)
    query = query.join(Campaign, Impact.campaign_id == Campaign.id)
    query = query.outerjoin(Pulse, IN_USE).outerjoin(ChannelFigures, LARGEST)
    query, _ = restricted(session, query, Impact, IMPACT_COLUMNS, campaign, conditions)
    rows = _read(session, query.order_by(Impact.id).limit(limit))
    # Where no impact has a figure, pandas would make a column of objects.
    figures = ("impact_velocity_m_s", *_FIGURES, *CHANNEL_COLUMNS)
    rows = rows.astype(dict.fromkeys(figures, "float64"))
    factors = _factors(session, np.unique(rows["configuration"].to_numpy()))
    kinds = {source: velocity_kind(source) for source in rows["source"].dropna().unique()}
    quality = _quality(session, rows)
    parts: list[pd.DataFrame] = [
        rows[list(_FIRST)],
        factors.take(factors.index.get_indexer(pd.Index(rows["configuration"]))).set_axis(rows.index),
        rows[["impact_velocity_m_s"]].assign(velocity_kind=rows["source"].map(kinds)),
        rows[list(_FIGURES)].assign(quality=quality),
        rows[list(CHANNEL_COLUMNS)],
    ]
    return with_units(pd.concat(parts, axis=1))


def with_absent_factors(session: Session, frame: pd.DataFrame, names: Iterable[str]) -> pd.DataFrame:
    """The frame with an empty column for each of `names` that is a factor of the store but of none of its impacts."""
    missing = set(names) - set(frame.columns)
    if not missing:
        return frame
    factor_keys = {listing_key(name, si_unit) for name, si_unit in session.execute(select(Factor.name, Factor.si_unit))}
    return frame.assign(**dict.fromkeys(sorted(missing & factor_keys), float("nan")))


def _read(session: Session, query: Any) -> pd.DataFrame:
    import pandas as pd

    return pd.read_sql(query, session.connection())


def _factors(session: Session, configurations: Any) -> pd.DataFrame:
    """Levels by configuration (rows) and factor (columns, in the order of their keys)."""
    import pandas as pd

    query = (
        select(
            ConfigurationLevel.configuration_id, Factor.id, Factor.name, Factor.si_unit, FactorLevel.label,
            FactorLevel.number,
        )
        .join(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .join(Factor, FactorLevel.factor_id == Factor.id)
    )  # fmt: skip
    # A long list of keys costs more than the few configurations of other campaigns.
    keys = {int(key) for key in configurations}
    if len(keys) <= 500:
        query = query.where(ConfigurationLevel.configuration_id.in_(keys))
    columns: dict[tuple[int, str], dict[int, Any]] = {}
    for configuration, factor, name, si_unit, label, number in session.execute(query):
        if configuration in keys:
            level = label if number is None else number
            columns.setdefault((factor, listing_key(name, si_unit)), {})[configuration] = level
    index = pd.Index(configurations)
    return pd.DataFrame(
        {key: pd.Series(levels).reindex(index) for (_, key), levels in sorted(columns.items())}, index=index
    )


def _quality(session: Session, rows: pd.DataFrame) -> pd.Series[str]:
    """The worst severity of each impact's own findings and its recording's, where it is more than a note."""
    import pandas as pd

    doubts = SEVERITIES[1:]
    query = select(QualityFinding.recording_id, QualityFinding.impact_id, QualityFinding.severity)
    findings = _read(session, query.where(QualityFinding.severity.in_(doubts)).distinct())
    rank = findings["severity"].map({severity: number for number, severity in enumerate(doubts, start=1)})
    whole = findings["impact_id"].isna()
    of_recording = rank[whole].groupby(findings["recording_id"][whole]).max()
    of_impact = rank[~whole].groupby(findings["impact_id"][~whole]).max()
    worst = pd.concat([rows["recording"].map(of_recording), rows["id"].map(of_impact)], axis=1).max(axis=1)
    quality = worst.fillna(0).map(dict(enumerate(("ok", *doubts)))).astype(object)
    return quality.where(rows["recording"].notna(), NOT_JUDGED)
