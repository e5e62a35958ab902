"""The pulses of a campaign on paper: figures by configuration with mean and spread, mean pulses over each other."""

from __future__ import annotations

from itertools import islice
from typing import Any

import numpy as np

from .curves import Curve, line_chart, line_keys
from .document import Block, ChartRow, Figure, Paragraph, Section, Table
from .labels import force_unit, mean_and_spread, setting
from .line_styles import SERIES
from .pulse_groups import PulseGroups, telling_factor

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
