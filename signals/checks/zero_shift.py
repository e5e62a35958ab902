"""Zero shift: the level after the shock is not the level before it.

Bateman, Himelblau and Merritt, "Validation of Pyroshock Data" (Sound & Vibration, March 2012), and
NASA-STD-7003A judge by the velocity: a structure that the shock leaves where it was comes back to
rest, and an offset shows as a ramp. Offset and ramp are one figure seen twice, so the verdict needs
three things: an offset beyond its standard error, a ramp that the shock cannot have driven, and an
offset large enough to spoil a result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel, on_impactor
from .base import Contact, Finding, Severity
from .levels import ShockSpan, block_mean, finite_samples, rest_after, rest_before, shock_span

#: Standard errors that make a shift (`rest.BLOCKS` tells why so many).
MIN_ERRORS = 5.0
#: An elastic suspension can turn the velocity v that the shock gave into -v, a change of 2 v; more
#: has no cause.
MAX_VELOCITY_RATIO = 2.0
#: A step b drives a slow oscillator to 2 b. Two decades below its knee a shock spectrum is some 40
#: dB below its plateau (6 dB an octave, field data), which is what 2 b amounts to at 0.5 % of the
#: peak: from there on it is the offset's.
MIN_ACCELERATION_SHARE = 0.005
#: The thesis ends a contact at 0.5 % of the peak (section 4.1): an offset of that size moves or
#: loses the end. Twice it and no contact of that height ever ends.
MIN_FORCE_SHARE = 0.005
WARNING_FORCE_SHARE = 0.01
#: A sensor that responds to DC changes by as much when it is turned over. Its velocity is as wrong,
#: hence the same severity; the evidence tells who looks for the cause.
TILT_M_S2 = 2 * 9.80665


@dataclass(frozen=True)
class _Levels:
    """Level before and after the shock with standard errors, in SI, and whether it still rang at
    the end."""

    before: float
    after: float
    error: float
    truncated: bool

    @property
    def shift(self) -> float:
        return self.after - self.before


def check_zero_shift(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one finding. Acceleration (but of what moves on purpose) and force channels."""
    moving = on_impactor(channel.sensor.position)
    if channel.quantity not in ("acceleration", "force") or (
        channel.quantity == "acceleration" and moving
    ):
        return []
    x = finite_samples(channel)
    span = shock_span(channel, contacts)
    levels = None if span is None else _levels(x, span)
    if span is None or levels is None or abs(levels.shift) < MIN_ERRORS * levels.error:
        return []
    if channel.quantity == "force":
        return _force_finding(channel, levels, span)
    return _acceleration_finding(channel, x, levels, span)


def _levels(x: NDArray[np.float64], span: ShockSpan) -> _Levels | None:
    """Levels of what rests before the shock and after it; the last quarter where it rings to the
    end."""
    before, after = rest_before(x, span), rest_after(x, span)
    if before.size == 0 or after.size == 0:
        return None
    (level_before, error_before), (level_after, error_after) = block_mean(before), block_mean(after)
    error = float(np.hypot(error_before, error_after))
    return _Levels(level_before, level_after, error, truncated=span.last >= x.size - after.size)


def _force_finding(channel: Channel, levels: _Levels, span: ShockSpan) -> list[Finding]:
    share = abs(levels.shift) / span.peak
    if share < MIN_FORCE_SHARE:
        return []
    severity: Severity = (
        "warning" if share >= WARNING_FORCE_SHARE and not levels.truncated else "note"
    )
    message = (
        f"the force rests {levels.shift:.4g} N off after the hit, {share:.2%} of "
        f"its peak ({MIN_FORCE_SHARE:.1%})"
    )
    return [Finding("zero-shift", severity, message, channel.name, _evidence(levels, span, "n"))]


def _acceleration_finding(
    channel: Channel, x: NDArray[np.float64], levels: _Levels, span: ShockSpan
) -> list[Finding]:
    residual_m_s = levels.shift * (x.size - span.first) * float(channel.period_s)
    # Without the offset, or the ramp itself would be the peak of the velocity and hide what it is
    # compared with.
    moved = np.cumsum(x[span.first : span.last + 1] - levels.after) * float(channel.period_s)
    peak_m_s = float(np.abs(moved).max())
    ratio = abs(residual_m_s) / peak_m_s if peak_m_s > 0.0 else float(np.finfo(np.float64).max)
    if ratio < MAX_VELOCITY_RATIO:
        return []
    large = abs(levels.shift) >= MIN_ACCELERATION_SHARE * span.peak
    # Truncated: the mean of what still rings is no level; the ramp is worth a look, not a verdict.
    severity: Severity = "warning" if large and not levels.truncated else "note"
    velocity = {
        "residual_velocity_m_s": residual_m_s,
        "peak_velocity_m_s": peak_m_s,
        "velocity_ratio": ratio,
        "could_be_tilt": abs(levels.shift) <= TILT_M_S2,
    }
    message = (
        f"offset of {levels.shift:.4g} m/s2 after the shock: it integrates to {residual_m_s:.3g} "
        f"m/s by the end, {ratio:.3g} times the peak velocity (limit {MAX_VELOCITY_RATIO:g})"
    )
    evidence = {**_evidence(levels, span, "m_s2"), **velocity}
    return [Finding("zero-shift", severity, message, channel.name, evidence)]


def _evidence(levels: _Levels, span: ShockSpan, unit: str) -> dict[str, float | bool]:
    return {
        f"shift_{unit}": levels.shift,
        f"standard_error_{unit}": levels.error,
        f"before_{unit}": levels.before,
        f"after_{unit}": levels.after,
        "peak_share": abs(levels.shift) / span.peak,
        "truncated": levels.truncated,
    }
