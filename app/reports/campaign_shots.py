"""The shots of a campaign: measured velocity beside the nominal gun's."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from ...array_types import Floats
from ...schema.listings import iter_shots
from ..predictions.nominal import with_predictions
from .curves import MOST_POINTS, Cloud, agreement_chart, dot_keys
from .document import Block, Cell, ChartRow, Figure, Paragraph, Section, Table
from .labels import mean_and_spread, setting
from .line_styles import SERIES

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
    blocks.append(_each(shots))
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


def _each(shots: Shots) -> Table:
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
