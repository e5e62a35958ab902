"""In which observables a stage may stray, before configurations and backgrounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from .background import Kernels
from .cells import Cells
from .courses import Course
from .surface import Surface
from .whitening import Whitening

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

#: Directions in which effects of the catalogue move the observables of a stage.
_DIRECTIONS = 4
#: Bands of a channel's lines.
_BANDS = 3
#: What strays by less, in tolerances rms, is none. (A gap that is seen in part only may be larger than it shows.)
_LEAST = 0.6
#: Octaves within which a line has neighbours: a spectrum with Q = 10 shows a mode so wide.
_NEAR = 0.2
#: Two effects whose changes are parallel but for this have one law.
_SAME = 0.995
#: A cell that moves by less of an effect's largest change is left alone by it.
_MOVED = 1e-3


@dataclass(frozen=True, eq=False)
class Laid:
    """Directions (d, r) in which the d observables of a stage may stray, and which of them go together.

    `ways` are a manner, columns and their weight; `laws` (N, e) what each effect does in all stages, one tolerance rms
    in this one: what a sensor between two stages misreads shows in both. With K = L L' over configurations a stray is
    W = L x directions: so they are whitened once, and every course only mixes configurations.
    """

    stage: str
    here: Rows
    rows: Rows  # configurations
    at: tuple[Rows, Rows]  # of each cell
    directions: Floats
    ways: tuple[tuple[str, Rows, float], ...]
    laws: Floats
    configuration: Rows  # of all cells
    detail: NDArray[np.bool_]  # of the stage's cells

    @classmethod
    def of(cls, stage: str, cells: Cells, kernels: Kernels, surfaces: Sequence[Surface]) -> Self:
        here = np.flatnonzero(kernels.stage == stage)
        rows, columns = np.unique(cells.configuration), np.unique(cells.observable[here])
        shared = _directions(here, columns, cells, surfaces)
        n = shared.shape[1]
        alone = [("direction", np.array([i]), float(np.sqrt(n))) for i in range(n)] if n > 1 else []
        ways = [("direction", np.arange(n), 1.0), *alone] if n else []
        blocks = [shared]
        some = [("band", block) for block in _bands(here, columns, cells, kernels)]
        if n == 0 or len(columns) > 1:  # of one observable the directions are its own
            some += [("one", block) for block in _ones(here, columns, cells, kernels)]
        for name, block in some:
            start = sum(each.shape[1] for each in blocks)
            ways.append((name, start + np.arange(block.shape[1]), 1.0))
            blocks.append(block)
        at = np.searchsorted(rows, cells.configuration[here]), np.searchsorted(columns, cells.observable[here])
        laws = _laws(stage, cells, kernels, surfaces)
        every, detail = np.concatenate(blocks, axis=1), kernels.detail[here]
        return cls(stage, here, rows, at, every, tuple(ways), laws, cells.configuration, detail)

    def seen(self, white: Whitening) -> tuple[Floats, Floats]:
        """(N, C, r) and (N, C, e): whitened directions and laws in one configuration each."""
        inverse = white.inverse()
        table = np.zeros((len(inverse), len(self.rows), len(self.directions)))
        table[:, self.at[0], self.at[1]] = inverse[:, self.here]
        laws = [inverse[:, own] @ self.laws[own] for own in (self.configuration == row for row in self.rows)]
        return np.asarray(table @ self.directions), np.stack(laws, axis=1)

    def roots(self, seen: tuple[Floats, Floats], over: Course) -> list[tuple[str, Floats, float]]:
        """Manner and (N, q) for each way and each law, from `seen` and what configurations have in common; and of what
        has one size alone the least one."""
        root = over.root[self.rows]
        mixed, laws = (np.tensordot(each, root, axes=(1, 0)) for each in seen)  # (N, r, k), (N, e, k)
        found = []
        for name, at, weight in self.ways:
            way = self.directions[self.at[1]][:, at[0]] * root[self.at[0], 0]
            found.append((name, weight * mixed[:, at].reshape(len(mixed), -1), _LEAST / (weight * self._size(way))))
        placed = root[np.searchsorted(self.rows, self.configuration[self.here]), 0]
        least = [_LEAST / self._size(self.laws[self.here, i] * placed) for i in range(laws.shape[1])]
        return found + [("law", laws[:, i], least[i]) for i in range(laws.shape[1])]

    def _size(self, way: Floats) -> float:
        """Of a way over the stage's cells, in tolerances: rms of all, or of those that are no details."""
        parts = (way, way[~self.detail])
        return max(float(np.sqrt((part**2).mean())) for part in parts if part.size) or 1e-9


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


def _ones(here: Rows, columns: Rows, cells: Cells, kernels: Kernels) -> list[Floats]:
    """(d, r) for each observable alone, r = 1, where there are no lines; else for each line with its neighbours, in
    every channel for itself: what rings near the plate has its own frequency."""
    first = here[[int(np.argmax(cells.observable[here] == column)) for column in columns]]
    names, octave = kernels.channel[first], kernels.octave[first]
    line = np.isfinite(octave) & (kernels.unit[first] == "dB")
    if not line.any():
        return [one[:, None] for one in np.eye(len(columns))]
    channels = list(dict.fromkeys(names[line].tolist()))
    found = []
    for place in np.unique(octave[line].round(3)):
        near = np.where(line, np.exp(-0.5 * ((np.nan_to_num(octave) - place) / _NEAR) ** 2), 0.0)
        found.append(np.stack([np.where(names == name, near, 0.0) for name in channels], axis=1))
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
