"""Rest level: the record does not begin at zero."""

from __future__ import annotations

from ....signals.srs.record import Spectrum
from .base import MIN_ERRORS, Finding, Record, level
from .zero_shift import LIMIT


def check_rest_level(record: Record, _: Spectrum) -> Finding | None:
    """Needs 16 samples before the shock. A constant offset b puts b under every line of the spectrum."""
    if record.before.size == 0 or record.peak_m_s2 == 0.0:
        return None
    rest, error = level(record.before)
    value = abs(rest) / record.peak_m_s2
    if value < LIMIT or abs(rest) < MIN_ERRORS * error:
        return None
    message = (
        f"rests at {rest:.4g} m/s2 before the shock (gravity, or an amplifier's offset): lines of that height are its "
        "own; take the level off"
    )
    return Finding("rest-level", value, LIMIT, "", message)
