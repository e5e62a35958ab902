"""Tank pressures that were written down as absolute where gauge is meant."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..observables.base import Stage
from ..record import CampaignRecord
from .finding import Finding
from .levels import by_configuration
from .mistakes import ATMOSPHERE_PA

#: The hint is given where taking one atmosphere off leaves a third of a gap of this size (nats), and no more than that.
_GAP, _SHARE, _LEFT = 0.15, 1 / 3, 0.05
#: In nats: pressures that differ by less cannot tell an atmosphere from a factor.
_SPAN = 0.2


def absolute_pressure(record: CampaignRecord, stages: Sequence[Stage]) -> list[Finding]:
    """At most a hint: air in front of the projectile takes much the same from a velocity."""
    stage = next((each for each in stages if each.name == "gun"), None)
    read = np.array([math.nan if run.tank_pressure_pa is None else run.tank_pressure_pa for run in record.runs])
    known = read[np.isfinite(read)]
    if stage is None or known.size == 0 or known.min() <= ATMOSPHERE_PA or np.ptp(np.log(known)) < _SPAN:
        return []
    measured = stage.measured()
    before = _rms(by_configuration(record, measured - stage.simulated()))
    after = _rms(by_configuration(record, measured - stage.simulated(upstream=(read - ATMOSPHERE_PA).tolist())))
    if before < _GAP or after > min(_LEFT, _SHARE * before):
        return []
    message = (
        f"tank_pressure: one atmosphere less takes the velocity's gap from {before:.0%} to {after:.0%}: are the "
        "pressures absolute? tank_pressure_bar in runs.csv is gauge"
    )
    return [Finding("name", "tank_pressure", message)]


def _rms(gap: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(gap**2))) if np.isfinite(gap).any() else math.inf
