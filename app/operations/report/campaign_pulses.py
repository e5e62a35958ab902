"""The pulses of a campaign on paper, by configuration with mean and spread, in the colours of the
factor that tells them apart best; and its shots, the measured velocity beside the nominal gun's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ....array_types import Floats
from ....schema.conditions import CAMPAIGN, IMPACT_COLUMNS, QUALITY
from ....schema.impacts import Impact, Pulse, Shot
from ....schema.listings import get_campaign_id, iter_impacts, iter_shots
from ...common.nominal_velocity import with_predictions
from ...common.number_format import signed_percent
from ...common.quantities import (
    cell,
    display_of,
    heading,
    level_words,
    named_level,
    settings_words,
    velocity_label,
    velocity_with_uncertainty,
)
from ...documents.document import (
    Block,
    Cell,
    ChartRow,
    Paragraph,
    Section,
    Table,
    mean_and_spread,
)
from ...figures.agreement import MOST_POINTS, agreement_plot
from ...figures.figure import (
    CATEGORIES,
    BandSeries,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    category,
)

_FIGURES = (
    "impact_velocity_m_s",
    "contact_time_s",
    "peak_force_n",
    "impulse_n_s",
    "peak_acceleration_m_s2",
)
#: Columns of a listing that are no factors.
_OTHERS = {*IMPACT_COLUMNS, CAMPAIGN, QUALITY, "velocity_kind"}


@dataclass(frozen=True, eq=False)
class PulseGroup:
    """The pulses of one configuration: `levels` by the keys of listings, `figures` by name (n,),
    NaN where unknown.

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
    """Groups in the order in which they were recorded. Impacts `rejected`, or `without` a pulse,
    are in none. `velocity` says what their velocities are (`quantities.velocity_label`)."""

    groups: tuple[PulseGroup, ...]
    rejected: int
    without: int
    velocity: str = "impact velocity"

    @property
    def varied(self) -> tuple[str, ...]:
        """Factors that did."""
        keys = dict.fromkeys(key for group in self.groups for key in group.levels)
        return tuple(
            key for key in keys if len({group.levels.get(key) for group in self.groups}) > 1
        )

    def label(self, group: PulseGroup) -> str:
        """A configuration by what tells it apart."""
        return settings_words({key: group.levels.get(key) for key in self.varied})


def pulses_of(session: Session, campaign: str) -> PulseGroups:
    """The pulses in use of a campaign. Raises `LookupError` for an unknown one."""
    members: dict[tuple[tuple[str, Any], ...], list[dict[str, Any]]] = {}
    kinds: set[str | None] = set()
    rejected = without = 0
    for row in iter_impacts(session, campaign):
        if row["contact_time_s"] is None:
            without += 1
        elif row["quality"] == "reject":
            rejected += 1
        else:
            kinds.add(row.get("velocity_kind"))
            levels = tuple((key, value) for key, value in row.items() if key not in _OTHERS)
            members.setdefault(levels, []).append({key: row[key] for key in ("id", *_FIGURES)})
    place = {
        row["id"]: (levels, i) for levels, rows in members.items() for i, row in enumerate(rows)
    }
    forces: dict[Any, list[Any]] = {levels: [None] * len(rows) for levels, rows in members.items()}
    for key, points in _force_points(session, get_campaign_id(session, campaign)):
        if key in place:
            levels, i = place[key]
            forces[levels][i] = points
    groups = tuple(
        _group(dict(levels), rows, np.array(forces[levels])) for levels, rows in members.items()
    )
    return PulseGroups(groups, rejected, without, velocity_label(kinds))


def _force_points(session: Session, campaign_id: int) -> Iterable[tuple[int, list[float]]]:
    query = select(Impact.id, Pulse.force_points_n).join(
        Pulse, (Pulse.impact_id == Impact.id) & Pulse.current
    )
    of_it = query.where(Impact.campaign_id == campaign_id).execution_options(yield_per=2000)
    return ((key, points) for key, points in session.execute(of_it))


def _group(levels: dict[str, Any], rows: Sequence[Mapping[str, Any]], forces: Floats) -> PulseGroup:
    figures = {key: np.array([row[key] for row in rows], dtype=np.float64) for key in _FIGURES}
    spread = forces.std(axis=0, ddof=1) if len(rows) > 1 else np.zeros(forces.shape[1])
    return PulseGroup(levels, figures, forces.mean(axis=0), spread)


#: Levels of the factor whose colours tell pulses apart: with the chart of all of them, two rows of
#: charts.
_MOST_CHARTED = 5


def telling_factor(pulses: PulseGroups) -> str | None:
    """Of the factors with few levels, the one that explains most of the peak forces."""
    peak = np.log(
        np.array([float(group.figures["peak_force_n"].mean()) for group in pulses.groups])
    )

    def unexplained(key: str) -> float:
        """The mean square within levels, by degrees of freedom: many levels explain much by
        chance."""
        level = np.array([str(group.levels.get(key)) for group in pulses.groups])
        levels = np.unique(level)
        squares = sum(
            float(((peak[level == group] - peak[level == group].mean()) ** 2).sum())
            for group in levels
        )
        return float(squares / max(peak.size - levels.size, 1))

    most = min(_MOST_CHARTED, len(pulses.groups) // 2)
    few = [
        key
        for key in pulses.varied
        if len({group.levels.get(key) for group in pulses.groups}) <= most
    ]
    return min(few, key=unexplained, default=None)


#: Configurations that a table lists: half a page of them.
_MOST_ROWS = 40


def pulses_section(pulses: PulseGroups, campaign: str) -> Section:
    """Figures by configuration, and their overlay."""
    title, blocks = "Pulses by configuration", list[Block]()
    if left_out := [
        f"{n} {what}"
        for n, what in ((pulses.rejected, "rejected"), (pulses.without, "without a pulse"))
        if n
    ]:
        blocks.append(
            Paragraph(f"Impacts that are left out: {' and '.join(left_out)}.", quiet=True)
        )
    if not pulses.groups:
        return Section(title, [Paragraph("The campaign has no pulse in use.", quiet=True), *blocks])
    blocks += [_table(pulses)]
    if (hidden := len(pulses.groups) - _MOST_ROWS) > 0:
        blocks.append(
            Paragraph(
                f"{hidden} further configurations are not listed here; pyroshock impacts "
                f"--campaign {campaign} lists all impacts.",
                quiet=True,
            )
        )
    blocks.append(_overlay(pulses))
    return Section(title, blocks)


def _table(pulses: PulseGroups) -> Table:
    shown = [
        key
        for key in _FIGURES
        if any(np.isfinite(group.figures[key]).any() for group in pulses.groups)
    ]
    rows: list[list[Cell]] = [
        [
            *(cell(key, group.levels.get(key)) for key in pulses.varied),
            len(group),
            *(mean_and_spread(key, group.figures[key]) for key in shown),
        ]
        for group in islice(pulses.groups, _MOST_ROWS)
    ]
    heads = [*map(heading, pulses.varied), "pulses", *(_heading(key, pulses) for key in shown)]
    repeated = any(len(group) > 1 for group in pulses.groups)
    caption = "Mean ± standard deviation over the pulses of a configuration."
    main = [*map(heading, pulses.varied[:2]), heading("peak_force_n")]
    main += (
        [] if repeated else [heading("contact_time_s")]
    )  # a column of spreads more would be too wide
    return Table(
        caption if repeated else "One pulse of each configuration.", heads, rows, main=main
    )


def _heading(key: str, pulses: PulseGroups) -> str:
    display = display_of(key)
    return (
        replace(display, label=pulses.velocity).heading
        if key == "impact_velocity_m_s"
        else display.heading
    )


def _overlay(pulses: PulseGroups) -> ChartRow:
    from ....training.evaluation.metrics import reconstruct

    few = len(pulses.groups) <= len(CATEGORIES)
    factor = None if few else telling_factor(pulses)
    levels = _levels(pulses, factor) if factor else []
    force, time = display_of("force_n"), display_of("time_s")
    x, y = PlotAxis(time.label, time.unit), PlotAxis(force.label, force.unit)
    curves, bands = list[LineSeries](), list[PlotSeries]()
    for number, group in enumerate(pulses.groups):
        fine = force.scale * reconstruct(np.stack([group.force_n, group.spread_n]), 200)
        level = group.levels.get(factor) if factor else None
        colour = number if few else levels.index(level) if factor else 0
        name = (
            pulses.label(group)
            if few
            else named_level(factor, level)
            if factor
            else "every configuration"
        )
        times = np.linspace(
            0.0, time.scale * float(group.figures["contact_time_s"].mean()), fine.shape[1]
        )
        role = category(colour)
        curves.append(LineSeries(name=name, role=role, x=times, y=fine[0]))
        if few and len(group) > 1:
            low, high = fine[0] - np.abs(fine[1]), fine[0] + np.abs(fine[1])
            bands.append(BandSeries(role=role, x=times, low=low, high=high, silent=True))
    is_single = len(pulses.groups) == 1
    title = (
        f"Mean pulses by {display_of(factor).label}" if factor else "Mean pulses by configuration"
    )
    title = "Mean pulse" if is_single else title
    title += ", with their standard deviation" if bands else ""
    if is_single:
        curves = [replace(curves[0], name="")]
    curves.sort(key=lambda curve: curve.role)
    figures = [Plot(title, x, y, (*bands, *curves))]
    if factor and len(levels) > 1:
        # soft tips give pulses that the scale of hard ones hides
        for number, level in enumerate(levels):
            words = named_level(factor, level)
            drawn = tuple(curve for curve in curves if curve.role == category(number))
            figures.append(Plot(words, x, y, drawn))
    return ChartRow(figures)


def _levels(pulses: PulseGroups, factor: str) -> list[Any]:
    """The levels of a factor: numbers by size, words by the peak forces of their pulses."""
    peaks: dict[Any, list[float]] = {}
    for group in pulses.groups:
        peaks.setdefault(group.levels.get(factor), []).append(float(group.force_n.max()))
    if all(isinstance(level, float) for level in peaks):
        return sorted(peaks)
    return sorted(peaks, key=lambda level: float(np.mean(peaks[level])))


#: Shots or settings that a table lists.
_MOST = 40
_PRESSURE, _MASS = "tank_pressure_pa", "bullet_mass_kg"
_MEASURED, _NOMINAL = "measured_velocity_m_s", "predicted_velocity_m_s"
_DEVIATION = "deviation (%)"

Shots = Sequence[dict[str, Any]]


def shots_of(session: Session, campaign: str) -> list[dict[str, Any]]:
    """The shots as `pyroshock shots` lists them, with `recorded_pressure_pa`: what the transducer
    recorded, or None.

    Raises `LookupError` for an unknown campaign.
    """
    query = select(Shot.id, Shot.recorded_pressure_pa).where(
        Shot.campaign_id == get_campaign_id(session, campaign)
    )
    recorded = dict(iter(session.execute(query)))
    rows = with_predictions(session, iter_shots(session, campaign))
    return [{**row, "recorded_pressure_pa": recorded[row["id"]]} for row in rows]


def shots_section(shots: Shots, campaign: str) -> Section:
    """Measured against nominal velocity: in a sentence, as a table by setting (of shots where none
    was repeated), and as a chart."""
    judged = [shot for shot in shots if _off(shot) is not None]
    settings = {(shot[_MASS], shot[_PRESSURE]) for shot in shots}
    repeated = len(settings) < len(shots)
    blocks: list[Block] = [Paragraph(_velocity_sentence(shots, judged), quiet=not judged)]
    if pressure := _pressure_sentence(shots):
        blocks.append(Paragraph(pressure))
    blocks.append(_by_setting(shots) if repeated else _by_shot(shots))
    if (hidden := (len(settings) if repeated else len(shots)) - _MOST) > 0:
        what = "settings" if repeated else "shots"
        text = (
            f"{hidden} further {what} are not listed here; pyroshock shots "
            f"--campaign {campaign} lists all shots."
        )
        blocks.append(Paragraph(text, quiet=True))
    if judged:
        blocks.append(_chart(judged))
    return Section("Shots: measured velocity against the nominal gun", blocks)


def _off(shot: dict[str, Any]) -> float | None:
    """Measured less nominal velocity, as a share of the nominal one."""
    measured, nominal = shot[_MEASURED], shot[_NOMINAL]
    return None if measured is None or not nominal else measured / nominal - 1


def _velocity_sentence(shots: Shots, judged: Shots) -> str:
    if not judged:
        return (
            f"None of the {len(shots)} shots has a measured velocity that a "
            f"nominal one can be compared with."
        )
    off = np.array([_off(shot) for shot in judged], dtype=np.float64)
    return (
        f"{len(judged)} of {len(shots)} shots have a measured velocity. It differs from that of "
        f"the nominal gun by {_deviation_words(off, judged)}."
    )


def _pressure_sentence(shots: Shots) -> str:
    """The transducer's pressure beside the one that was set; "" without a transducer."""
    recorded = [shot for shot in shots if shot["recorded_pressure_pa"] is not None]
    if not recorded:
        return ""
    off = np.array([shot["recorded_pressure_pa"] / shot[_PRESSURE] - 1 for shot in recorded])
    words = _deviation_words(off, recorded)
    return (
        f"The pressure that the transducer recorded differs from the one that was set by {words}."
    )


def _deviation_words(off: Floats, shots: Shots) -> str:
    at = int(np.argmax(np.abs(off)))
    where = f"run {shots[at]['run']}, repetition {shots[at]['repetition']}"
    return (
        f"{signed_percent(float(off.mean()))} on average and "
        f"{signed_percent(float(off[at]))} at most ({where})"
    )


def _chart(judged: Shots) -> ChartRow:
    masses = sorted({shot[_MASS] for shot in judged})
    groups = [
        (f"{level_words(_MASS, mass)} bullet", [s for s in judged if s[_MASS] == mass])
        for mass in masses
    ]
    groups = groups if 1 < len(groups) <= len(CATEGORIES) else [("", list(judged))]
    clouds = [
        PointSeries(
            name=name,
            role=category(number),
            opacity=0.8,
            x=_column(shots, _NOMINAL),
            y=_column(shots, _MEASURED),
            labels=tuple(f"run {shot['run']}, repetition {shot['repetition']}" for shot in shots),
        )
        for number, (name, shots) in enumerate(groups)
    ]
    title = "Measured against nominal velocity; the dashed lines are 5 % off"
    title += f"; {MOST_POINTS} of {len(judged)} shots" if len(judged) > MOST_POINTS else ""
    x, y = PlotAxis("nominal gun", "m/s"), PlotAxis("measured", "m/s")
    return ChartRow([agreement_plot(title, clouds, x, y, off=0.05)])


def _velocity_heads(*first: str) -> tuple[str, ...]:
    return (*first, "measured velocity (m/s)", "nominal gun (m/s)", _DEVIATION)


def _by_setting(shots: Shots) -> Table:
    groups: dict[tuple[float, float], list[dict[str, Any]]] = {}
    for shot in shots:
        groups.setdefault((shot[_MASS], shot[_PRESSURE]), []).append(shot)
    rows: list[list[Cell]] = []
    for (mass, pressure), members in sorted(groups.items())[:_MOST]:
        measured, nominal = _column(members, _MEASURED), _column(members, _NOMINAL)
        off = np.array([_off(shot) for shot in members], dtype=np.float64)
        settings = (cell(_MASS, mass), cell(_PRESSURE, pressure), len(members))
        velocities = (mean_and_spread(_MEASURED, measured), mean_and_spread(_NOMINAL, nominal))
        rows.append([*settings, *velocities, _deviation_cell(off)])
    heads = _velocity_heads(heading(_MASS), heading(_PRESSURE), "shots")
    main = (*heads[:2], heads[3], _DEVIATION)
    return Table("Mean ± standard deviation over the shots of a setting.", heads, rows, main=main)


def _by_shot(shots: Shots) -> Table:
    rows: list[list[Cell]] = []
    for shot in shots[:_MOST]:
        off = _off(shot)
        velocity = cell(_MEASURED, velocity_with_uncertainty(shot)[_MEASURED])
        settings = (
            shot["run"],
            shot["repetition"],
            cell(_MASS, shot[_MASS]),
            cell(_PRESSURE, shot[_PRESSURE]),
        )
        rows.append(
            [
                *settings,
                velocity,
                cell(_NOMINAL, shot[_NOMINAL]),
                _deviation_cell(np.array([off], dtype=float)),
            ]
        )
    heads = _velocity_heads("run", "repetition", heading(_MASS), heading(_PRESSURE))
    main = ("run", heads[3], heads[4], _DEVIATION)
    return Table(
        "Each shot, with the standard uncertainty of its velocity.", heads, rows, main=main
    )


def _deviation_cell(off: Floats) -> str | None:
    """The mean of shares in per cent, with a decimal."""
    finite_values = off[np.isfinite(off)]
    return (
        signed_percent(float(finite_values.mean())).removesuffix(" %")
        if finite_values.size
        else None
    )


def _column(shots: Shots, key: str) -> Floats:
    return np.array([shot[key] for shot in shots], dtype=np.float64)
