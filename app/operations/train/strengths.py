"""Where a model is good and where not: its error beside what repeated impacts of the bench differ
by, by material and by range of velocity, pressure and mass.

An error near the repeatability is the best that any model reaches. One of more than twice that is
the model's own fault, and is marked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ....array_types import Floats
from ....dataset.table import PulseTable, Texts
from ...common.number_format import format_number, join_words
from ...common.quantities import display_of
from ...figures.figure import (
    BarSeries,
    ColourRole,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    as_floats,
)
from ..operation import ResultTable
from ..sentence import Number, Sentence
from .wording import metric_cell, metric_number

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....training.registry.evaluate import Evaluation

#: From so many times the repeatability on, a model is said to be worse than the bench allows.
LIMIT = 2.0
_METRIC = "force_nrmse"
#: Numbers of an impact -> key of its unit; a range is a third of the pulses.
_RANGES = {
    "impact_velocity": "impact_velocity_m_s",
    "tank_pressure": "tank_pressure_pa",
    "impactor_mass": "bullet_mass_kg",
}
_RESAMPLES = 2000
#: A group that is told has so many pulses.
_FEWEST = 3
#: The group of no factor.
_ALL = "all pulses"


@dataclass(frozen=True)
class GroupError:
    """The mean force error of the pulses of a group, with its 90 % interval over configurations
    (None with a single one), and what their repetitions differ by (None where nothing was
    repeated)."""

    factor: str
    level: str
    pulses: int
    configurations: int
    error: float
    low: float | None
    high: float | None
    repeatability: float | None

    @property
    def name(self) -> str:
        """`tip: steel`."""
        return f"{self.factor}: {self.level}" if self.factor else self.level

    @property
    def ratio(self) -> float | None:
        """Error over repeatability."""
        return None if not self.repeatability else self.error / self.repeatability

    @property
    def is_worse(self) -> bool:
        """Whether the error is more than twice the repeatability."""
        return self.ratio is not None and self.ratio > LIMIT


def group_errors(
    judged: Evaluation, label: str, training: PulseTable, settings: Mapping[str, Floats]
) -> list[GroupError]:
    """The errors of a version by material and by range.

    Parameters:
        judged: The errors of the version on its held-out pulses.
        label: The version, such as "hybrid@3".
        training: The pulses that it learned from: they tell repetitions, too.
        settings: Numbers (n,) of the held-out pulses that are no predictors, such as
            `tank_pressure` in Pa; NaN where they are not known.
    """
    from ....training.evaluation.summary import clustered, positive_interval
    from ....training.models.training_task import rng_of

    pulses, errors = judged.pulses, judged.errors[label].force_nrmse
    floor = _repeatability(training, pulses)
    rng = rng_of("strengths", pulses.key[0], label, len(pulses))
    groups = []
    everything = {"": np.full(len(pulses), _ALL)}
    for factor, labels in {**everything, **_labels(pulses, settings)}.items():
        for level in dict.fromkeys(labels.tolist()):
            rows = labels == level
            if not level or (factor and rows.sum() < _FEWEST):
                continue
            clusters = clustered(errors[rows][:, None], pulses.configuration[rows])
            low, high = positive_interval(clusters, rng, _RESAMPLES)
            floors = floor[rows][np.isfinite(floor[rows])]
            bounded = bool(np.isfinite([low[0], high[0]]).all())
            groups.append(
                GroupError(
                    factor,
                    level,
                    int(rows.sum()),
                    len(clusters),
                    float(errors[rows].mean()),
                    float(low[0]) if bounded else None,
                    float(high[0]) if bounded else None,
                    float(floors.mean()) if floors.size else None,
                )
            )
    return groups


def _repeatability(training: PulseTable, held_out: PulseTable) -> Floats:
    """What each held-out pulse (n,) differs by from the repetitions of its configuration, else from
    the other impacts that the model cannot tell from it; NaN without any."""
    from ....training.evaluation.floor import SCOPES, repeatability_floor

    values = np.full(len(held_out), np.nan)
    for scope in SCOPES:
        try:
            floor = repeatability_floor(training, held_out, scope)
        except ValueError:  # nothing was repeated: there is nothing to hold the error against
            continue
        missing = ~np.isfinite(values[floor.rows])
        values[floor.rows[missing]] = floor.errors.force_nrmse[missing]
    return values


def _labels(pulses: PulseTable, settings: Mapping[str, Floats]) -> dict[str, Texts]:
    """Materials and ranges (n,) of the pulses, those with several levels only."""
    from ....training.evaluation.comparison import level_names

    named: dict[str, Texts] = {
        "tip": pulses.tip_material,
        "target": pulses.target_material,
    }
    named |= {
        predictor.name.replace("_", " "): level_names(pulses, predictor.name)
        for predictor in pulses.predictors
        if predictor.levels
    }
    numbers = {
        predictor.name: pulses.column(predictor.name)
        for predictor in pulses.predictors
        if predictor.name in _RANGES
    }
    for name, values in {**numbers, **settings}.items():
        if len(values) == len(pulses):
            named[display_of(_RANGES[name]).label] = _ranges(values, _RANGES[name])
    return {name: labels for name, labels in named.items() if len(set(labels.tolist()) - {""}) > 1}


def _ranges(values: Floats, key: str) -> Texts:
    """`2.1 to 4.3 m/s`: each value (n,) by thirds of them, its own number where there are three at
    most; "" where it is not known."""
    display = display_of(key)
    labels = np.full(len(values), "", dtype=object)
    stated = np.flatnonzero(np.isfinite(values))
    levels = np.unique(values[stated])
    if not levels.size:
        return labels.astype(np.str_)
    if len(levels) <= 3:
        groups = [stated[values[stated] == level] for level in levels]
    else:
        order = stated[np.argsort(values[stated], kind="stable")]
        cuts = np.quantile(values[stated], [1 / 3, 2 / 3])
        place = np.searchsorted(cuts, values[order])
        groups = [order[place == part] for part in range(3)]
    for rows in groups:
        if rows.size:
            ends = dict.fromkeys(
                format_number(display.scale * float(end), 3)
                for end in (values[rows].min(), values[rows].max())
            )
            labels[rows] = f"{' to '.join(ends)} {display.unit}".rstrip()
    return labels.astype(np.str_)


def settings_of_pulses(session: Session, pulse_ids: Sequence[int]) -> dict[str, Floats]:
    """The tank pressure (Pa) and the mass of the bullet (kg) of the shots of pulses, (n,) each; NaN
    where there is none."""
    from sqlalchemy import select

    from ....schema.impacts import Pulse, Shot

    query = (
        select(Pulse.id, Shot.tank_pressure_pa, Shot.bullet_mass_kg)
        .join(Shot, Shot.impact_id == Pulse.impact_id)
        .where(Pulse.id.in_(list(pulse_ids)))
    )
    shot_settings = {key: (pressure, mass) for key, pressure, mass in session.execute(query)}
    nothing = (None, None)
    pairs = [shot_settings.get(key, nothing) for key in pulse_ids]
    return {
        "tank_pressure": as_floats([pair[0] for pair in pairs]),
        "impactor_mass": as_floats([pair[1] for pair in pairs]),
    }


# --- figure, words, table


def strengths_figure(groups: Sequence[GroupError]) -> Plot:
    """The error of each group with its 90 % interval, over bars of once and twice the
    repeatability."""
    places = np.arange(len(groups), dtype=np.float64)
    floor = 100 * as_floats([own.repeatability for own in groups])
    series: list[PlotSeries] = []
    repeated = np.isfinite(floor)
    if repeated.any():
        for factor, name, opacity in (
            (LIMIT, "twice the repeatability", 0.35),
            (1.0, "repeatability of the bench", 0.9),
        ):
            series.append(
                BarSeries(
                    places[repeated],
                    factor * floor[repeated],
                    horizontal=True,
                    name=name,
                    role=ColourRole.NOISE,
                    opacity=opacity,
                )
            )
    for worse, name, role in (
        (False, "error of the model", ColourRole.CATEGORY_0),
        (True, "error of more than twice the repeatability", ColourRole.CATEGORY_1),
    ):
        chosen = [place for place, own in enumerate(groups) if own.is_worse == worse]
        if chosen:
            series.append(_points(groups, chosen, name, role))
    return Plot(
        "Error by material and range",
        PlotAxis("force error on held-out pulses", "%", from_zero=True),
        PlotAxis("", categories=tuple(own.name for own in groups), reversed=True),
        tuple(series),
        height=max(200.0, 110.0 + 26 * len(groups)),
    )


def _points(
    groups: Sequence[GroupError], chosen: Sequence[int], name: str, role: ColourRole
) -> PointSeries:
    rows = [groups[place] for place in chosen]
    mean = 100 * as_floats([own.error for own in rows])
    low, high = (
        100 * as_floats([own.error if end is None else end for own, end in ends])
        for ends in ([(own, own.low) for own in rows], [(own, own.high) for own in rows])
    )
    return PointSeries(
        mean,
        as_floats(chosen),
        x_low=np.minimum(low, mean),
        x_high=np.maximum(high, mean),
        size=9,
        labels=tuple(f"{own.pulses} pulses" for own in rows),
        name=name,
        role=role,
    )


def strength_sentences(label: str, groups: Sequence[GroupError]) -> Iterator[Sentence]:
    """Where the error is within twice the repeatability, and where it is larger."""
    judged = _judged(groups)
    if not judged:
        yield Sentence(
            "No impact was repeated, so that the error cannot be held against the repeatability."
        )
        return
    worse = sorted((own for own in judged if own.is_worse), key=lambda own: -float(own.ratio or 0))
    if not worse:
        yield Sentence(
            f"{label} errs by at most twice the repeatability of the bench in every group."
        )
        return
    good = len(judged) - len(worse)
    counts = [Number("groups", good, "count"), Number("groups", len(judged), "count")]
    named, numbers = _named(worse[:3])
    more = f", and {len(worse) - 3} more" if len(worse) > 3 else ""
    rest = [Number("groups", len(worse) - 3, "count")] if len(worse) > 3 else []
    yield Sentence(
        f"In {counts[0]} of {counts[1]} groups {label} errs by at most twice the repeatability of "
        f"the bench. It errs by more for {named}{more}.",
        [*counts, *numbers, *rest],
    )


def _judged(groups: Sequence[GroupError]) -> list[GroupError]:
    """Those that can be held against their repeatability: of the factors, else all pulses."""
    judged = [own for own in groups if own.ratio is not None]
    return [own for own in judged if own.factor] or judged


def _named(groups: Sequence[GroupError]) -> tuple[str, list[Number]]:
    parts, numbers = [], []
    for own in groups:
        error = metric_number(_METRIC, own.error)
        floor = metric_number(_METRIC, float(own.repeatability or math.nan))
        numbers += [error, floor]
        parts.append(f"{own.factor} {own.level} ({error} against {floor})".lstrip())
    return join_words(parts), numbers


def strength_tables(groups: Sequence[GroupError]) -> list[ResultTable]:
    """How many groups are within twice the repeatability, and every group."""
    judged = _judged(groups)
    worse = sum(own.is_worse for own in judged)
    counts = {
        "groups": len(judged),
        "within twice the repeatability": len(judged) - worse,
        "worse": worse,
        "worse beyond the first three": max(0, worse - 3),
    }
    rows = [
        {
            "group": own.name,
            "verdict": "–"
            if own.ratio is None
            else "worse than twice the repeatability"
            if own.is_worse
            else "within twice the repeatability",
            "force error": metric_cell(_METRIC, own.error),
            "from": metric_cell(_METRIC, own.low),
            "to": metric_cell(_METRIC, own.high),
            "repeatability": metric_cell(_METRIC, own.repeatability),
            "times the repeatability": "–"
            if own.ratio is None
            else Number("ratio", own.ratio, "ratio").cell,
            "pulses": own.pulses,
            "configurations": own.configurations,
        }
        for own in groups
    ]
    tables = [ResultTable("Groups", [counts])] if judged else []
    return [*tables, ResultTable("Force error by material and range, with 90 % intervals", rows)]
