"""What the gun's two sensors have before them during a recording: the tank's pressure and the laser's distance."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from .build import Projectile
from .fire import ShotTruth, position_at

__all__ = ["LASER_REST_M", "Trigger", "shot_signals", "trigger_time_s"]

#: From the sensor's face to the barrel's far wall: it measures 80 to 180 mm.
LASER_REST_M = 0.130
#: Width of the beam (four standard deviations): it dims the edges of a passage.
BEAM_WIDTH_M = 0.6e-3
#: The recorder triggers when this share of the pressure is gone.
TRIGGER_SHARE = 0.05
#: Less than this is no drop: an empty tank does not trigger on rounding errors.
SMALLEST_DROP_PA = 1.0


@dataclass(frozen=True)
class Trigger:
    """A recording begins `pre_trigger_s` before the tank has lost `share` of its pressure.

    With a `share` of None nothing triggers: the recording is begun by hand, `pre_trigger_s` before the valve's first
    turn or earlier. Raises `ValueError` for a share outside of 0 to 1 and for a time that is negative.
    """

    share: float | None = TRIGGER_SHARE
    pre_trigger_s: float = 0.3

    def __post_init__(self) -> None:
        if self.share is not None and not 0 < self.share < 1:
            raise ValueError(f"trigger: share = {self.share!r}; expected above 0 and below 1")
        if not 0 <= self.pre_trigger_s < math.inf:
            raise ValueError(f"trigger: pre_trigger_s = {self.pre_trigger_s!r}; expected 0 or more")

    def begin_s(self, truth: ShotTruth) -> float:
        """Of the recording, from the valve's first turn. Raises as `trigger_time_s`."""
        moment = 0.0 if self.share is None else trigger_time_s(truth, self.share)
        return moment - self.pre_trigger_s


def shot_signals(
    truth: ShotTruth,
    projectile: Projectile,
    sampling_rate_hz: float,
    duration_s: float,
    trigger: Trigger,
    *,
    trigger_offset_s: float = 0.0,
) -> dict[str, Floats]:
    """`tank_pressure` (Pa gauge, at the transducer, before its calibration) and `laser` (m, distance) on a uniform
    grid (n,), n = duration times rate, that begins when the `trigger` says.

    The distance falls by the bullet's diameter while the beam is blocked, going and coming back; before the shot
    all is at rest. `trigger_offset_s` shifts the recording (jitter). Raises `ValueError` for a record that the shot
    was not followed for, for times or rates that are not positive, and as `trigger_time_s` does.
    """
    for name, value in (("sampling_rate_hz", sampling_rate_hz), ("duration_s", duration_s)):
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} = {value!r}: expected a positive number")
    if not trigger.pre_trigger_s < duration_s:
        raise ValueError(f"pre_trigger_s = {trigger.pre_trigger_s!r}: expected less than {duration_s} s")
    begin = trigger.begin_s(truth) + trigger_offset_s
    moment = begin + np.arange(round(duration_s * sampling_rate_hz)) / sampling_rate_hz
    if moment[-1] > truth.time_s[-1]:
        raise ValueError(
            f"the recording ends {moment[-1]:.4g} s after the valve's first turn, and the shot was followed for "
            f"{truth.time_s[-1]:.4g} s: fire it with a larger until_s"
        )
    blocked = _blocked_share(truth, projectile, moment)
    return {
        "tank_pressure": np.interp(moment, truth.time_s, truth.tank_pressure_pa),
        "laser": LASER_REST_M - projectile.diameter_m * blocked,
    }


def trigger_time_s(truth: ShotTruth, share: float = TRIGGER_SHARE) -> float:
    """When the tank has lost a share of its pressure, from the valve's first turn.

    Raises `ValueError` where it never does.
    """
    level = truth.tank_pressure_pa[0] - max(share * truth.tank_pressure_pa[0], SMALLEST_DROP_PA)
    below = np.flatnonzero(truth.tank_pressure_pa < level)
    if not below.size:
        raise ValueError(f"no trigger: the tank's pressure never falls below {level:.4g} Pa")
    k = slice(below[0] - 1, below[0] + 1)
    return float(np.interp(-level, -truth.tank_pressure_pa[k], truth.time_s[k]))


def _blocked_share(truth: ShotTruth, projectile: Projectile, moment: Floats) -> Floats:
    """Share of the beam (n,) between the projectile's ends; the beam is Gaussian across."""
    from scipy.special import ndtr

    position = position_at(truth.time_s, truth.position_m, truth.velocity_m_s, moment)
    past = (position - truth.laser_position_m) / (BEAM_WIDTH_M / 4)
    return np.asarray(ndtr(past + projectile.length_m / (BEAM_WIDTH_M / 4)) - ndtr(past), dtype=np.float64)
