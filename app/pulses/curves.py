"""Versions of a pulse as curves on the record that they were cut from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...array_types import Floats
from ...ingest.pulses import ExtractedPulse
from ...ingest.segmentation import RestLevel, delimit
from ...ingest.settings import ExtractionSettings
from ...schema.impacts import Pulse as PulseRow
from ...schema.series import as_floats
from ...signals.channel import Channel

#: Of the longest contact, on either side; at least so many samples.
MARGIN, LEAST_MARGIN = 0.5, 8

_FIGURES = (
    *("contact_time_s", "compression_time_s", "peak_force_n", "spline_peak_force_n", "impulse_n_s"),
    *("compression_impulse_n_s", "width_half_s", "width_tenth_s", "samples_in_contact", "spline_nrmse"),
    "segmentation_difference",
)


@dataclass(frozen=True, eq=False)
class PulseCurve:
    """One version of a pulse. `key` is None for a preview, which the store does not hold.

    Contact from `start_s` to `stop_s` on the recording's clock, cut where the force passes `threshold_n`; `time_s` and
    `force_n` (m,) are the spline, `points_time_s` and `points_n` (p,) what the models take. `settings` and `figures`
    (SI, unit in the key) are plain data. `threshold_n` is None where this software cannot read the old settings.
    """

    key: int | None
    in_use: bool
    settings: dict[str, Any]
    start_s: float
    stop_s: float
    rest_n: float
    threshold_n: float | None
    time_s: Floats
    force_n: Floats
    points_time_s: Floats
    points_n: Floats
    figures: dict[str, Any]


@dataclass(frozen=True, eq=False)
class ForceRecord:
    """A force record (n,), upright, and its rest."""

    upright: Floats
    channel: Channel
    level: RestLevel

    def place(self, time_s: float) -> int:
        """The sample at an instant of the recording's clock, within the record."""
        at = round((time_s - self.channel.start_s) * self.channel.sampling_rate_hz)
        return min(max(at, 0), self.upright.size - 1)

    def stored(self, row: PulseRow) -> PulseCurve:
        """The curve of a version in the store."""
        rest, threshold = self._delimited(row)
        fine = as_floats(row.fine_force_n, f"the force of pulse {row.id}")
        points = np.asarray(row.force_points_n, dtype=np.float64)
        return PulseCurve(
            key=row.id,
            in_use=row.current,
            settings=row.settings.settings,
            start_s=row.start_s,
            stop_s=row.start_s + row.contact_time_s,
            rest_n=rest,
            threshold_n=threshold,
            time_s=row.start_s + np.arange(fine.size, dtype=np.float64) * row.fine_period_s,
            force_n=rest + fine,
            points_time_s=row.start_s + np.linspace(0, row.contact_time_s, points.size),
            points_n=rest + points,
            figures={name: getattr(row, name) for name in _FIGURES},
        )

    def _delimited(self, row: PulseRow) -> tuple[float, float | None]:
        """Rest before the contact and threshold, as the extraction found them: neither is stored."""
        first, last = self.place(row.start_s), self.place(row.start_s + row.contact_time_s)
        peak = first + int(np.nanargmax(self.upright[first : last + 1]))
        try:
            settings = ExtractionSettings(**row.settings.settings)
        except (TypeError, ValueError):  # of another version of the code
            return self.level.baseline, None
        rate = self.channel.sampling_rate_hz
        rest, extent = delimit(self.upright, np.array([peak]), self.level, rate, settings)
        return rest.baseline, extent.threshold

    def span(self, curves: Sequence[PulseCurve]) -> slice:
        """Samples about all contacts."""
        margin_s = MARGIN * max(curve.stop_s - curve.start_s for curve in curves)
        margin_s = max(margin_s, LEAST_MARGIN / self.channel.sampling_rate_hz)
        first = self.place(min(curve.start_s for curve in curves) - margin_s)
        return slice(first, self.place(max(curve.stop_s for curve in curves) + margin_s) + 1)


def preview_curve(pulse: ExtractedPulse, settings: ExtractionSettings) -> PulseCurve:
    """The curve of a pulse that is not stored."""
    return PulseCurve(
        key=None,
        in_use=False,
        settings=settings.as_json(),
        start_s=pulse.start_s,
        stop_s=pulse.start_s + pulse.contact_time_s,
        rest_n=pulse.rest_n,
        threshold_n=pulse.rest_n + pulse.threshold_n,
        time_s=pulse.start_s + np.arange(pulse.fine_force_n.size, dtype=np.float64) * pulse.fine_period_s,
        force_n=pulse.rest_n + pulse.fine_force_n,
        points_time_s=pulse.start_s + np.linspace(0, pulse.contact_time_s, pulse.force_points_n.size),
        points_n=pulse.rest_n + pulse.force_points_n,
        figures={name: getattr(pulse, name) for name in _FIGURES},
    )
