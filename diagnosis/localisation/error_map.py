"""Where the error of the nominal model lies, as one table on one scale: what is compared (families
of observables, stretches of a pulse, bands of frequency) by the settings of the runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...array_types import Floats, Rows
from ..gap import GapTable, means
from ..observable_families import family_columns
from ..observables.base import Stage
from ..observables.contact.stage import ContactObservables, pulse_residuals
from ..record import RunConfiguration
from ..what_if import ErrorMap, MapColumn, MapRow
from .windows import (
    PULSE_TOLERANCE,
    SPECTRUM_TOLERANCE_DB,
    amplitude_residual_db,
)

#: Stretches of a pulse that are told apart, and the force above this share of its peak that makes
#: the pulse.
_STRETCHES, _PRESSED = 8, 0.02
#: Numbers of a factor are put into so many groups at most, of about as many configurations each.
_GROUPS = 4


def error_map(gap: GapTable, stages: Sequence[Stage]) -> ErrorMap:
    """The rms error in tolerances over the configurations of each level of each factor that varies,
    by what is compared.

    Parameters:
        gap: The gap of the campaign.
        stages: The stages whose gap it is.
    """
    columns = list(_columns(gap.record.configurations))
    rows = [*_families(gap), *_pulses(stages), *_spectra(gap)]
    values = tuple(
        np.array([_root(squares[members]) for _, members in columns]) for _, squares in rows
    )
    return ErrorMap(tuple(row for row, _ in rows), tuple(column for column, _ in columns), values)


def _root(squares: Floats) -> float:
    finite = squares[np.isfinite(squares)]
    return float(np.sqrt(finite.mean())) if finite.size else float("nan")


def _columns(configurations: Sequence[RunConfiguration]) -> Iterator[tuple[MapColumn, Rows]]:
    """All configurations, then those of each level, with the places of its configurations."""
    yield MapColumn(""), np.arange(len(configurations))
    for name in dict.fromkeys(name for own in configurations for name in own.factors):
        levels = [own.factors.get(name) for own in configurations]
        numbers = [
            float(level) for level in levels if level is not None and not isinstance(level, str)
        ]
        if len(set(numbers)) > 1:
            for low, high in _groups(np.array(numbers)):
                members = [
                    i
                    for i, level in enumerate(levels)
                    if level is not None
                    and not isinstance(level, str)
                    and low <= float(level) <= high
                ]
                yield MapColumn(name, "", low, high), np.array(members, dtype=np.intp)
        words = sorted({level for level in levels if isinstance(level, str)})
        if len(words) > 1:
            for word in words:
                members = [i for i, level in enumerate(levels) if level == word]
                yield MapColumn(name, word), np.array(members, dtype=np.intp)


def _groups(numbers: Floats) -> list[tuple[float, float]]:
    """First and last level of each group; a level is in one group alone."""
    levels = np.unique(numbers)
    if len(levels) <= _GROUPS:
        return [(float(level), float(level)) for level in levels]
    edges = np.quantile(numbers, np.linspace(0, 1, _GROUPS + 1)[1:-1])
    group = np.searchsorted(edges, levels, side="left")
    parts = [levels[group == number] for number in np.unique(group)]
    return [(float(own[0]), float(own[-1])) for own in parts]


def _families(gap: GapTable) -> Iterator[tuple[MapRow, Floats]]:
    in_tolerances = (gap.mean / gap.tolerance) ** 2
    for family, own in family_columns(gap).items():
        yield MapRow("family", gap.observables[own[0]].stage, family), _mean(in_tolerances[:, own])


def _mean(squares: Floats) -> Floats:
    """(C,) over the cells that a configuration has."""
    finite = np.isfinite(squares)
    count = finite.sum(axis=1)
    total = np.where(finite, squares, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _pulses(stages: Sequence[Stage]) -> Iterator[tuple[MapRow, Floats]]:
    """Stretches of the force in time, as shares of the measured peak, and its octaves."""
    stage = next((stage for stage in stages if isinstance(stage, ContactObservables)), None)
    if stage is None:
        return
    pulses = pulse_residuals(stage)
    of, count = stage.record.configuration_of, len(stage.record.configurations)
    peak = np.max(np.abs(pulses.measured), axis=1, keepdims=True, initial=1e-300)
    share, _ = means((pulses.measured - pulses.simulated) / peak, of, count)
    with np.errstate(invalid="ignore"):
        force = np.maximum(pulses.measured, pulses.simulated) / peak
        pressed = np.flatnonzero((force > _PRESSED).any(axis=0))
    for part in np.array_split(pressed, min(_STRETCHES, pressed.size)):
        low, high = float(pulses.time_s[part[0]]), float(pulses.time_s[part[-1]])
        row = MapRow("time", "contact", "force", low, high)
        yield row, _mean((share[:, part] / PULSE_TOLERANCE) ** 2)
    runs = np.isfinite(pulses.measured).all(axis=1) & np.isfinite(pulses.simulated).all(axis=1)
    spectra = (pulses.spectrum_n_s(own[runs]) for own in (pulses.measured, pulses.simulated))
    lines, level = amplitude_residual_db(pulses.frequency_hz, *spectra)
    if lines.size:
        mean, _ = means(level, of[runs], count)
        yield from _octaves("contact", "force", lines, (mean / SPECTRUM_TOLERANCE_DB) ** 2)


def _spectra(gap: GapTable) -> Iterator[tuple[MapRow, Floats]]:
    """Octaves of the shock response spectra of all channels together."""
    own = [
        (i, item.frequency_hz)
        for i, item in enumerate(gap.observables)
        if item.unit == "dB" and item.frequency_hz is not None
    ]
    if own:
        columns = [i for i, _ in own]
        squares = (gap.mean[:, columns] / gap.tolerance[columns]) ** 2
        lines = np.array([frequency for _, frequency in own])
        yield from _octaves(gap.observables[columns[0]].stage, "acceleration", lines, squares)


def _octaves(
    stage: str, channel: str, frequency_hz: Floats, squares: Floats
) -> Iterator[tuple[MapRow, Floats]]:
    """Squares (C, lines) by octave, counted from the lowest line."""
    octave = np.floor(np.log2(frequency_hz / frequency_hz.min()) + 1e-9)
    for number in np.unique(octave):
        lines = octave == number
        ends = float(frequency_hz[lines].min()), float(frequency_hz[lines].max())
        yield MapRow("frequency", stage, channel, *ends), _mean(squares[:, lines])
