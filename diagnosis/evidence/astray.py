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
from .way import Way
from .whitening import Whitening

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Sizes of what strays, in tolerances.
AMPLITUDES = (3.0, 6.0, 12.0)
#: Manners of the catalogue's effects.
_LAWFUL = ("law", "direction")


@dataclass(frozen=True, eq=False)
class Strays:
    """All m ways before one background.

    With C the background's covariance: |C + a^2 W W'| and its inverse by the eigenvalues of W' C^-1 W, so that all
    sizes cost one decomposition: `axes` of each way, and side by side `strength` (Q,), their eigenvalues, each way's
    from `starts` (m,) on. `slopes` is their number; `least` (m,) as in `Way`; `names` (stage, course, manner) of each.
    """

    white: Whitening
    ways: tuple[Way, ...]
    slopes: int
    axes: tuple[Floats, ...]
    strength: Floats
    starts: Rows
    least: Floats

    @classmethod
    def of(cls, white: Whitening, ways: Sequence[Way], slopes: int = 0) -> Self:
        from scipy.linalg import eigh

        axes, strength = [], []
        for way in ways:
            gram = way.gram
            values, turned = (gram[0], np.ones((1, 1))) if gram.size == 1 else eigh(gram, check_finite=False)
            axes.append(turned)
            strength.append(np.maximum(values, 0.0))
        starts = np.concatenate([[0], np.cumsum([each.size for each in strength])[:-1]]).astype(np.intp)
        alone = [way.least if each.size == 1 else 0.0 for way, each in zip(ways, strength, strict=True)]
        return cls(white, tuple(ways), slopes, tuple(axes), np.concatenate(strength), starts, np.array(alone))

    @cached_property
    def names(self) -> tuple[tuple[str, str, str], ...]:
        return tuple((way.stage, way.course, way.manner) for way in self.ways)

    def roots(self, way: int) -> Floats:
        """(N + d, q): W before the background, turned to its own axes."""
        return np.asarray(self.ways[way].whitened(self.slopes) @ self.axes[way])

    def log_densities(self, zw: Floats, slope: Floats) -> Floats:
        """(m,) means over `AMPLITUDES`, of what `white` makes of a gap (N,), and over those of the slopes where nothing
        drifts; `slope` (d,) are these, whitened."""
        plain = self.white.log_norm - 0.5 * float(zw @ zw)
        blocks = {id(way.block): way.block for way in self.ways}
        projected = {name: block.along(zw) for name, block in blocks.items()}
        along = np.concatenate(
            [
                axes.T @ way.along(projected[id(way.block)], slope)
                for way, axes in zip(self.ways, self.axes, strict=True)
            ]
        )
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
                # the same share of an effect everywhere is that effect
                ways = laid.ways_over(seen, one, self.creep)
                found += [way for way in ways if one.name != SAME or way.manner not in _LAWFUL]
        return Strays.of(white, found, len(self.creep.columns))
