"""Where the gap lies: every part of the answer that the campaign's channels allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .gap import GapTable
from .localisation.drift import drift
from .localisation.factor_regions import factor_regions
from .localisation.stages import stage_shares
from .localisation.windows import amplitude_residual_db, frequency_bands, time_windows
from .observables.base import Stage
from .observables.contact.residuals import pulse_residuals
from .observables.contact.stage import ContactObservables
from .verdict import FrequencyBand, TimeWindow, Where


def localise_gap(gap: GapTable, stages: Sequence[Stage], rng: np.random.Generator) -> Where:
    """By stage, factors, time, frequency, order of runs."""
    of = gap.record.configuration_of
    order = np.array([run.order for run in gap.record.runs])
    time, frequency = _of_pulses(stages, rng)
    return Where(
        stage=stage_shares(stages, rng),
        factors=factor_regions(gap.residuals, of, gap.record.configurations, gap.observables, rng),
        time=time,
        frequency=(*frequency, *_of_spectra(gap, rng)),
        drift=drift(gap.residuals, of, order, gap.observables, rng, configurations=gap.record.configurations),
    )


def _of_pulses(
    stages: Sequence[Stage], rng: np.random.Generator
) -> tuple[tuple[TimeWindow, ...], tuple[FrequencyBand, ...]]:
    stage = next((stage for stage in stages if isinstance(stage, ContactObservables)), None)
    if stage is None:
        return (), ()
    pulses = pulse_residuals(stage)
    runs = np.isfinite(pulses.measured).all(axis=1) & np.isfinite(pulses.simulated).all(axis=1)
    of = stage.record.configuration_of[runs]
    windows = time_windows(pulses.time_s, pulses.measured[runs], pulses.simulated[runs], of, "force", rng)
    lines, level = amplitude_residual_db(
        pulses.frequency_hz, *(pulses.spectrum_n_s(force[runs]) for force in (pulses.measured, pulses.simulated))
    )
    return windows, frequency_bands(lines, level, of, "force", rng) if lines.size else ()


def _of_spectra(gap: GapTable, rng: np.random.Generator) -> tuple[FrequencyBand, ...]:
    """Bands of the shock response spectra, by channel."""
    bands: list[FrequencyBand] = []
    lines: dict[str, dict[int, float]] = {}
    for column, item in enumerate(gap.observables):
        if item.unit == "dB" and item.frequency_hz is not None:
            lines.setdefault(item.channel, {})[column] = item.frequency_hz
    for channel, frequency_hz in lines.items():
        levels = gap.residuals[:, list(frequency_hz)]
        runs = np.isfinite(levels).all(axis=1)
        of = gap.record.configuration_of[runs]
        bands += frequency_bands(np.array([*frequency_hz.values()]), levels[runs], of, channel, rng)
    return tuple(bands)
