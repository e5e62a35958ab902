"""Small errors of a simulator that no named effect explains: the same bank of covariances in every hypothesis.

With measurement noise alone any simulator that is not perfect raises false alarms (Kennedy and O'Hagan, J. R. Stat.
Soc. B 63 (2001) 425, on model discrepancy). One kernel met with a rougher background than it assumes does so, too:
hence a bank of smooth and white ones.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..gap import GapTable
from .cells import Cells
from .courses import Course, courses
from .factors import squared_distances, varying

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Background:
    """Amplitudes in tolerances: the same everywhere, smooth over the factors, white over configurations.

    Of `detail` of them where an observable is a detail of shape or timing.
    """

    constant: float
    smooth: float
    white: float
    detail: float = 1.0


_SIZES = (
    (0.5, 0.0, 0.0),
    (1.0, 0.0, 0.0),
    (0.0, 0.5, 0.0),
    (0.0, 0.0, 0.4),
    (0.5, 0.3, 0.2),
    (1.0, 0.5, 0.3),
    (0.5, 0.5, 0.8),
)
#: Their largest amplitude is about the tolerance itself: a gap of that size is none. Shapes and timings may be met as
#: badly as amplitudes or far better: an error of amplitudes would be priced by all shapes that are right.
BANK = (
    Background(0.0, 0.0, 0.0),
    *(Background(*sizes, detail=detail) for detail in (1.0, 0.15) for sizes in _SIZES),
)
#: Of the bank, what always may lie under a gap that no effect explains.
MIDDLE = Background(0.5, 0.3, 0.2)
UNDER = (BANK[0], Background(0.5, 0.0, 0.0), MIDDLE, replace(MIDDLE, detail=0.15), Background(0.5, 0.5, 0.8, 0.15))
#: Range of the smooth part over factors scaled to [0, 1], and over frequency in octaves.
LENGTH, OCTAVES = 0.8, 0.7
#: How much of the variance neighbouring observables share; what has parts has so much beside them.
SHARED, OWN = 0.5, 0.1


@dataclass(frozen=True, eq=False)
class Kernels:
    """Squared distances (C, C) of configurations over factors and over the order of runs, their factors, and by stage
    how loud they are (C,); (N, N) between cells what observables have in common. `configuration`, `stage`, `channel`,
    `octave`, `unit` and `detail` are of cells."""

    distance: Floats
    apart: Floats
    factors: tuple[dict[str, str | float], ...]
    loudness: dict[str, Floats]
    configuration: NDArray[np.intp]
    observables: Floats
    stage: NDArray[np.str_]
    channel: NDArray[np.str_]
    octave: Floats
    unit: NDArray[np.str_]
    detail: NDArray[np.bool_]

    @classmethod
    def of(cls, gap: GapTable, cells: Cells) -> Kernels:
        factors = [gap.record.configurations[int(row)].factors for row in gap.rows]
        stage = np.array([gap.observables[int(o)].stage for o in cells.observable])
        return cls(
            squared_distances(factors),
            _in_time(gap),
            tuple(dict(each) for each in factors),
            {name: level[gap.rows] for name, level in gap.loudness.items()},
            cells.configuration,
            _between(gap)[np.ix_(cells.observable, cells.observable)],
            stage,
            np.array([gap.observables[int(o)].channel for o in cells.observable]),
            _octaves(gap)[cells.observable],
            np.array([gap.observables[int(o)].unit for o in cells.observable]),
            np.array([gap.observables[int(o)].detail for o in cells.observable]),
        )

    def background(self, one: Background) -> Floats:
        same = np.eye(len(self.distance))
        over = one.constant**2 + one.smooth**2 * varying(self.distance, LENGTH) + one.white**2 * same
        share = np.where(self.detail, one.detail, 1.0)
        return np.asarray(self._spread(over) * self.observables * np.outer(share, share))

    def courses(self, stage: str) -> list[Course]:
        return courses(self.distance, self.apart, self.factors, self.loudness[stage])

    def _spread(self, over: Floats) -> Floats:
        """(C, C) to (N, N)."""
        return np.asarray(over[np.ix_(self.configuration, self.configuration)])


def _in_time(gap: GapTable) -> Floats:
    """(C, C): squared distance of the configurations' mean places in the order of runs, which is scaled to [0, 1]."""
    of, order = gap.record.configuration_of, np.array([run.order for run in gap.record.runs], dtype=np.float64)
    place = np.array([order[of == row].mean() if np.any(of == row) else 0.0 for row in gap.rows])
    place /= max(float(np.ptp(order)), 1.0)
    return np.asarray((place[:, None] - place[None, :]) ** 2)


def _octaves(gap: GapTable) -> Floats:
    """(D,): logarithms of the frequencies, NaN where there is none."""
    return np.array([np.nan if item.frequency_hz is None else np.log2(item.frequency_hz) for item in gap.observables])


def _between(gap: GapTable) -> Floats:
    """(D, D): one on the diagonal; part of it shared within a channel, by octaves where there are frequencies. What is
    made of parts has the errors of these, and a little of its own."""
    channel = np.array([f"{item.stage} {item.channel}" for item in gap.observables])
    octave = _octaves(gap)
    apart = octave[:, None] - octave[None, :]
    near = np.where(np.isnan(apart), 0.0, np.exp(-0.5 * (np.nan_to_num(apart) / OCTAVES) ** 2))
    alike = channel[:, None] == channel[None, :]
    parts = [set(item.parts) for item in gap.observables]
    made = np.array([[len(one & other) for other in parts] for one in parts], dtype=np.float64) * alike
    own = np.where(np.diag(made) > 0, np.diag(made) + OWN, 1.0)
    return np.asarray(np.where(np.eye(len(channel), dtype=bool), own, SHARED * near * alike + made))
