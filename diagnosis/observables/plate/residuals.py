"""What is left between measured and simulated accelerations: spectra in dB and records in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....twin.effects import Effect
from ...record import Floats
from ..base import Upstream
from .stage import PlateStage


@dataclass(frozen=True, eq=False)
class PlateResiduals:
    """Of R runs, S channels, f lines and n samples; NaN where a run has none.

    Spectra (R, S, f) are maximax in dB over 1 m/s2 at `frequency_hz` (f,). Accelerations (R, S, n) in m/s2; sample k of
    run r is at `first_s[r]` + k `step_s`, and contact begins at 0 s.
    """

    channels: tuple[str, ...]
    frequency_hz: Floats
    measured_db: Floats
    simulated_db: Floats
    measured: Floats
    simulated: Floats
    first_s: Floats
    step_s: float

    @property
    def gap_db(self) -> Floats:
        """(R, S, f): measured less simulated."""
        return np.asarray(self.measured_db - self.simulated_db)

    def share_within(self, band_db: float) -> float:
        """Of all spectrum lines; NaN without any."""
        gap = self.gap_db[np.isfinite(self.gap_db)]
        return float(np.mean(np.abs(gap) <= band_db)) if gap.size else float("nan")


def plate_residuals(
    stage: PlateStage, effects: Sequence[Effect] = (), upstream: Upstream | None = None
) -> PlateResiduals:
    """Measured and simulated side by side, under effects and with the forces that `Stage.simulated` takes."""
    signals, spectra = stage.signals, stage.columns.spectra
    simulated = stage.records(effects, upstream)
    return PlateResiduals(
        channels=signals.channels,
        frequency_hz=spectra.lines_hz,
        measured_db=spectra.levels_db(signals.acceleration),
        simulated_db=spectra.levels_db(simulated),
        measured=signals.acceleration,
        simulated=simulated,
        first_s=signals.first_s,
        step_s=signals.step_s,
    )
