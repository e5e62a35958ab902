"""Gaps that no effect of the catalogue explains: densities for any of their sizes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .background import Kernels
from .cells import Cells
from .courses import SAME, Course
from .creep import Creep
from .laid import Laid
from .logs import log_mean, log_sum
from .surface import Surface
from .whitening import Whitening

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Sizes of what strays, in tolerances.
AMPLITUDES = (3.0, 6.0, 12.0)
#: Manners of the catalogue's effects.
_LAWFUL = ("law", "direction")


@dataclass(frozen=True, eq=False)
class Way:
    """One way in which a stage may stray, W W' for a size of one tolerance; `whitened` (N + d, q) is W before a
    background: in the N cells, and in the d slopes of what repetitions say beside (`Creep`).

    Over the configurations of a `course`; in what observables says the `manner`: in a "direction" in which effects of
    the catalogue move them, in a "band" of a channel's lines, in all of one "mode", as the "law" of one effect, or in
    "one" of them. What has one size alone, q = 1, is larger than `least`: what stays within tolerance is none, and a
    normal density would have a fourth of its weight there.
    """

    stage: str
    course: str
    manner: str
    whitened: Floats
    least: float = 0.0


@dataclass(frozen=True, eq=False)
class Strays:
    """All m ways before one background.

    With C the background's covariance: |C + a^2 W W'| and its inverse by the eigenvalues of W' C^-1 W, so that all
    sizes cost one decomposition. `directions` (N + d, Q) are those of all ways side by side, each way's from `starts`
    (m,) on, with `strength` (Q,) their eigenvalues; `least` (m,) as in `Way`; `names` (stage, course, manner) of each.
    """

    white: Whitening
    directions: Floats
    strength: Floats
    starts: Rows
    least: Floats
    names: tuple[tuple[str, str, str], ...]

    @classmethod
    def of(cls, white: Whitening, ways: Sequence[Way]) -> Self:
        from scipy.linalg import eigh

        directions, strength = [], []
        for way in ways:
            gram = way.whitened.T @ way.whitened
            if gram.size == 1:
                values, turned = gram[0], way.whitened
            else:
                values, axes = eigh(gram, check_finite=False)
                turned = way.whitened @ axes
            directions.append(turned)
            strength.append(np.maximum(values, 0.0))
        starts = np.concatenate([[0], np.cumsum([each.size for each in strength])[:-1]]).astype(np.intp)
        alone = [way.least if way.whitened.shape[1] == 1 else 0.0 for way in ways]
        names = tuple((way.stage, way.course, way.manner) for way in ways)
        return cls(white, np.concatenate(directions, axis=1), np.concatenate(strength), starts, np.array(alone), names)

    def roots(self, way: int) -> Floats:
        """(N + d, q): W before the background, turned to its own axes."""
        ends = [*self.starts[1:].tolist(), len(self.strength)]
        return self.directions[:, self.starts[way] : ends[way]]

    def log_densities(self, zw: Floats, slope: Floats) -> Floats:
        """(m,) means over `AMPLITUDES`, of what `white` makes of a gap (N,), and over those of the slopes where nothing
        drifts; `slope` (d,) are these, whitened."""
        plain = self.white.log_norm - 0.5 * float(zw @ zw)
        along = self.directions.T @ np.concatenate([zw, slope])
        gains = [self._gain(along, amplitude) for amplitude in AMPLITUDES]
        return np.asarray(plain + log_sum(np.stack(gains), axis=0) - np.log(len(AMPLITUDES)))

    def _gain(self, along: Floats, amplitude: float) -> Floats:
        over = 1 + amplitude**2 * self.strength
        gain = np.add.reduceat(0.5 * amplitude**2 * along**2 / over - 0.5 * np.log(over), self.starts)
        spread = amplitude / over[self.starts] ** 0.5
        size = spread**2 * along[self.starts]
        beyond = _log_beyond(self.least, size, spread) - _log_beyond(self.least, 0.0, amplitude)
        return np.asarray(gain + np.where(self.least > 0, beyond, 0.0))

    def log_mean(self, stage: str, logs: Floats) -> float:
        """ln of the mean density in a stage, of (m,): courses count alike, manners in one, and ways in a manner."""
        if stage not in self._placed:
            return -np.inf  # nothing was measured there
        return log_mean([log_mean([log_mean(logs[at]) for at in manners]) for manners in self._placed[stage]])

    @cached_property
    def _placed(self) -> dict[str, list[list[Rows]]]:
        found: dict[str, dict[str, dict[str, list[int]]]] = {}
        for i, (stage, course, manner) in enumerate(self.names):
            found.setdefault(stage, {}).setdefault(course, {}).setdefault(manner, []).append(i)
        return {
            stage: [[np.array(at, dtype=np.intp) for at in manners.values()] for manners in courses.values()]
            for stage, courses in found.items()
        }


def _log_beyond(least: Floats, mean: Floats | float, spread: Floats | float) -> Floats:
    """ln of the probability that a normal number is larger than `least`, of either sign."""
    from scipy.special import log_ndtr

    return np.asarray(np.logaddexp(log_ndtr((mean - least) / spread), log_ndtr((-mean - least) / spread)))


@dataclass(frozen=True, eq=False)
class Ways:
    """In which a campaign may stray, by stage, before any background."""

    laid: tuple[Laid, ...]
    over: tuple[tuple[Course, ...], ...]
    creep: Creep

    @classmethod
    def of(cls, stages: Iterable[str], cells: Cells, kernels: Kernels, surfaces: Sequence[Surface]) -> Self:
        names = [name for name in stages if (kernels.stage == name).any()]
        laid = tuple(Laid.of(name, cells, kernels, surfaces) for name in names)
        return cls(laid, tuple(tuple(kernels.courses(name)) for name in names), cells.creep)

    def before(self, white: Whitening) -> Strays:
        found: list[Way] = []
        for laid, over in zip(self.laid, self.over, strict=True):
            seen = laid.seen(white)
            for one in over:
                for manner, root, least in laid.roots(seen, one, self.creep):
                    if one.name == SAME and manner in _LAWFUL:
                        continue  # the same share of an effect everywhere is that effect
                    found.append(Way(laid.stage, one.name, manner, root, least))
        return Strays.of(white, found)
