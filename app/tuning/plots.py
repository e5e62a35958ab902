"""The best settings' spectra in the tolerance of what is prescribed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...array_types import Floats
from ...twin.tune.goal import Goal
from ...twin.tune.tuner import Tuned
from ..plots import MEASURED, MODEL, QUIET, new_figure, save


def plot_tuned(tuned: Tuned, goal: Goal, path: Path) -> None:
    """The picture of `draw_tuned`; the suffix decides the format."""
    figure = new_figure(8, 5)
    draw_tuned(figure.subplots(), tuned, goal)
    save(figure, path)


def draw_tuned(axes: Any, tuned: Tuned, goal: Goal) -> None:
    """The first proposal with its 90 % band, the next two as lines, in the band of the target."""
    lines = goal.frequency_hz
    low, high = (np.clip(edge, -200, 400) for edge in (goal.level_db - goal.lower_db, goal.level_db + goal.upper_db))
    axes.fill_between(lines, _m_s2(low), _m_s2(high), color=QUIET, alpha=0.25, lw=0, label="tolerance")
    axes.plot(lines, _m_s2(goal.level_db), color=QUIET, lw=1.5, label="prescribed")
    first, *others = tuned.proposals[:3]
    axes.fill_between(lines, _m_s2(first.lower_db), _m_s2(first.upper_db), color=MODEL, alpha=0.2, lw=0)
    axes.plot(lines, _m_s2(first.level_db), color=MODEL, lw=1.8, label=f"first: {first.probability_within:.0%} within")
    for rank, proposal in enumerate(others, 2):
        label = f"{rank}: {proposal.probability_within:.0%} within"
        axes.plot(lines, _m_s2(proposal.level_db), color=MEASURED, lw=1.0, ls="--" if rank == 2 else ":", label=label)
    axes.set(xscale="log", yscale="log", xlabel="natural frequency (Hz)", ylabel="maximax acceleration (m/s$^2$)")
    axes.set_ylim(0.3 * _m_s2(goal.level_db).min(), 5 * _m_s2(goal.level_db).max())
    axes.legend(frameon=False)


def _m_s2(level_db: Floats) -> Floats:
    return np.asarray(10 ** (level_db / 20))
