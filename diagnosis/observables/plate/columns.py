"""The observables of the plate stage and their order: modes, then channel by channel lines, amplitudes and rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....array_types import Floats
from ..base import Observable
from .modes import MeasuredModes
from .signals import PlateSignals
from .spectra import Spectra

#: Tolerances and floors. 0.5 dB of a spectrum is what the field calls agreement, and 6 % of an amplitude. 0.2 % of a
#: frequency is 0.4 % of a modulus. Damping is seldom known to 10 %. A rest is a share of the largest acceleration.
_SRS = (0.5, 0.15)
_FREQUENCY = (0.002, 0.0003)
_DAMPING = (0.1, 0.02)
_LEVEL = (0.06, 0.015)
_REST = (0.002, 0.0003)
#: A delay is a share of the contact time. Small errors of frequencies, within their tolerance, look like a tenth of it.
_DELAY = (0.1, 0.004)
#: A delay that is measured to be larger is a contact whose begin could not be read.
_MOST_DELAY = 0.25


def mode_observables(
    frequency_hz: Floats,
    ringing_s: tuple[float, float],
    tolerance: tuple[float, float] = (_FREQUENCY[0], _DAMPING[0]),
) -> tuple[Observable, ...]:
    """Logarithms of frequencies, then of damping ratios, of modes that the table has at `frequency_hz` (K,).

    `tolerance` of either, as logarithms. They belong to the plate and no sensor alone.
    """
    return tuple(
        Observable(f"ln {what} of the mode at {f:.4g} Hz", "plate", "plate", "1", within, floor, float(f), ringing_s)
        for what, within, floor in zip(("frequency", "damping"), tolerance, (_FREQUENCY[1], _DAMPING[1]), strict=True)
        for f in frequency_hz
    )


@dataclass(frozen=True, eq=False)
class Columns:
    """Which of the readings are observables."""

    signals: PlateSignals
    spectra: Spectra
    modes: MeasuredModes

    def observables(self) -> tuple[Observable, ...]:
        ringing_s = self.signals.window_s(self.signals.ringing, self.signals.samples)
        rests_s = [self.signals.window_s(*window) for window in self.spectra.windows]
        columns = list(mode_observables(self.modes.frequency_hz, ringing_s))
        for row, channel in enumerate(self.signals.channels):
            modes_hz = self.modes.frequency_hz[self.modes.clear[row]].tolist()
            # name, unit, tolerance and floor, frequency, window, whether it is a detail
            kinds: list[tuple[str, str, tuple[float, float], float | None, tuple[float, float] | None, bool]] = [
                *((f"spectrum at {f:.4g} Hz", "dB", _SRS, f, None, False) for f in self.spectra.lines_hz.tolist()),
                *((f"ln amplitude of the mode at {f:.4g} Hz", "1", _LEVEL, f, ringing_s, False) for f in modes_hz),
                *((f"rest from {a * 1e3:.3g} to {b * 1e3:.3g} ms", "1", _REST, None, (a, b), True) for a, b in rests_s),
                *([("delay", "1", _DELAY, None, None, True)] if self._shows_delay(row) else []),
            ]
            columns += [
                Observable(f"{channel} {name}", "plate", channel, unit, *accuracy, frequency_hz, window_s, detail)
                for name, unit, accuracy, frequency_hz, window_s, detail in kinds
            ]
        return tuple(columns)

    def table(self, frequency: Floats, damping: Floats, level: Floats, acceleration: Floats, delay_s: Floats) -> Floats:
        """(R, d) of (R, K), (R, K), (R, S, K), (R, S, n) and (R, S)."""
        lines_db, rests = self.spectra.levels_db(acceleration), self.spectra.rests(acceleration)
        parts = [frequency, damping]
        for row in range(len(self.signals.channels)):
            parts += [lines_db[:, row], level[:, row, self.modes.clear[row]], rests[:, row]]
            if self._shows_delay(row):
                parts.append(delay_s[:, row, None] / self.signals.contact_s)
        return np.concatenate(parts, axis=1)

    def measured(self) -> Floats:
        """(R, d): as the records show them."""
        modes = self.modes
        delay_s = np.where(np.abs(modes.delay_s) < _MOST_DELAY * self.signals.contact_s, modes.delay_s, np.nan)
        return self.table(modes.frequency, modes.damping, modes.level, self.signals.acceleration, delay_s)

    def _shows_delay(self, row: int) -> bool:
        return bool(np.any(self.modes.weight[row] > 0))
