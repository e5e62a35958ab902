"""What an acceleration record says of the motion of the structure: its velocity, about the level
before the shock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel, on_impactor
from .base import Contact, Severity
from .levels import block_mean, finite_samples, rest_before, shock_span

#: Standard errors of the level taken off that its drift of the velocity is allowed (`rest.BLOCKS`
#: tells why so many).
MIN_ERRORS = 5.0


#: A constant offset of this share of the peak spoils a spectrum's slow lines (the check of zero
#: shifts tells why); what integrates to less is worth a note.
DOUBTFUL_SHARE = 0.005
#: A longer record is integrated in so many blocks: what swings within one carries little velocity.
BLOCKS = 65536


@dataclass(frozen=True)
class IntegratedMotion:
    """What an acceleration record integrates to from the begin of its shock on, about the level
    before it.

    `velocity_m_s` (k,) is that at the ends of blocks of `block_s`, one sample each as long as the
    record is short, and `shock_velocity_m_s` the largest while the shock lasts. `drift_m_s2` is an
    acceleration that noise in the level taken off may have left.
    """

    velocity_m_s: NDArray[np.float64]
    block_s: float
    shock_velocity_m_s: float
    drift_m_s2: float
    peak_m_s2: float

    def severity(self, offset_m_s2: float) -> Severity:
        """Of a finding that a constant offset of this size would explain."""
        return "warning" if abs(offset_m_s2) >= DOUBTFUL_SHARE * self.peak_m_s2 else "note"

    @property
    def lasts_s(self) -> float:
        return self.velocity_m_s.size * self.block_s


def motion_of(channel: Channel, contacts: tuple[Contact, ...]) -> IntegratedMotion | None:
    """The motion that an acceleration tells; None of other quantities, of what moves on purpose, of
    a constant, and without a rest before the shock."""
    return channel.once(("motion", contacts), lambda: _motion_of(channel, contacts))


def _motion_of(channel: Channel, contacts: tuple[Contact, ...]) -> IntegratedMotion | None:
    if channel.quantity != "acceleration" or on_impactor(channel.sensor.position):
        return None
    x = finite_samples(channel)
    span = shock_span(channel, contacts)
    if span is None:
        return None
    before = rest_before(x, span)
    if before.size == 0:
        return None  # an offset of the sensor integrates to any velocity
    level, error = block_mean(before)
    length = -(-(x.size - span.first) // BLOCKS)
    count = (x.size - span.first) // length
    blocks = x[span.first : span.first + count * length].reshape(count, length)
    sums = (
        np.einsum("ij->i", blocks) - length * level
    )  # four times as fast as sum() over short rows
    velocity_m_s = np.cumsum(sums) * channel.period_s
    in_shock = velocity_m_s[: (span.last - span.first) // length + 1]
    return IntegratedMotion(
        velocity_m_s=velocity_m_s,
        block_s=length * channel.period_s,
        shock_velocity_m_s=float(np.abs(in_shock).max()),
        drift_m_s2=MIN_ERRORS * error,
        peak_m_s2=span.peak,
    )
