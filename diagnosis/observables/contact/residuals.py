"""Measured and simulated pulses side by side, in time and in frequency: where along a pulse the gap lies."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ....twin.effects import Effect
from ....twin.sensors.chain import SensorChain
from ...record import Series
from ..base import sensor_chain
from .features import level_crossings, zeroed
from .force_histories import ForceHistories
from .stage import ContactObservables

#: Room before the alignment and behind it, in the longest width at half the peak; and the most samples for it.
_BEFORE, _AFTER, _MOST = 1.0, 2.0, 2048


@dataclass(frozen=True, eq=False)
class PulseResiduals:
    """Forces (N) of R runs at `time_s` (p,), 0 where each rises through half its peak; NaN rows where there is none."""

    time_s: Floats
    measured: Floats  # (R, p)
    simulated: Floats  # (R, p)

    @property
    def frequency_hz(self) -> Floats:
        """(q,): of the spectra."""
        return np.asarray(np.fft.rfftfreq(self.time_s.size, float(self.time_s[1] - self.time_s[0])))

    def spectrum_n_s(self, force_n: Floats) -> Floats:
        """(..., q) of forces (..., p): magnitude of the Fourier integral; its first value is the impulse."""
        return np.asarray(np.abs(np.fft.rfft(force_n)) * float(self.time_s[1] - self.time_s[0]))


def pulse_residuals(stage: ContactObservables, effects: Sequence[Effect] = ()) -> PulseResiduals:
    """Every run's pulse, as recorded and as the stage simulates it with these effects.

    In steps of the finest record, or of 1/2048 of the whole where that is less. Raises `ValueError` where no run has
    both force and velocity.
    """
    chain = sensor_chain(effects)
    rows = np.arange(len(stage.sites))
    histories = stage.histories(rows, effects)
    recorded = [None if run.force is None else zeroed(run.force) for run in stage.record.runs]
    simulated = [_simulated(histories, int(row), chain) for row in rows]
    pairs = [(record, pulse) for record, pulse in zip(recorded, simulated, strict=True) if record and pulse]
    widths = [_width(series) for pair in pairs for series in pair]
    if not widths:
        raise ValueError(f"{stage.record.name}: no run has both a recorded force and a velocity")
    step = max(float(stage.step_s.min()), (_BEFORE + _AFTER) * max(widths) / _MOST)
    time = _steps(_BEFORE * max(widths), _AFTER * max(widths), step)
    return PulseResiduals(
        time, *(np.array([_aligned(pulse, time) for pulse in pulses]) for pulses in (recorded, simulated))
    )


def _simulated(histories: ForceHistories, row: int, chain: SensorChain) -> Series | None:
    """As the force channel shows it, 24 steps to a compression, with room for what a sensor adds."""
    step = float(histories.compression_time_s[row]) / 24
    if np.isnan(step):
        return None
    time = _steps(12 * step, 191 * step, step)
    return Series(histories.measured(np.array([row]), time, step, chain)[0], 1 / step, float(time[0]))


def _steps(before_s: float, after_s: float, step_s: float) -> Floats:
    return np.arange(-round(before_s / step_s), round(after_s / step_s) + 1, dtype=np.float64) * step_s


def _width(series: Series) -> float:
    first, last = level_crossings(series.values[None], 0.5)
    return float(last[0] - first[0]) / series.sampling_rate_hz


def _aligned(series: Series | None, time_s: Floats) -> Floats:
    from scipy.interpolate import CubicSpline

    if series is None:
        return np.full(time_s.size, np.nan)
    first, _ = level_crossings(series.values[None], 0.5)
    place = first[0] + time_s * series.sampling_rate_hz
    inside = (place >= 0) & (place <= series.values.size - 1)
    curve = CubicSpline(np.arange(series.values.size), series.values)
    return np.where(inside, curve(np.where(inside, place, 0.0)), 0.0)
