"""What a check of a recording is: a small function from a record and its spectrum to a finding, or none.

Nothing here knows a store or a file: these are checks of numbers, for any recording alone. A finding decides nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ....signals.srs.record import Spectrum

Floats = NDArray[np.float64]

#: Below this share of the peak, a record counts as at rest.
REST_SHARE = 0.05
#: Noise may pass this share: so many sigmas of the first samples are passed once in two million.
NOISE_SIGMAS, NOISE_SAMPLES = 5.0, 32
#: Median absolute deviation of a normal distribution to its standard deviation.
MAD_TO_SIGMA = 1.4826
#: Fewer samples than this before or after the shock give no level and no noise.
MIN_SAMPLES = 16
#: Less rest than this share of what follows the onset is the tail of the ringing.
REST_AFTER = 0.1
#: Standard errors that make a level: with ten blocks exceeded by chance once in 1350 (Student's t, nine degrees).
BLOCKS, MIN_ERRORS = 10, 5.0


@dataclass(frozen=True)
class Finding:
    """`value` passes `limit`, both in `unit` ("" for a pure number); `message` says what it means and what to do."""

    name: str
    value: float
    limit: float
    unit: str
    message: str


@dataclass(frozen=True, eq=False)
class Record:
    """An acceleration (n,), n >= 2, in m/s2; `range_m_s2` is the sensor's full scale where it is known.

    Raises `ValueError` for samples that are not finite: no spectrum can be drawn from them.
    """

    acceleration: Floats
    sampling_rate_hz: float
    range_m_s2: float | None = None

    def __post_init__(self) -> None:
        if self.acceleration.ndim != 1 or self.acceleration.size < 2:
            raise ValueError(f"a record of shape {self.acceleration.shape}: expected one row of two samples or more")
        if bad := int(np.count_nonzero(~np.isfinite(self.acceleration))):
            raise ValueError(f"{bad} of {self.acceleration.size} samples are not finite: mend or cut the record")
        if not (self.sampling_rate_hz > 0 and np.isfinite(self.sampling_rate_hz)):
            raise ValueError(f"sampling_rate_hz = {self.sampling_rate_hz!r}: expected a positive number")

    @cached_property
    def rest_m_s2(self) -> float:
        """Level about which the peak is sought: the median, right as long as the shock fills less than half."""
        return float(np.median(self.acceleration))

    @cached_property
    def peak_m_s2(self) -> float:
        """Largest deviation from rest."""
        return float(np.abs(self.acceleration - self.rest_m_s2).max())

    @cached_property
    def loud_m_s2(self) -> float:
        """What no longer counts as rest: 5 % of the peak, or what the noise at the begin does not reach, at most half.

        That noise is told by differences of neighbours, in which the smooth rise of a pulse leaves nothing.
        """
        steps = np.diff(self.acceleration[:NOISE_SAMPLES])
        sigma = MAD_TO_SIGMA * float(np.median(np.abs(steps - np.median(steps)))) / 2**0.5
        return min(max(REST_SHARE * self.peak_m_s2, NOISE_SIGMAS * sigma), 0.5 * self.peak_m_s2)

    @cached_property
    def shock(self) -> tuple[int, int]:
        """First and last sample of what is loud; each side against a rest of its own: an offset is no ringing."""
        at = int(np.abs(self.acceleration - self.rest_m_s2).argmax())
        before, after = self._loud(self.acceleration[:at]), self._loud(self.acceleration[at:])
        return int(before[0]) if before.size else at, at + (int(after[-1]) if after.size else 0)

    @cached_property
    def before(self) -> Floats:
        """The first half of what was recorded before the shock; empty where there is too little of it.

        The second half may hold the foot of a slow pulse, which is no level: a drop table's makes one of 1 % of the
        peak.
        """
        quiet = self.acceleration[: self.shock[0] // 2]
        return quiet if quiet.size >= MIN_SAMPLES else quiet[:0]

    @cached_property
    def after(self) -> Floats:
        """What was recorded after it; empty where it rings nearly to the end: the mean of that is no level."""
        first, last = self.shock
        rest = self.acceleration[last + 1 :]
        return rest if rest.size >= max(MIN_SAMPLES, REST_AFTER * (self.acceleration.size - first)) else rest[:0]

    @cached_property
    def velocity(self) -> Floats:
        """Integral by the trapezoid rule from 0 at the first sample, level before the shock taken off, (n,), m/s."""
        x = self.acceleration - (self.before.mean() if self.before.size else 0.0)
        return np.concatenate([[0.0], np.cumsum(x[1:] + x[:-1]) / (2 * self.sampling_rate_hz)])

    @cached_property
    def drift_m_s2(self) -> float:
        """An acceleration that `velocity` may hold through noise in the level taken off: 5 standard errors of it."""
        return MIN_ERRORS * level(self.before)[1] if self.before.size else 0.0

    @cached_property
    def shock_velocity_m_s(self) -> float:
        """Largest velocity while the shock lasts."""
        first, last = self.shock
        moved = self.velocity[first : last + 1] - self.velocity[first]
        return float(np.abs(moved).max())

    def _loud(self, x: Floats) -> NDArray[np.int64]:
        rest = float(np.median(x)) if x.size else 0.0
        return np.flatnonzero(np.abs(x - rest) > self.loud_m_s2)


def level(x: Floats) -> tuple[float, float]:
    """Mean of (n,), n >= 10, and its standard error by the means of ten blocks, which slow wander and ringing spread as
    they should."""
    length = x.size // BLOCKS
    means = x[x.size - BLOCKS * length :].reshape(BLOCKS, length).mean(axis=1)
    return float(means.mean()), float(means.std(ddof=1)) / BLOCKS**0.5


Check = Callable[[Record, Spectrum], Finding | None]
