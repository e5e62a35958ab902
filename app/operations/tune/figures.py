"""Figures of tuning: what is prescribed, and the expected spectra of the best settings in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ....array_types import Floats
from ....twin.srs.target import Target
from ....twin.tune.goal import Goal
from ....twin.tune.tuner import Tuned
from ...common.number_format import format_number, percent
from ...common.quantities import display_of
from ...figures.figure import (
    BandSeries,
    ColourRole,
    Dash,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    as_floats,
    category,
)
from ..impacts.four_coordinate_paper import paper_lines
from .bench_adapter import level_m_s2
from .verdict import (
    drawn_share,
    met_interval,
    met_probability,
    required_probability,
    short_words,
)

#: Proposals that are drawn.
_BEST = 3
#: A side without a limit is drawn as one so far away (dB).
_FAR_DB = 200.0


def target_figure(target: Target) -> Plot:
    """A prescribed spectrum with its tolerance on four-coordinate paper: pseudo-velocity over
    frequency, with lines of constant acceleration in g and of constant displacement. A side without
    a limit reaches the edge of the paper."""
    lines = np.union1d(
        np.geomspace(target.frequency_hz[0], target.frequency_hz[-1], 200), target.frequency_hz
    )
    dense, display = (
        target.at(lines.clip(target.frequency_hz[0], target.frequency_hz[-1])),
        display_of("level_m_s2"),
    )
    velocity = dense.level_m_s2 / (2 * np.pi * lines)
    edges = [
        velocity * 10 ** (side.clip(-_FAR_DB, _FAR_DB) / 20)
        for side in (-dense.lower_db, dense.upper_db)
    ]
    shown = [
        edge[np.isfinite(side)]
        for edge, side in zip(edges, (dense.lower_db, dense.upper_db), strict=True)
    ]
    finite_edges = np.concatenate([velocity, *shown])
    low = float(10 ** np.floor(np.log10(finite_edges.min())))
    high = float(10 ** np.ceil(np.log10(finite_edges.max())))
    ends_hz = float(lines[0]) / 1.1, float(lines[-1]) * 1.1
    paper, words = paper_lines(*ends_hz, low, high)
    levels = tuple(
        f"{format_number(level * display.scale, 3)} {display.unit}" for level in dense.level_m_s2
    )
    return Plot(
        "Specification",
        PlotAxis("natural frequency", "Hz", scale="log", limits=ends_hz),
        PlotAxis("pseudo-velocity", "m/s", scale="log", limits=(low, high)),
        (
            *paper,
            BandSeries(lines, *edges, name="tolerance", role=ColourRole.TOLERANCE),
            LineSeries(lines, velocity, labels=levels, name="prescribed"),
        ),
        labels=tuple(words),
        equal_decades=True,
    )


def choices_figure(tuning: Mapping[str, Any]) -> Plot:
    """The probability that each setting to choose from meets the target, with its 90 % interval
    from the draws, and what is required."""
    rows = tuning["proposals"]
    met = 100 * as_floats([drawn_share(met_probability(row, tuning)) for row in rows])
    low = high = met
    if draws := tuning.get("draws"):
        ends = [met_interval(met_probability(row, tuning), draws) for row in rows]
        low, high = (100 * as_floats([pair[side] for pair in ends]) for side in (0, 1))
    names = tuple(f"{row['rank']}: {short_words(row['settings'])}" for row in rows)
    points = PointSeries(
        met,
        np.arange(len(rows), dtype=np.float64),
        x_low=np.minimum(low, met),
        x_high=np.maximum(high, met),
        name="probability with its 90 % interval",
    )
    required = 100 * required_probability(tuning)
    return Plot(
        "Settings to choose from",
        PlotAxis("probability that the next shot meets the target", "%", limits=(0.0, 100.0)),
        PlotAxis("setting", categories=names, reversed=True),
        (points,),
        (ReferenceLine("x", required, "required"),),
        height=max(180.0, 110.0 + 34 * len(names)),
    )


@dataclass(frozen=True, eq=False)
class ProposedSpectrum:
    """What is expected of one setting, in m/s²: the mean and its 90 % band, (n,) each."""

    probability_within: float
    expected_m_s2: Floats
    lower_m_s2: Floats
    upper_m_s2: Floats


def tuned_figure(tuning: Mapping[str, Any]) -> Plot:
    """The first proposals in the tolerance of what is prescribed (`TunedSettings.job_data`)."""
    proposals = [
        ProposedSpectrum(
            row["probability_within"],
            *(as_floats(row[key]) for key in ("expected_m_s2", "lower_m_s2", "upper_m_s2")),
        )
        for row in tuning["proposals"][:_BEST]
    ]
    hz, prescribed, low, high = (
        as_floats(tuning[name])
        for name in ("frequency_hz", "prescribed_m_s2", "lower_m_s2", "upper_m_s2")
    )
    return _proposals_plot(hz, prescribed, low, high, proposals)


def goal_figure(tuned: Tuned, goal: Goal) -> Plot:
    """The same figure of a search that has just ended."""
    low, high = (
        level_m_s2(np.clip(edge, -_FAR_DB, 2 * _FAR_DB))
        for edge in (goal.level_db - goal.lower_db, goal.level_db + goal.upper_db)
    )
    proposals = [
        ProposedSpectrum(
            choice.proposal.probability_within,
            *(
                level_m_s2(db)
                for db in (
                    choice.proposal.level_db,
                    choice.proposal.lower_db,
                    choice.proposal.upper_db,
                )
            ),
        )
        for choice in tuned.choices[:_BEST]
    ]
    return _proposals_plot(goal.frequency_hz, level_m_s2(goal.level_db), low, high, proposals)


def _proposals_plot(
    frequency_hz: Floats,
    prescribed_m_s2: Floats,
    lower_m_s2: Floats,
    upper_m_s2: Floats,
    proposals: Sequence[ProposedSpectrum],
) -> Plot:
    display = display_of("level_m_s2")
    scale, hz, role = display.scale, frequency_hz, ColourRole.TOLERANCE
    series: list[PlotSeries] = [
        BandSeries(hz, scale * lower_m_s2, scale * upper_m_s2, name="tolerance", role=role),
        LineSeries(
            *(hz, scale * prescribed_m_s2, "dash"), name="prescribed", role=ColourRole.REFERENCE
        ),
    ]
    for i, proposal in enumerate(proposals):
        if i == 0:
            low, high = (scale * edge for edge in (proposal.lower_m_s2, proposal.upper_m_s2))
            name = "90 % of the first"
            series.append(BandSeries(hz, low, high, name=name, role=category(i)))
        name = f"proposal {i + 1}: {percent(drawn_share(proposal.probability_within))}"
        dash: Dash = "solid" if i == 0 else "dot"
        level = scale * proposal.expected_m_s2
        series.append(LineSeries(hz, level, dash, name=name, role=category(i)))
    shown = scale * prescribed_m_s2
    ends = float(0.3 * np.nanmin(shown)), float(5 * np.nanmax(shown))
    return Plot(
        "Expected spectra of the best settings",
        PlotAxis("natural frequency", "Hz", scale="log"),
        PlotAxis("maximax SRS", display.unit, scale="log", limits=ends),
        tuple(series),
    )
