"""Velocity: does the integral of an acceleration end where a structure can be?

After A. G. Piersol's check of pyroshock data (NASA-HDBK-7005, section 4; IEST-RP-DTE012): velocity
comes back to rest, or levels out on a free body.
"""

from __future__ import annotations

from ..channel import Channel
from .base import Contact, Finding
from .motion import motion_of

#: A free body keeps at most the largest velocity that the shock gave it; half as much again is for
#: noise.
LIMIT = 1.5


def check_velocity(channel: Channel, contacts: tuple[Contact, ...]) -> list[Finding]:
    """At most one finding, of an acceleration that is not of what moves on purpose: its final
    velocity passes 1.5 times the largest while the shock lasts, by more than noise in the level
    before the shock explains.

    A `note` where an offset below 0.5 % of the peak would do that, else a `warning`.
    """
    motion = motion_of(channel, contacts)
    if motion is None or (shock_m_s := motion.shock_velocity_m_s) == 0.0:
        return []
    final_m_s = float(motion.velocity_m_s[-1])
    ratio = abs(final_m_s) / shock_m_s
    if ratio < LIMIT or abs(final_m_s) < motion.drift_m_s2 * motion.lasts_s:
        return []
    evidence = {
        "final_velocity_m_s": final_m_s,
        "shock_velocity_m_s": shock_m_s,
        "velocity_ratio": ratio,
        "limit_ratio": LIMIT,
    }
    message = (
        f"integrates to {final_m_s:.3g} m/s at the end, after {shock_m_s:.3g} m/s in the shock: an "
        "offset, unless something pushed on; do not trust lines of a spectrum at which the "
        "pseudo-velocity is of that size"
    )
    return [
        Finding(
            "velocity", motion.severity(final_m_s / motion.lasts_s), message, channel.name, evidence
        )
    ]
