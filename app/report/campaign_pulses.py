"""The pulses of a campaign on paper, by configuration with mean and spread, in the colours of the factor that tells
them apart best; and its shots, the measured velocity beside the nominal gun's."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...schema.impacts import Impact, Pulse
from ...schema.listings import get_campaign_id, iter_impacts, iter_shots
from ..common.nominal_velocity import with_predictions
from ..documents.document import (
    Block,
    Cell,
    ChartRow,
    Figure,
    Paragraph,
    Section,
    Table,
    force_unit,
    mean_and_spread,
    setting,
    settings_words,
)
from ..documents.line_styles import SERIES
from ..documents.svg import MOST_POINTS, Cloud, Curve, agreement_chart, dot_keys, line_chart, line_keys

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


#: Configurations that a table lists.
_MOST_ROWS = 300


def pulses_section(pulses: PulseGroups) -> Section:
    """Figures by configuration, and their overlay."""
    blocks: list[Block] = []
    if left_out := [
        f"{n} {what}" for n, what in ((pulses.rejected, "rejected"), (pulses.without, "without a pulse")) if n
    ]:
        blocks.append(Paragraph(f"Left out: {' and '.join(left_out)}.", quiet=True))
    if not pulses.groups:
        return Section("Pulses by configuration", [Paragraph("No pulses.", quiet=True), *blocks])
    if pulses.common:
        words = ", ".join(setting(key).named(level) for key, level in pulses.common.items())
        blocks.insert(0, Paragraph(f"In all configurations: {words}.", quiet=True))
    blocks += [_overlay(pulses), _table(pulses)]
    if len(pulses.groups) > _MOST_ROWS:
        blocks.append(
            Paragraph(f"{len(pulses.groups) - _MOST_ROWS} more: pyroshock impacts --campaign NAME.", quiet=True)
        )
    return Section("Pulses by configuration", blocks)


def _table(pulses: PulseGroups) -> Table:
    unit, per_newton = force_unit(max(float(group.figures["peak_force_n"].max()) for group in pulses.groups))
    captions = {
        "contact_time_s": ("contact time (ms)", 1e3),
        "peak_force_n": (f"peak force ({unit})", per_newton),
        "impulse_n_s": ("impulse (N s)", 1.0),
        "compression_time_s": ("compression time (ms)", 1e3),
        "impact_velocity_m_s": ("impact velocity (m/s)", 1.0),
    }
    shown = {
        key: text for key, text in captions.items() if any(np.isfinite(g.figures[key]).any() for g in pulses.groups)
    }
    rows = [
        [
            *(setting(key).cell(group.levels.get(key)) for key in pulses.varied),
            len(group),
            *(mean_and_spread(group.figures[key], scale) for key, (_, scale) in shown.items()),
        ]
        for group in islice(pulses.groups, _MOST_ROWS)
    ]
    heads = [*(setting(key).heading for key in pulses.varied), "pulses", *(name for name, _ in shown.values())]
    return Table("Mean ± standard deviation over the pulses of a configuration.", heads, rows)


def _overlay(pulses: PulseGroups) -> ChartRow:
    from ...training.evaluation.metrics import reconstruct

    few = len(pulses.groups) <= SERIES
    factor = None if few else telling_factor(pulses)
    levels = sorted({group.levels.get(factor) for group in pulses.groups}, key=_in_order) if factor else []
    unit, per_newton = force_unit(max(float(group.force_n.max()) for group in pulses.groups))
    curves = []
    for number, group in enumerate(pulses.groups):
        fine = per_newton * reconstruct(np.stack([group.force_n, group.spread_n]), 200)
        level = group.levels.get(factor) if factor else None
        colour = number if few else levels.index(level) if factor else 0
        name = pulses.label(group) if few else setting(factor).words(level) if factor else "every configuration"
        time = np.linspace(0.0, 1e3 * float(group.figures["contact_time_s"].mean()), fine.shape[1])
        curves.append(Curve(name, time, fine[0], colour, np.abs(fine[1]) if few and len(group) > 1 else None))
    title = "Mean pulses by configuration" + (f", in the colour of the {setting(factor).name}" if factor else "")
    shade = ", shaded by a standard deviation on either side" if any(c.spread is not None for c in curves) else ""
    axes = ("time (ms)", f"force ({unit})")
    figures = [Figure(f"{title}{shade}", line_chart(title, curves, *axes), line_keys(curves))]
    if factor and len(levels) > 1:
        # soft tips give pulses that the scale of hard ones hides
        for number, level in enumerate(levels):
            words = f"{setting(factor).name}: {setting(factor).words(level)}"
            figures.append(Figure(words, line_chart(words, [c for c in curves if c.colour == number], *axes)))
    return ChartRow(figures)


def _in_order(level: Any) -> tuple[bool, float, str]:
    """Numbers by size, then words."""
    return (False, level, "") if isinstance(level, float) else (True, 0.0, str(level))


#: Shots that are listed one by one, and settings.
_MOST = 200
_PRESSURE, _MASS = setting("tank_pressure_pa"), setting("bullet_mass_kg")

Shots = Sequence[dict[str, Any]]


def shots_of(session: Session, campaign: str) -> list[dict[str, Any]]:
    """The shots as `pyroshock shots` lists them. Raises `LookupError` for an unknown campaign."""
    return list(with_predictions(session, iter_shots(session, campaign)))


def shots_section(shots: Shots) -> Section:
    """Measured against model velocity: in a sentence, as a chart, by setting, and shot by shot."""
    judged = [shot for shot in shots if _off(shot) is not None]
    blocks: list[Block] = [_sentence(shots, judged)]
    if judged:
        blocks += [_chart(judged), _by_setting(judged)]
    blocks.append(_shots_table(shots))
    if len(shots) > _MOST:
        blocks.append(Paragraph(f"The first {_MOST} of {len(shots)}; pyroshock shots lists all.", quiet=True))
    return Section("Shots: measured against model velocity", blocks)


def _off(shot: dict[str, Any]) -> float | None:
    """Measured less predicted, as a share of predicted."""
    measured, predicted = shot["measured_velocity_m_s"], shot["predicted_velocity_m_s"]
    return None if measured is None or not predicted else measured / predicted - 1


def _sentence(shots: Shots, judged: Shots) -> Paragraph:
    if not judged:
        return Paragraph(f"{len(shots)} shots, none with a measured velocity beside a model's.", quiet=True)
    off = 100 * np.array([_off(shot) for shot in judged], dtype=np.float64)
    at = int(np.argmax(np.abs(off)))
    where = f"run {judged[at]['run']}, repetition {judged[at]['repetition']}"
    return Paragraph(
        f"{len(judged)} of {len(shots)} shots have a measured velocity. It differs from the nominal model's by "
        f"{off.mean():+.1f} % in the mean, {np.sqrt(np.mean(off**2)):.1f} % rms, {off[at]:+.1f} % at most ({where})."
    )


def _chart(judged: Shots) -> ChartRow:
    masses = sorted({shot["bullet_mass_kg"] for shot in judged})
    groups = [(f"{_MASS.words(mass)} bullet", [s for s in judged if s["bullet_mass_kg"] == mass]) for mass in masses]
    groups = groups if len(groups) <= SERIES else [("shots", list(judged))]
    clouds = [
        Cloud(
            name,
            _column(shots, "predicted_velocity_m_s"),
            _column(shots, "measured_velocity_m_s"),
            [f"run {shot['run']}, repetition {shot['repetition']}" for shot in shots],
            number,
        )
        for number, (name, shots) in enumerate(groups)
    ]
    title = "Measured against model velocity, dashed: 5 % off"
    title += f"; {MOST_POINTS} of {len(judged)} shots" if len(judged) > MOST_POINTS else ""
    drawing = agreement_chart(title, clouds, "model (m/s)", "measured (m/s)", off=0.05)
    return ChartRow([Figure(title, drawing, dot_keys(clouds))])


def _by_setting(judged: Shots) -> Table:
    groups: dict[tuple[float, float], list[dict[str, Any]]] = {}
    for shot in judged:
        groups.setdefault((shot["bullet_mass_kg"], shot["tank_pressure_pa"]), []).append(shot)
    rows: list[list[Cell]] = []
    for (mass, pressure), shots in sorted(groups.items())[:_MOST]:
        measured, predicted = _column(shots, "measured_velocity_m_s"), _column(shots, "predicted_velocity_m_s")
        off = 100 * float(np.mean(measured / predicted - 1))
        cells = (mean_and_spread(measured), float(predicted.mean()), round(off, 2))
        rows.append([_MASS.cell(mass), _PRESSURE.cell(pressure), len(shots), *cells])
    heads = (_MASS.heading, _PRESSURE.heading, "shots", "measured (m/s)", "model (m/s)", "deviation (%)")
    return Table("By setting: mean ± standard deviation of the shots.", heads, rows)


def _shots_table(shots: Shots) -> Table:
    rows = []
    for shot in shots[:_MOST]:
        off, spread = _off(shot), shot["measured_velocity_u_m_s"]
        measured = shot["measured_velocity_m_s"]
        velocity_text = None if measured is None else f"{measured:.4g}" + (f" ± {spread:.2g}" if spread else "")
        rows.append(
            [
                shot["run"],
                shot["repetition"],
                _PRESSURE.cell(shot["tank_pressure_pa"]),
                _MASS.cell(shot["bullet_mass_kg"]),
                velocity_text,
                shot["predicted_velocity_m_s"],
                None if off is None else round(100 * off, 2),
            ]
        )
    heads = ("run", "repetition", _PRESSURE.heading, _MASS.heading, "measured (m/s)", "model (m/s)", "deviation (%)")
    return Table("Each shot, with the standard uncertainty of its velocity.", heads, rows, "No shots.")


def _column(shots: Shots, key: str) -> Floats:
    return np.array([shot[key] for shot in shots], dtype=np.float64)
