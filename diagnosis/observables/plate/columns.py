"""The observables of the plate stage and their order: modes, then channel by channel lines, amplitudes and rests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...record import Floats
from ..base import Observable
from .modes import MeasuredModes
from .signals import PlateSignals
from .spectra import Spectra
from .window import RingingWindow

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
        found = list(mode_observables(self.frequency_hz, self._ringing_s))
        for row, channel in enumerate(self.signals.channels):
            found += [self._line(channel, f) for f in self.spectra.lines_hz]
            found += [self._level(channel, f) for f in self.frequency_hz[self.modes.clear[row]]]
            found += [self._rest(channel, part) for part in self.spectra.windows]
            delay = Observable(f"{channel} delay", "plate", channel, "1", _DELAY, _DELAY_FLOOR, detail=True)
            found += [delay] * self._late[row]
        return tuple(found)

    def laid(
        self,
        frequency: Floats,
        damping: Floats,
        level: Floats,
        lines_db: Floats,
        rests: Floats,
        delay_s: Floats,
    ) -> Floats:
        """(R, d) of (R, K), (R, K), (R, S, K), (R, S, f), (R, S, windows) and (R, S)."""
        parts = [frequency, damping]
        for row in range(len(self.signals.channels)):
            parts += [lines_db[:, row], level[:, row, self.modes.clear[row]], rests[:, row]]
            parts += [delay_s[:, row, None] / self.signals.contact_s] * self._late[row]
        return np.concatenate(parts, axis=1)

    def told(self, delay_s: Floats) -> Floats:
        """Delays (R, S) as measured; NaN where they cannot be."""
        return np.where(np.abs(delay_s) < _MOST_DELAY * self.signals.contact_s, delay_s, np.nan)

    def seconds(self, window: tuple[int, int]) -> tuple[float, float]:
        """A window in samples on the clock of the contact."""
        first = float(np.nanmedian(self.signals.first_s))
        return first + window[0] * self.signals.step_s, first + window[1] * self.signals.step_s

    @property
    def _late(self) -> list[int]:
        """1 for a channel that shows a delay."""
        return [int(np.any(weight > 0)) for weight in self.modes.weight]

    @property
    def _ringing_s(self) -> tuple[float, float]:
        return self.seconds((self.signals.ringing, self.signals.acceleration.shape[2]))

    def _line(self, channel: str, f: float) -> Observable:
        name = f"{channel} spectrum at {f:.4g} Hz"
        return Observable(name, "plate", channel, "dB", _SRS, _SRS_FLOOR, float(f))

    def _level(self, channel: str, f: float) -> Observable:
        name = f"{channel} ln amplitude of the mode at {f:.4g} Hz"
        return Observable(name, "plate", channel, "1", _LEVEL, _LEVEL_FLOOR, float(f), self._ringing_s)

    def _rest(self, channel: str, window: tuple[int, int]) -> Observable:
        begin, end = self.seconds(window)
        name = f"{channel} rest from {begin * 1e3:.3g} to {end * 1e3:.3g} ms"
        return Observable(name, "plate", channel, "1", _REST, _REST_FLOOR, None, (begin, end), detail=True)
