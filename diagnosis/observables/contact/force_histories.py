"""True forces of many contacts, each on a clock of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ....twin.contact.effect import ContactEffect
from ....twin.contact.pulse import ContactPulse
from ...record import Series
from .rows import taken
from .site import Sites

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Times over the compression time; what a contact that hardly ends does later is next to nothing.
_TO_COMPRESSION, _LAST = 40, 7
PLACES = np.arange(_TO_COMPRESSION * _LAST + 1) / _TO_COMPRESSION


@dataclass(frozen=True, eq=False)
class Courses:
    """n contacts: `force_n` (n, p) at `PLACES` times `compression_time_s` (n,); NaN where there is no answer."""

    force_n: Floats
    compression_time_s: Floats

    @classmethod
    def none(cls, count: int) -> Self:
        return cls(np.full((count, len(PLACES)), np.nan), np.full(count, np.nan))

    def at(self, rows: Rows, time_s: Floats) -> Floats:
        """(k, p): of contacts `rows` (k,) at times (p,) from their begin on, 0 before and behind."""
        place = time_s / self.compression_time_s[rows, None] * _TO_COMPRESSION
        inside = (place > 0) & (place < len(PLACES) - 1)
        place = np.where(inside, place, 0.0)
        left = place.astype(np.intp)
        before, after = self.force_n[rows[:, None], left], self.force_n[rows[:, None], left + 1]
        return np.where(inside, before + (place - left) * (after - before), 0.0)

    def series(self, row: int, step_s: float) -> Series | None:
        """One contact in steps of `step_s`, from two before it on until it has ended; the impulse is kept."""
        if np.isnan(self.compression_time_s[row]):
            return None
        own = self.compression_time_s[row] / _TO_COMPRESSION
        last = int(np.flatnonzero(self.force_n[row] > 0).max(initial=1)) + 1
        time = np.arange(-2, int(np.ceil(last * own / step_s)) + 2, dtype=np.float64) * step_s
        values = self.at(np.array([row]), time)[0]
        total, sampled = float(np.trapezoid(self.force_n[row]) * own), float(values.sum() * step_s)
        return Series(values * (total / sampled if sampled > 0 else 1.0), 1 / step_s, float(time[0]))


def law_courses(sites: Sites, effects: tuple[ContactEffect, ...], velocity_m_s: Floats) -> Courses:
    """Hertz' impacts, or as effects change them, at true velocities (n,); NaN where there is no velocity above 0.

    Parameters are numbers, or arrays (n,).
    """
    found = Courses.none(len(sites))
    _fill(found, np.flatnonzero(velocity_m_s > 0), sites, effects, velocity_m_s)
    return found


def _fill(found: Courses, rows: Rows, sites: Sites, effects: tuple[ContactEffect, ...], velocity_m_s: Floats) -> None:
    """Contacts that do not come to an end are left out, and found by halves."""
    if not len(rows):
        return
    acting = tuple(taken(each, rows) for each in effects)
    try:
        pulse = sites.take(rows).pulses(velocity_m_s[rows], acting)
    except ArithmeticError:
        if len(rows) > 1:
            for half in np.array_split(rows, 2):
                _fill(found, half, sites, effects, velocity_m_s)
        return
    found.compression_time_s[rows] = pulse.compression_time_s
    found.force_n[rows] = _tabulated(pulse)


def _tabulated(pulse: ContactPulse) -> Floats:
    """A solved impact's shape takes phases of each contact, (n, p), as well as common ones."""
    phase = np.minimum(PLACES * (pulse.compression_time_s / pulse.contact_time_s)[:, None], 1.0)
    return pulse.force_at(phase)
