"""Gaps that no effect of the catalogue explains: densities for any of their sizes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from .background import AMPLITUDES, Kernels, Stray
from .cells import Cells
from .logs import log_mean
from .surface import Surface
from .whitening import Whitening

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Directions in which effects of the catalogue move the observables of a stage.
_DIRECTIONS = 4
#: Bands of a channel's lines.
_BANDS = 3
#: Two effects whose changes are parallel but for this have one law.
_SAME = 0.995
#: A cell that moves by less of an effect's largest change is left alone by it.
_MOVED = 1e-3


class Astray(Protocol):
    """One way in which a stage may stray."""

    @property
    def stage(self) -> str: ...

    def log_density(self, z: Floats) -> float: ...


@dataclass(frozen=True, eq=False)
class AnyWay:
    """In every observable alike."""

    stage: str
    white: Whitening

    def log_density(self, z: Floats) -> float:
        return self.white.log_density(z)


@dataclass(frozen=True, eq=False)
class AsEffectsDo:
    """In the directions (N, q) of the catalogue's effects, before a background: mean over `AMPLITUDES`.

    With C the background's covariance and W W' that of the stray: |C + a^2 W W'| and its inverse by the eigenvalues of
    W' C^-1 W, so that all sizes cost one decomposition.
    """

    stage: str
    white: Whitening
    directions: Floats
    strength: Floats  # eigenvalues (q,)

    @classmethod
    def of(cls, stage: str, white: Whitening, whitened: Floats) -> Self:
        """`whitened` (N, q) is W before that background."""
        from scipy.linalg import eigh

        strength, turned = eigh(whitened.T @ whitened)
        return cls(stage, white, whitened @ turned, np.maximum(strength, 0.0))

    def log_density(self, z: Floats) -> float:
        zw = self.white.white(z)
        along, plain = (self.directions.T @ zw) ** 2, self.white.log_norm - 0.5 * float(zw @ zw)
        return log_mean([plain + self._gain(along, amplitude**2) for amplitude in AMPLITUDES])

    def _gain(self, along: Floats, variance: float) -> float:
        over = 1 + variance * self.strength
        return float(0.5 * (variance * along / over).sum() - 0.5 * np.log(over).sum())


def astray(
    strays: Sequence[Stray],
    cells: Cells,
    kernels: Kernels,
    surfaces: Sequence[Surface],
    middle: Floats,
    under: Sequence[Whitening],
) -> tuple[Astray, ...]:
    """`under`: backgrounds that may lie under a gap that nothing explains, since effects may choose theirs, too;
    `middle` (N, N) is noise and one of them, for strays in any way, which cost more."""
    found: list[Astray] = []
    for stage in dict.fromkeys(one.stage for one in strays):
        laid = _Laid.of(stage, cells, kernels, surfaces)
        own = [one for one in strays if one.stage == stage]
        found += [
            AnyWay(stage, Whitening.of(middle + kernels.stray(one, one.amplitude)))
            for one in own
            if one.amplitude is not None
        ]
        for white in under:
            seen = laid.seen(white)
            for one in own:
                if one.amplitude is None:
                    found += [AsEffectsDo.of(stage, white, each) for each in laid.roots(seen, kernels.over(one))]
    return tuple(found)


@dataclass(frozen=True, eq=False)
class _Laid:
    """Directions (d, r) in which the d observables of a stage may stray, and which of them go together.

    `ways` are columns and their weight; `laws` (N, e) what each effect does in all stages, one tolerance rms in this
    one: what a sensor between two stages misreads shows in both. With K = L L' over configurations a stray is
    W = L x directions: so they are whitened once, and every K only mixes configurations.
    """

    here: Rows
    rows: Rows  # configurations
    at: tuple[Rows, Rows]  # of each cell
    directions: Floats
    ways: tuple[tuple[Rows, float], ...]
    laws: Floats
    configuration: Rows  # of all cells

    @classmethod
    def of(cls, stage: str, cells: Cells, kernels: Kernels, surfaces: Sequence[Surface]) -> Self:
        here = np.flatnonzero(kernels.stage == stage)
        rows, columns = np.unique(cells.configuration), np.unique(cells.observable[here])
        shared = _directions(here, columns, cells, surfaces)
        n = shared.shape[1]
        alone = [(np.array([i]), float(np.sqrt(n))) for i in range(n)] if n > 1 else []
        ways = [(np.arange(n), 1.0), *alone] if n else []
        blocks = [shared]
        for block in _bands(here, columns, cells, kernels):
            start = sum(each.shape[1] for each in blocks)
            ways.append((start + np.arange(block.shape[1]), 1.0))
            blocks.append(block)
        at = np.searchsorted(rows, cells.configuration[here]), np.searchsorted(columns, cells.observable[here])
        laws = _laws(stage, cells, kernels, surfaces)
        return cls(here, rows, at, np.concatenate(blocks, axis=1), tuple(ways), laws, cells.configuration)

    def seen(self, white: Whitening) -> tuple[Floats, Floats]:
        """(N, C, r) and (N, C, e): whitened directions and laws in one configuration each."""
        inverse = white.inverse()
        table = np.zeros((len(inverse), len(self.rows), len(self.directions)))
        table[:, self.at[0], self.at[1]] = inverse[:, self.here]
        laws = [inverse[:, own] @ self.laws[own] for own in (self.configuration == row for row in self.rows)]
        return np.asarray(table @ self.directions), np.stack(laws, axis=1)

    def roots(self, seen: tuple[Floats, Floats], over: Floats) -> list[Floats]:
        """(N, q) for each way and each law, from `seen` and what configurations have in common."""
        lower = np.linalg.cholesky(over[np.ix_(self.rows, self.rows)] + 1e-6 * np.eye(len(self.rows)))
        mixed, laws = (np.tensordot(each, lower, axes=(1, 0)) for each in seen)  # (N, r, C), (N, e, C)
        ways = [weight * mixed[:, columns].reshape(len(mixed), -1) for columns, weight in self.ways]
        return ways + [laws[:, i] for i in range(laws.shape[1])]


def _laws(stage: str, cells: Cells, kernels: Kernels, surfaces: Sequence[Surface]) -> Floats:
    """(N, e): what effects do that are largest in a stage, where they are of middling size; each law once."""
    found: list[Floats] = []
    stages = list(dict.fromkeys(kernels.stage.tolist()))
    for surface in surfaces:
        changes = cells.take(surface.nodes)
        sizes = {name: np.sqrt((changes[:, kernels.stage == name] ** 2).mean(axis=1)) for name in stages}
        size = sizes[stage]
        if size.max() < 1 or max(stages, key=lambda name: sizes[name].max()) != stage:
            continue
        one = changes[np.argmin(np.abs(np.log(np.maximum(size, 1e-9)) - 0.5 * np.log(size.max())))]
        moved = np.bincount(cells.configuration, np.abs(one) > _MOVED * np.abs(one).max())
        if moved.max() <= 1:
            continue  # one observable: every way is that of every effect
        one = one / np.sqrt((one[kernels.stage == stage] ** 2).mean())
        if all(abs(float(one @ other)) < _SAME * np.linalg.norm(one) * np.linalg.norm(other) for other in found):
            found.append(one)
    return np.stack(found, axis=1) if found else np.zeros((len(cells.z), 0))


def _bands(here: Rows, columns: Rows, cells: Cells, kernels: Kernels) -> list[Floats]:
    """(d, r) for each channel with lines over frequency: smooth ways in which its lines may be off, and bands of it.

    The largest eigenvectors of what lines have in common, as large as one tolerance in the channel; and each third of
    the lines alone, in any way.
    """
    first = here[[int(np.argmax(cells.observable[here] == column)) for column in columns]]
    shared = kernels.observables[np.ix_(first, first)] - np.eye(len(columns))
    names = kernels.channel[first]
    found = []
    for name in dict.fromkeys(names.tolist()):
        own = (names == name) & np.isfinite(kernels.octave[first])
        if (shared[np.ix_(own, own)] > 0).any():
            values, vectors = np.linalg.eigh(shared[np.ix_(own, own)])
            kept = vectors[:, np.argsort(values)[::-1][:_DIRECTIONS]]
            rows = np.zeros((len(columns), kept.shape[1]))
            rows[own] = kept * np.sqrt(own.sum() / kept.shape[1])
            lines = np.flatnonzero(own)[(shared[np.ix_(own, own)] > 0).any(axis=1)]
            lines = lines[np.argsort(kernels.octave[first[lines]], kind="stable")]
            found += [rows, *(np.eye(len(columns))[:, part] for part in np.array_split(lines, _BANDS) if part.size)]
    return found


def _directions(here: NDArray[np.intp], columns: NDArray[np.intp], cells: Cells, surfaces: Sequence[Surface]) -> Floats:
    """(d, r): main directions of all effects' changes, each effect of the same weight; together of one tolerance."""
    rows = []
    for surface in surfaces:
        changes = cells.take(surface.nodes)[:, here]
        size = np.sqrt((changes**2).sum(axis=1))
        if size.max(initial=0.0) > 0:
            table = np.zeros((len(changes), len(np.unique(cells.configuration)), len(columns)))
            c = np.searchsorted(np.unique(cells.configuration), cells.configuration[here])
            table[:, c, np.searchsorted(columns, cells.observable[here])] = changes / size.max()
            rows.append(table.reshape(-1, len(columns)) / np.sqrt(len(changes)))
    if not rows:
        return np.zeros((len(columns), 0))
    _, _, axes = np.linalg.svd(np.concatenate(rows), full_matrices=False)
    kept = axes[: min(_DIRECTIONS, len(axes))]
    return np.asarray(kept.T * np.sqrt(len(columns) / len(kept)))
