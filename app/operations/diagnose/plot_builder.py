"""The pictures of a diagnosis, made from its gap and its stages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ....array_types import Floats, Rows
from ....diagnosis.gap import GapTable
from ....diagnosis.observables.base import Observable, Stage, at_rows
from ....diagnosis.observables.contact.stage import ContactObservables, pulse_residuals
from ....diagnosis.observables.plate.stage import PlateObservables
from ....diagnosis.verdict import CurvePicture, Pictures, ResidualPicture
from ....twin.effects import Effect

#: Spectra are drawn of so many channels.
_CHANNELS = 2
#: A pulse is where the force is above this share of its peak.
_PRESSED = 0.02


#: Sets of fitted effects whose predictions are averaged, with their weights, whose sum is one.
Choices = Sequence[tuple[Sequence[Effect], float]]


def pictures_of(gap: GapTable, stages: Sequence[Stage], choices: Choices = ()) -> Pictures:
    """Residuals and curves before, and after with the mean of what `choices` predict (none, or one
    without effects: before alone).

    Residuals after are the means of runs less what the effects change at a representative run of
    each configuration.
    """
    choices = [choice for choice in choices if choice[0]]
    after = None
    if (
        choices
    ):  # a stage ignores effects of other stages, an effect without an answer draws nothing
        changes = [stage.changes([effects for effects, _ in choices]) for stage in stages]
        after = gap.mean - _mean(np.concatenate(changes, axis=2), choices)
    return Pictures(
        configurations=tuple(configuration.label for configuration in gap.record.configurations),
        residuals=residual_pictures(gap.observables, gap.mean, after, np.sqrt(gap.floor_variance)),
        curves=tuple(curve for stage in stages for curve in _curves(gap, stage, choices)),
        drawn_effects=tuple(tuple(effect.id for effect in effects) for effects, _ in choices),
    )


def _mean(predictions: Sequence[Floats] | Floats, choices: Choices) -> Floats:
    """The mean of what the choices predict, k arrays of one shape; NaN where one of them has no
    answer."""
    return np.asarray(
        np.tensordot([weight for _, weight in choices], np.asarray(predictions), axes=1)
    )


def residual_pictures(
    observables: Sequence[Observable],
    before: Floats,
    after: Floats | None,
    floor: Floats,
    most: int = 6,
) -> tuple[ResidualPicture, ...]:
    """Up to `most` observables whose gap before lies beyond tolerance and floor, in the order of
    `observables`.

    The largest gaps by their rms over tolerance and floor, as many of each unit; at least one, also
    where all agree. `before` and `after` are (C, d) means over the runs of configurations, `floor`
    (C, d) one standard deviation of such a mean; NaN where a configuration has none.
    """
    scale = np.hypot(np.array([item.tolerance for item in observables]), floor)
    ratio = before / scale
    count = np.isfinite(ratio).sum(axis=0)
    score = np.sqrt(np.nansum(ratio**2, axis=0) / np.maximum(count, 1))
    order = [int(i) for i in np.argsort(-score, kind="stable") if count[i] > 0]
    order = [i for i in order if score[i] >= 1 or i == order[0]]
    units = dict.fromkeys(observables[i].unit for i in order)
    share = -(-most // max(len(units), 1))
    columns = [
        i for unit in units for i in [i for i in order if observables[i].unit == unit][:share]
    ]
    pictures = []
    for i in sorted(columns)[:most]:
        item = observables[i]
        tables = before[:, i], None if after is None else after[:, i], floor[:, i]
        pictures.append(ResidualPicture(item.name, item.stage, item.unit, item.tolerance, *tables))
    return tuple(pictures)


def _curves(gap: GapTable, stage: Stage, choices: Choices) -> Iterator[CurvePicture]:
    """Of the configuration whose observables of the stage lie furthest beyond tolerance and floor,
    if any."""
    ratio = np.nan_to_num(gap.mean / np.hypot(gap.tolerance, np.sqrt(gap.floor_variance)))[
        :, gap.columns(stage.name)
    ]
    if not ratio.any():
        return
    worst = int(np.argmax((ratio**2).sum(axis=1)))
    runs = np.flatnonzero(gap.record.configuration_of == worst)
    label = gap.record.configurations[worst].label
    if isinstance(stage, ContactObservables):
        yield from _pulse(stage, choices, runs, label)
    elif isinstance(stage, PlateObservables):
        yield from _spectra(stage, choices, runs, label)


def _pulse(
    stage: ContactObservables, choices: Choices, runs: Rows, label: str
) -> Iterator[CurvePicture]:
    pulses = pulse_residuals(stage)
    runs = runs[np.isfinite(pulses.measured[runs] + pulses.simulated[runs]).all(axis=1)]
    if not runs.size:
        return
    curves = [pulses.measured[runs].mean(axis=0), pulses.simulated[runs].mean(axis=0)]
    if choices:
        curves.append(
            _mean(
                [_force_n(stage, effects, runs, pulses.time_s) for effects, _ in choices], choices
            )
        )
    # the samples of the pulse, with half its length on either side
    pressed = np.flatnonzero(curves[0] > _PRESSED * curves[0].max())
    margin = max(1, pressed.size // 2)
    near = slice(max(0, int(pressed[0]) - margin), int(pressed[-1]) + margin + 1)
    x = pulses.time_s[near] - pulses.time_s[near.start]
    yield CurvePicture(
        f"force, {label}", "time", "s", "force", "N", x, *(curve[near] for curve in curves)
    )


def _force_n(
    stage: ContactObservables, effects: Sequence[Effect], runs: Rows, time_s: Floats
) -> Floats:
    """The mean force of the runs with effects, on the clock of the nominal one: a longer pulse
    comes on a longer clock."""
    pulses = pulse_residuals(stage, at_rows(stage.acting(effects), stage.record.configuration_of))
    return np.asarray(
        np.interp(time_s, pulses.time_s, pulses.simulated[runs].mean(axis=0), left=0.0, right=0.0)
    )


def _spectra(
    stage: PlateObservables, choices: Choices, runs: Rows, label: str
) -> Iterator[CurvePicture]:
    spectra = stage.columns.spectra
    records = [
        stage.signals.acceleration,
        stage.records(),
        *(stage.records(effects) for effects, _ in choices),
    ]
    levels = [spectra.levels_db(accelerations[:, :_CHANNELS]) for accelerations in records]
    for i, channel in enumerate(stage.signals.channels[:_CHANNELS]):
        usable = runs[np.isfinite(levels[0][runs, i] - levels[1][runs, i]).all(axis=1)]
        if usable.size:
            # mean levels as accelerations
            measured_db, before_db, *of_choices = (
                level[usable, i].mean(axis=0) for level in levels
            )
            measured, before = 10 ** (measured_db / 20), 10 ** (before_db / 20)
            after = 10 ** (_mean(of_choices, choices) / 20) if choices else None
            title, x, y = (
                f"{channel.replace('_', ' ')}, {label}",
                "natural frequency",
                "shock response spectrum",
            )
            curves = measured, before, after
            yield CurvePicture(
                title, x, "Hz", y, "m/s2", spectra.lines_hz, *curves, logarithmic=True
            )
