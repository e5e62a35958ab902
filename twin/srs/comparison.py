"""Spectra held against a target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .target import Target


@dataclass(frozen=True, eq=False)
class SpectrumComparison:
    """Spectra held against a target at `frequency_hz` (f,), the lines that both have.

    `error_db` (..., f) is 20 log10(spectrum / level); `margin_db` (..., f) the way to the nearer edge of the band,
    positive inside. Per spectrum (...,): `share_within` and `share_above` (the level) of the lines, the smallest margin
    and its frequency.
    """

    frequency_hz: Floats
    target: Target
    error_db: Floats
    margin_db: Floats
    share_within: Floats
    share_above: Floats
    worst_margin_db: Floats
    worst_frequency_hz: Floats

    @property
    def within(self) -> NDArray[np.bool_]:
        """Whether every line lies within its tolerance, (...,)."""
        return np.asarray(self.worst_margin_db >= 0)


def compare(maximax_m_s2: Floats, frequency_hz: Floats, target: Target) -> SpectrumComparison:
    """Spectra (..., f) at `frequency_hz` (f,) against a target. Lines outside of the target's range are left out.

    An edge belongs to the band, to within rounding. Raises `ValueError` where no line lies in the target's range.
    """
    inside = target.covers(frequency_hz)
    if not np.any(inside):
        raise ValueError(
            f"no line of the spectrum ({frequency_hz.min():g} to {frequency_hz.max():g} Hz) lies in the target's range "
            f"({target.frequency_hz[0]:g} to {target.frequency_hz[-1]:g} Hz)"
        )
    lines = target.at(frequency_hz[inside])
    with np.errstate(divide="ignore"):  # no response at all is -inf dB
        error = 20 * np.log10(maximax_m_s2[..., inside] / lines.level_m_s2)
    error = np.where(np.abs(error) < 1e-9, 0.0, error)
    margin = np.minimum(lines.upper_db - error, lines.lower_db + error)
    margin = np.where(np.abs(margin) < 1e-9, 0.0, margin)
    worst = margin.argmin(axis=-1)
    return SpectrumComparison(
        frequency_hz=lines.frequency_hz,
        target=lines,
        error_db=error,
        margin_db=margin,
        share_within=np.asarray((margin >= 0).mean(axis=-1)),
        share_above=np.asarray((error >= 0).mean(axis=-1)),
        worst_margin_db=np.asarray(margin.min(axis=-1)),
        worst_frequency_hz=lines.frequency_hz[worst],
    )
