"""Small errors of a simulator that no named effect explains: the same bank of covariances in every hypothesis.

With measurement noise alone any simulator that is not perfect raises false alarms (Kennedy and O'Hagan, J. R. Stat.
Soc. B 63 (2001) 425, on model discrepancy). One kernel met with a rougher background than it assumes does so, too:
hence a bank of smooth and white ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..gap import GapTable
from .cells import Cells
from .courses import Course, courses
from .creep import Creep
from .factors import squared_distances, varying

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Background:
    """Amplitudes in tolerances: the same everywhere, smooth over the factors, white over configurations.

    Of `detail` of them where an observable is a detail of shape or timing. `gain`: smooth and white, what all lines of
    an accelerometer share as its coupling and its place differ from one configuration to the next.
    """

    constant: float
    smooth: float = 0.0
    white: float = 0.0
    detail: float = 1.0
    gain: tuple[float, float] = (0.0, 0.0)


_SIZES = (
    (0.5, 0.0, 0.0),
    (1.0, 0.0, 0.0),
    (0.0, 0.5, 0.0),
    (0.0, 0.0, 0.4),
    (0.5, 0.3, 0.2),
    (1.0, 0.5, 0.3),
    (0.5, 0.5, 0.8),
)
_FINE = 0.15
_NONE, _MIDDLE = Background(0.0), Background(0.5, 0.3, 0.2)
_ROUGH = Background(0.5, 0.5, 0.8, _FINE)
#: Their largest amplitude is about the tolerance itself: a gap of that size is none. Shapes and timings may be met as
#: badly as amplitudes or far better: an error of amplitudes would be priced by all shapes that are right.
BANK = (_NONE, *(Background(*sizes, detail=detail) for detail in (1.0, _FINE) for sizes in _SIZES))
_UNDER = (_NONE, Background(0.5), _MIDDLE, replace(_MIDDLE, detail=_FINE), _ROUGH)
#: A plate's modes are off by the same in all configurations; from one to the next its sensors are.
PLATES = "plate"
_LITTLE, _SOME, _MUCH = (0.3, 0.2), (0.5, 0.5), (0.8, 0.6)
_PLAIN = tuple(
    Background(constant, detail=_FINE, gain=gain)
    for constant, gain in ((0.25, _LITTLE), (0.5, _LITTLE), (0.5, _SOME), (0.8, _SOME))
)
PLATE_BANK = (
    _NONE,
    *_PLAIN,
    *(
        Background(constant, detail=_FINE, gain=gain)
        for constant, gain in ((0.25, _SOME), (0.8, _LITTLE), (1.0, _MUCH))
    ),
    *(Background(constant, gain=gain) for constant, gain in ((0.25, _LITTLE), (0.5, _LITTLE), (0.8, _SOME))),
    Background(0.5),
    _MIDDLE,
    _ROUGH,
)
_UNDER_PLATES = (_NONE, _PLAIN[0], _PLAIN[2], Background(0.25, gain=_LITTLE), _MIDDLE)
#: Of a plate behind other stages and of these, each with each.
_FRONT = (_NONE, _MIDDLE, replace(_MIDDLE, detail=_FINE), _ROUGH)
BOTH_BANK = (
    (_NONE, _NONE),
    *((front, behind) for front in _FRONT for behind in _PLAIN),
    (_ROUGH, Background(1.0, detail=_FINE, gain=_MUCH)),
)
_UNDER_BOTH = ((_NONE, _NONE), (_MIDDLE, _PLAIN[1]), (_FRONT[2], _PLAIN[2]), (_ROUGH, _PLAIN[2]))


def bank(stages: Sequence[str]) -> tuple[dict[str, Background], ...]:
    """By stage, each member of the bank."""
    return _by_stage(stages, BANK, PLATE_BANK, BOTH_BANK)


def under(stages: Sequence[str]) -> tuple[dict[str, Background], ...]:
    """The members that always may lie under a gap that no effect explains."""
    return _by_stage(stages, _UNDER, _UNDER_PLATES, _UNDER_BOTH)


def _by_stage(
    stages: Sequence[str],
    one: Sequence[Background],
    plates: Sequence[Background],
    both: Sequence[tuple[Background, Background]],
) -> tuple[dict[str, Background], ...]:
    others = [name for name in stages if name != PLATES]
    if PLATES not in stages:
        return tuple(dict.fromkeys(stages, each) for each in one)
    if not others:
        return tuple({PLATES: each} for each in plates)
    return tuple(dict.fromkeys(others, front) | {PLATES: behind} for front, behind in both)


#: Range of the smooth part over factors scaled to [0, 1], and over frequency in octaves.
LENGTH, OCTAVES = 0.8, 0.7
#: How much of the variance neighbouring observables share; what has parts has so much beside them.
SHARED, OWN = 0.5, 0.1


@dataclass(frozen=True, eq=False)
class Kernels:
    """Squared distances (C, C) of configurations over factors, what drifts from the first run to the last does to them
    (`Creep`), their factors, and by stage how loud they are (C,); (N, N) between cells what observables have in common.
    `configuration`, `stage`, `channel`, `octave`, `unit` and `detail` are of cells."""

    distance: Floats
    creep: Creep
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
            cells.creep,
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

    def background(self, by_stage: Mapping[str, Background]) -> Floats:
        """(N, N). Stages have no error in common."""
        found, same, smooth = np.zeros_like(self.observables), np.eye(len(self.distance)), self._smooth
        for name, one in by_stage.items():
            here = np.flatnonzero(self.stage == name)
            share, at = np.where(self.detail[here], one.detail, 1.0), self.configuration[here]
            over = one.constant**2 + one.smooth**2 * smooth + one.white**2 * same
            gain = one.gain[0] ** 2 * smooth + one.gain[1] ** 2 * same
            block, of = np.ix_(here, here), np.ix_(at, at)
            alike = self._levels[here, None] & self._levels[here] & (self.channel[here, None] == self.channel[here])
            found[block] = over[of] * self.observables[block] * np.outer(share, share) + gain[of] * alike
        return found

    @cached_property
    def _levels(self) -> NDArray[np.bool_]:
        """(N,): lines of a spectrum, and amplitudes of modes in the same channels."""
        spectra = np.unique(self.channel[self.unit == "dB"])
        return np.asarray(np.isfinite(self.octave) & np.isin(self.channel, spectra))

    @cached_property
    def _smooth(self) -> Floats:
        return varying(self.distance, LENGTH)

    def courses(self, stage: str) -> list[Course]:
        return courses(self.distance, self.creep, self.factors, self.loudness[stage])


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
