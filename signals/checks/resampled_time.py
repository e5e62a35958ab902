"""Records whose time was uneven, and which were put on an even grid by interpolation."""

from __future__ import annotations

from ..channel import Channel
from .base import Contact, Finding, Severity

#: Of the bound of the error to the peak. The error itself is up to sixteen times smaller than its
#: bound.
NOTE_SHARE = 0.01
WARNING_SHARE = 0.1


def check_resampled_time(channel: Channel, _: tuple[Contact, ...]) -> list[Finding]:
    """What the interpolation may have changed, as `header["resampled_time"]` states it. Any
    quantity.

    `note` where the error is below 1 % of the peak, `warning` below 10 %, `reject` above.
    """
    facts = channel.header.get("resampled_time")
    if facts is None:
        return []
    share = float(facts["error_share_of_peak"])
    severity: Severity = (
        "note" if share <= NOTE_SHARE else "warning" if share <= WARNING_SHARE else "reject"
    )
    message = (
        f"time was uneven (steps from {facts['shortest_step_s']:.4g} to "
        f"{facts['longest_step_s']:.4g} s) and is resampled at {channel.sampling_rate_hz:.6g} Hz; "
        f"a sample errs by at most {100 * share:.2g} % of the peak"
    )
    return [Finding("resampled-time", severity, message, channel.name, dict(facts))]
