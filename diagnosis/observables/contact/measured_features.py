"""What the force channel shows of pulses: through its sensors, and sampled as the record is.

Between the samples a recorder knows nothing, so a pulse is sampled at two phases and its features are averaged: their
mean over all phases is within a tenth of a tolerance of that from five samples in a contact on. What a recorder's
anti-alias filter does to a pulse is less than that from six samples in a contact on, and is left out.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ....twin.sensors.chain import SensorChain
from .features import NAMES, features
from .force_histories import Courses
from .rows import taken

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Steps to a compression; how many compressions a series covers before the contact and from its begin on.
_STEPS, _BEFORE, _AFTER = 24, 0.6, 7.0
#: Where between two of the recorder's samples contacts begin.
_OFFSETS = (0.25, 0.75)
_AT_ONCE = 100  # some 2 MB, which a cache holds


def seen_features(courses: Courses, step_s: Floats, chain: SensorChain) -> Floats:
    """(n, d) of n contacts as records in steps of `step_s` (n,) show them; NaN where there is none."""
    found = np.full((len(step_s), len(NAMES)), np.nan)
    for rows in _groups(courses.compression_time_s, step_s):
        found[rows] = _features(courses, rows, float(step_s[rows[0]]), chain)
    return found


def _groups(compression_time_s: Floats, step_s: Floats) -> Iterator[Rows]:
    """Impacts that share a record's step and are alike in duration, within a factor of two."""
    known = np.flatnonzero(np.isfinite(compression_time_s))
    octave = np.floor(np.log2(compression_time_s[known]))
    for key in np.unique(np.stack([octave, step_s[known]]), axis=1).T:
        rows = known[(octave == key[0]) & (step_s[known] == key[1])]
        yield from np.array_split(rows, -(-len(rows) // _AT_ONCE))


def _features(courses: Courses, rows: Rows, step_s: float, chain: SensorChain) -> Floats:
    # By octaves, not by the shortest: a contact's features do not depend on which others are asked with it.
    shortest = float(2 ** np.floor(np.log2(courses.compression_time_s[rows[0]])))
    if step_s * _STEPS <= shortest:
        step = shortest / _STEPS
        return features(_shown(courses, rows, step, chain), step, shortest)
    finer = 4 * int(np.ceil(_STEPS * step_s / shortest / 4))
    fine = _shown(courses, rows, step_s / finer, chain)
    phases = [features(fine[:, int(offset * finer) :: finer], step_s, shortest) for offset in _OFFSETS]
    return np.asarray(sum(phases) / len(phases))


def _shown(courses: Courses, rows: Rows, step_s: float, chain: SensorChain) -> Floats:
    """Forces (k, p) that the sensors show in steps of `step_s`, from a little before the contact on."""
    longest = float(2 ** np.ceil(np.log2(courses.compression_time_s[rows].max())))
    time = np.arange(-np.ceil(_BEFORE * longest / step_s), np.ceil(_AFTER * longest / step_s) + 1) * step_s
    each = SensorChain(tuple(taken(effect, rows) for effect in chain.effects))
    return each.measured_force_n(courses.at(rows, time), step_s)
