"""The observables of the plate stage and their order: modes, then channel by channel lines, amplitudes and rests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...record import Floats
from ..base import Observable
from .modes import MeasuredModes
from .signals import PlateSignals
from .spectra import RingingWindow, Spectra

#: Tolerances and floors. 0.5 dB of a spectrum is what the field calls agreement, and 6 % of an amplitude. 0.2 % of a
#: frequency is 0.4 % of a modulus. Damping is seldom known to 10 %. A rest is a share of the largest acceleration.
_SRS, _SRS_FLOOR = 0.5, 0.15
_FREQUENCY, _FREQUENCY_FLOOR = 0.002, 0.0003
_DAMPING, _DAMPING_FLOOR = 0.1, 0.02
_LEVEL, _LEVEL_FLOOR = 0.06, 0.015
_REST, _REST_FLOOR = 0.002, 0.0003
#: A delay is a share of the contact time. Small errors of frequencies, within their tolerance, look like a tenth of it.
_DELAY, _DELAY_FLOOR = 0.1, 0.004
#: A delay that is measured to be larger is a contact whose begin could not be read.
_MOST_DELAY = 0.25
#: The channel of what belongs to the plate and no sensor alone.
PLATE = "plate"


def mode_observables(
    frequency_hz: Floats,
    ringing_s: tuple[float, float],
    tolerance: tuple[float, float] = (_FREQUENCY, _DAMPING),
) -> tuple[Observable, ...]:
    """Logarithms of frequencies, then of damping ratios, of modes that the table has at `frequency_hz` (K,).

    `tolerance` of either, as logarithms.
    """
    kinds = (("frequency", tolerance[0], _FREQUENCY_FLOOR), ("damping", tolerance[1], _DAMPING_FLOOR))
    return tuple(
        Observable(f"ln {what} of the mode at {f:.4g} Hz", "plate", PLATE, "1", within, floor, float(f), ringing_s)
        for what, within, floor in kinds
        for f in frequency_hz
    )


@dataclass(frozen=True, eq=False)
class Columns:
    """Which of the readings are observables; `frequency_hz` (K,) are the table's."""

    signals: PlateSignals
    spectra: Spectra
    window: RingingWindow
    modes: MeasuredModes
    frequency_hz: Floats

    def observables(self) -> tuple[Observable, ...]:
        ringing_s = self._seconds(self.signals.ringing, self.signals.acceleration.shape[2])
        columns = list(mode_observables(self.frequency_hz, ringing_s))
        windows_s = [self._seconds(*window) for window in self.spectra.windows]
        for row, channel in enumerate(self.signals.channels):
            modes_hz = self.frequency_hz[self.modes.clear[row]]
            # name, unit, tolerance, floor, and as far as there are: frequency, window, whether it is a detail
            kinds: list[tuple[Any, ...]] = [
                *((f"spectrum at {f:.4g} Hz", "dB", _SRS, _SRS_FLOOR, float(f)) for f in self.spectra.lines_hz),
                *(
                    (f"ln amplitude of the mode at {f:.4g} Hz", "1", _LEVEL, _LEVEL_FLOOR, float(f), ringing_s)
                    for f in modes_hz
                ),
                *(
                    (f"rest from {a * 1e3:.3g} to {b * 1e3:.3g} ms", "1", _REST, _REST_FLOOR, None, (a, b), True)
                    for a, b in windows_s
                ),
                *([("delay", "1", _DELAY, _DELAY_FLOOR, None, None, True)] * self._shows_delay(row)),
            ]
            columns += [Observable(f"{channel} {kind[0]}", "plate", channel, *kind[1:]) for kind in kinds]
        return tuple(columns)

    def table(
        self, frequency: Floats, damping: Floats, level: Floats, lines_db: Floats, rests: Floats, delay_s: Floats
    ) -> Floats:
        """(R, d) of (R, K), (R, K), (R, S, K), (R, S, f), (R, S, windows) and (R, S)."""
        parts = [frequency, damping]
        for row in range(len(self.signals.channels)):
            parts += [lines_db[:, row], level[:, row, self.modes.clear[row]], rests[:, row]]
            if self._shows_delay(row):
                parts.append(delay_s[:, row, None] / self.signals.contact_s)
        return np.concatenate(parts, axis=1)

    def measured(self) -> Floats:
        """(R, d): as the records show them."""
        modes, acceleration = self.modes, self.signals.acceleration
        delay = np.where(np.abs(modes.delay) < _MOST_DELAY * self.signals.contact_s, modes.delay, np.nan)
        lines_db, rests = self.spectra.levels_db(acceleration), self.spectra.rests(acceleration)
        return self.table(modes.frequency, modes.damping, modes.level, lines_db, rests, delay)

    def _shows_delay(self, row: int) -> bool:
        return bool(np.any(self.modes.weight[row] > 0))

    def _seconds(self, begin: int, end: int) -> tuple[float, float]:
        """Samples on the clock of the contact."""
        first = float(np.nanmedian(self.signals.first_s))
        return first + begin * self.signals.step_s, first + end * self.signals.step_s
