"""The pulses of a campaign by configuration, and the factor that tells them apart best."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...schema.impacts import Impact, Pulse
from ...schema.listings import get_campaign_id, iter_impacts
from .labels import settings_words
from .line_styles import SERIES

#: Columns of a listing that are no factors.
_FIGURES = ("impact_velocity_m_s", "contact_time_s", "peak_force_n", "impulse_n_s", "compression_time_s")
_OTHERS = ("id", "campaign", "run", "repetition", "quality", *_FIGURES)


@dataclass(frozen=True, eq=False)
class PulseGroup:
    """The pulses of one configuration: `levels` by the keys of listings, `figures` by name (n,), NaN where unknown.

    `force_n` and `spread_n` (p,) are mean and standard deviation at equal shares of the contact.
    """

    levels: Mapping[str, Any]
    figures: Mapping[str, Floats]
    force_n: Floats
    spread_n: Floats

    def __len__(self) -> int:
        return len(self.figures["contact_time_s"])


@dataclass(frozen=True, eq=False)
class PulseGroups:
    """Groups in the order in which they were recorded. Impacts `rejected`, or `without` a pulse, are in none."""

    groups: tuple[PulseGroup, ...]
    rejected: int
    without: int

    @property
    def common(self) -> dict[str, Any]:
        """Levels that never changed."""
        return {key: level for key, level in self._levels(0).items() if key not in self.varied}

    @property
    def varied(self) -> tuple[str, ...]:
        """Factors that did."""
        keys = dict.fromkeys(key for group in self.groups for key in group.levels)
        return tuple(key for key in keys if len({group.levels.get(key) for group in self.groups}) > 1)

    def label(self, group: PulseGroup) -> str:
        """A configuration by what tells it apart."""
        return settings_words({key: group.levels.get(key) for key in self.varied})

    def _levels(self, index: int) -> Mapping[str, Any]:
        return self.groups[index].levels if self.groups else {}


def pulses_of(session: Session, campaign: str) -> PulseGroups:
    """The pulses in use of a campaign. Raises `LookupError` for an unknown one."""
    members: dict[tuple[tuple[str, Any], ...], list[dict[str, Any]]] = {}
    rejected = without = 0
    for row in iter_impacts(session, campaign):
        if row["contact_time_s"] is None:
            without += 1
        elif row["quality"] == "reject":
            rejected += 1
        else:
            levels = tuple((key, value) for key, value in row.items() if key not in _OTHERS)
            members.setdefault(levels, []).append({key: row[key] for key in ("id", *_FIGURES)})
    place = {row["id"]: (levels, i) for levels, rows in members.items() for i, row in enumerate(rows)}
    forces: dict[Any, list[Any]] = {levels: [None] * len(rows) for levels, rows in members.items()}
    for key, points in _force_points(session, get_campaign_id(session, campaign)):
        if key in place:
            levels, i = place[key]
            forces[levels][i] = points
    groups = tuple(_group(dict(levels), rows, np.array(forces[levels])) for levels, rows in members.items())
    return PulseGroups(groups, rejected, without)


def _force_points(session: Session, campaign_id: int) -> Iterable[tuple[int, list[float]]]:
    query = select(Impact.id, Pulse.force_points_n).join(Pulse, (Pulse.impact_id == Impact.id) & Pulse.current)
    of_it = query.where(Impact.campaign_id == campaign_id).execution_options(yield_per=2000)
    return ((key, points) for key, points in session.execute(of_it))


def _group(levels: dict[str, Any], rows: Sequence[Mapping[str, Any]], forces: Floats) -> PulseGroup:
    figures = {key: np.array([row[key] for row in rows], dtype=np.float64) for key in _FIGURES}
    spread = forces.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(forces.shape[1])
    return PulseGroup(levels, figures, forces.mean(axis=0), spread)


def telling_factor(pulses: PulseGroups) -> str | None:
    """Of the factors with few levels (there are so many colours), the one that explains most of the peak forces."""
    peak = np.log(np.array([float(group.figures["peak_force_n"].mean()) for group in pulses.groups]))

    def unexplained(key: str) -> float:
        """The mean square within levels, by degrees of freedom: many levels explain much by chance."""
        level = np.array([str(group.levels.get(key)) for group in pulses.groups])
        levels = np.unique(level)
        squares = sum(float(((peak[level == group] - peak[level == group].mean()) ** 2).sum()) for group in levels)
        return float(squares / max(peak.size - levels.size, 1))

    most = min(SERIES, len(pulses.groups) // 2)
    few = [key for key in pulses.varied if len({group.levels.get(key) for group in pulses.groups}) <= most]
    return min(few, key=unexplained, default=None)
