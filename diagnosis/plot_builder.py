"""The pictures of a diagnosis, made from its gap and its stages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from ..twin.effects import Effect
from .gap import GapTable
from .observables.base import Stage
from .observables.batching import at_rows
from .observables.contact.residuals import pulse_residuals
from .observables.contact.stage import ContactStage
from .observables.plate.stage import PlateStage
from .plot_data import CurvePicture, Pictures, residual_pictures

Floats = NDArray[np.float64]

#: Spectra are drawn of so many channels.
_CHANNELS = 2
#: A pulse is where the force is above this share of its peak.
_PRESSED = 0.02


def pictures_of(gap: GapTable, stages: Sequence[Stage], effects: Sequence[Effect] = ()) -> Pictures:
    """Residuals and curves before, and after with `effects` (the likeliest cause as fitted; none: before alone).

    Residuals after are the means of runs less what the effects change at a representative run of each configuration.
    """
    after = gap.mean - _changes(gap, stages, effects) if effects else None
    return Pictures(
        configurations=tuple(gap.record.configurations[row].label for row in gap.rows),
        residuals=residual_pictures(gap.observables, gap.mean, after, np.sqrt(gap.floor_variance)),
        curves=tuple(curve for stage in stages for curve in _curves(gap, stage, tuple(effects))),
    )


def _changes(gap: GapTable, stages: Sequence[Stage], effects: Sequence[Effect]) -> Floats:
    """(C, D): effects of other stages do nothing in each, an effect without an answer draws nothing."""
    return np.concatenate([stage.changes([tuple(effects)])[0] for stage in stages], axis=1)[gap.rows]


def _curves(gap: GapTable, stage: Stage, effects: tuple[Effect, ...]) -> Iterator[CurvePicture]:
    """Of the configuration where the stage's gap is largest."""
    worst = _worst(gap, stage.name)
    if worst is None:
        return
    runs = np.flatnonzero(gap.record.configuration_of == gap.rows[worst])
    label = gap.record.configurations[gap.rows[worst]].label
    if isinstance(stage, ContactStage):
        yield from _pulse(stage, effects, runs, label)
    elif isinstance(stage, PlateStage):
        yield from _spectra(stage, effects, runs, label)


def _worst(gap: GapTable, stage: str) -> int | None:
    """The row whose observables of a stage lie furthest beyond tolerance and floor; None where it has none."""
    own = gap.columns(stage)
    scale = np.sqrt(gap.tolerance[own] ** 2 + gap.floor_variance[:, own])
    ratio = np.nan_to_num(gap.mean[:, own] / scale) ** 2
    return int(np.argmax(ratio.sum(axis=1))) if ratio.any() else None


def _pulse(
    stage: ContactStage, effects: tuple[Effect, ...], runs: NDArray[np.intp], label: str
) -> Iterator[CurvePicture]:
    before = pulse_residuals(stage)
    known = runs[np.isfinite(before.measured[runs] + before.simulated[runs]).all(axis=1)]
    if not known.size:
        return
    later = None
    if effects:  # a pulse that has grown comes on a longer clock
        after = pulse_residuals(stage, at_rows(effects, stage.record.configuration_of))
        later = np.interp(before.time_s, after.time_s, after.simulated[known].mean(axis=0), left=0.0, right=0.0)
    measured, nominal = before.measured[known].mean(axis=0), before.simulated[known].mean(axis=0)
    near = _near_contact(measured)
    x = before.time_s[near] - before.time_s[near.start]
    shown = None if later is None else later[near]
    yield CurvePicture(f"force, {label}", "time", "s", "force", "N", x, measured[near], nominal[near], shown)


def _near_contact(force_n: Floats) -> slice:
    """The samples (n,) of a pulse, with half its length on either side."""
    pressed = np.flatnonzero(force_n > _PRESSED * force_n.max())
    margin = max(1, pressed.size // 2)
    return slice(max(0, int(pressed[0]) - margin), int(pressed[-1]) + margin + 1)


def _spectra(
    stage: PlateStage, effects: tuple[Effect, ...], runs: NDArray[np.intp], label: str
) -> Iterator[CurvePicture]:
    spectra = stage.columns.spectra
    records = [stage.signals.acceleration, stage.records(), *([stage.records(effects)] if effects else [])]
    levels = [spectra.levels_db(accelerations[:, :_CHANNELS]) for accelerations in records]
    for i, channel in enumerate(stage.signals.channels[:_CHANNELS]):
        known = runs[np.isfinite(levels[0][runs, i] - levels[1][runs, i]).all(axis=1)]
        if known.size:
            title, name = f"{channel.replace('_', ' ')}, {label}", "shock response spectrum"
            # mean levels as accelerations
            curves = [10 ** (level[known, i].mean(axis=0) / 20) for level in levels]
            after = curves[2] if effects else None
            yield CurvePicture(
                title, "natural frequency", "Hz", name, "m/s2", spectra.lines_hz, curves[0], curves[1], after, True
            )
