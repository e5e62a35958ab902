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
from .creep import Creep
from .surface import Surface
from .way import Block, Way
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
#: Of an effect's sizes those below this share of the largest bend like a small one; how many bends are followed, and
#: how large, over the law, they are at least.
_SMALL, _BENDS, _BENT = 0.03, 2, 0.15
#: A cell that moves by less of an effect's largest change is left alone by it.
_MOVED = 1e-3


@dataclass(frozen=True, eq=False)
class Seen:
    """Blocks of the ways, of the laws at a middling size, and of the paths that laws go along."""

    ways: tuple[Block, ...]
    laws: tuple[Block, ...]
    paths: tuple[Block, ...]


@dataclass(frozen=True, eq=False)
class Laid:
    """Directions (d, r) in which the d observables of a stage may stray, and which of them go together.

    `ways` are a manner, columns and their weight; `laws` (N, e) what effects do in all stages, one tolerance rms in
    this one: what a sensor between two stages misreads shows in both. `path` (e,): which effect's law a column is; the
    first is that of a middling size, others what becomes of it with size. With K = L L' over configurations a stray
    is W = L x directions: so they are whitened once, and every course only mixes configurations.
    """

    stage: str
    here: Rows
    rows: Rows  # configurations
    at: tuple[Rows, Rows]  # of each cell
    directions: Floats
    ways: tuple[tuple[str, Rows, float], ...]
    laws: Floats
    path: Rows
    configuration: Rows  # of all cells
    observable: Rows
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
        some += [("mode", block) for block in _modes(here, columns, cells, kernels)]
        if n == 0 or len(columns) > 1:  # of one observable the directions are its own
            some += [("one", block) for block in _ones(here, columns, cells, kernels)]
        for name, block in some:
            start = sum(each.shape[1] for each in blocks)
            ways.append((name, start + np.arange(block.shape[1]), 1.0))
            blocks.append(block)
        at = np.searchsorted(rows, cells.configuration[here]), np.searchsorted(columns, cells.observable[here])
        laws, path = _laws(stage, cells, kernels, surfaces)
        every, detail = np.concatenate(blocks, axis=1), kernels.detail[here]
        of = cells.configuration, cells.observable
        return cls(stage, here, rows, at, every, tuple(ways), laws, path, *of, detail)

    def seen(self, white: Whitening) -> Seen:
        """Each way and each law in one configuration alone, before a background."""
        inverse = white.inverse
        table = np.zeros((len(inverse), len(self.rows), len(self.directions)))
        table[:, self.at[0], self.at[1]] = inverse[:, self.here]
        mixed = table @ self.directions  # (N, C, r)
        laws = np.stack(
            [inverse[:, own] @ self.laws[own] for own in (self.configuration == row for row in self.rows)], axis=1
        )
        blocks = {at.tobytes(): Block(mixed[:, :, at]) for _, at, _ in self.ways}
        return Seen(
            tuple(blocks[at.tobytes()] for _, at, _ in self.ways),
            tuple(Block(laws[:, :, one : one + 1]) for one in self._firsts),
            tuple(Block(laws[:, :, self.path == self.path[one]]) for one in self._firsts),
        )

    @property
    def _firsts(self) -> list[int]:
        """The law of middling size of each effect."""
        firsts: list[int] = np.unique(self.path, return_index=True)[1].tolist()
        return firsts

    def ways_over(self, seen: Seen, over: Course, creep: Creep) -> list[Way]:
        """Each way and each law over what configurations have in common."""
        root = over.root[self.rows]
        ways, laws = self._leaning(over, creep)
        found = []
        for (name, at, weight), block in zip(self.ways, seen.ways, strict=True):
            way = self.directions[self.at[1]][:, at[0]] * root[self.at[0], 0]
            slopes = None if ways is None else weight * ways[:, at].reshape(len(ways), -1)
            least = _LEAST / (weight * self._size(way))
            found.append(Way(self.stage, over.name, name, block, weight * root, slopes, least))
        placed = root[np.searchsorted(self.rows, self.configuration[self.here]), 0]
        single = root.shape[1] == 1  # one size is that of the law; several may go along its path
        for first, block in zip(self._firsts, seen.laws if single else seen.paths, strict=True):
            along = np.array([first]) if single else np.flatnonzero(self.path == self.path[first])
            slopes = None if laws is None else laws[:, along].reshape(len(laws), -1)
            least = _LEAST / self._size(self.laws[self.here, first] * placed)
            found.append(Way(self.stage, over.name, "law", block, root, slopes, least))
        return found

    def _leaning(self, over: Course, creep: Creep) -> tuple[Floats, Floats] | tuple[None, None]:
        """(d, r, k) and (d, e, k): the same of the slopes of repetitions, whitened; None where nothing drifts."""
        d, e = len(creep.columns), self.laws.shape[1]
        if over.within is None or d == 0:
            return None, None
        own = np.unique(self.observable[self.here])
        ways = np.zeros((d, self.directions.shape[1]))
        kept = np.isin(creep.columns, own)
        ways[kept] = self.directions[np.searchsorted(own, creep.columns[kept])]
        table = np.zeros((len(over.within), int(max(self.observable.max(), creep.columns.max())) + 1, e))
        table[self.configuration, self.observable] = self.laws
        laws = np.einsum("cde,ck->dek", table[:, creep.columns], over.within)
        mixed = creep.noise.white(ways)[:, :, None] * over.within.sum(axis=0)
        return mixed, creep.noise.white(laws.reshape(d, -1)).reshape(laws.shape)

    def _size(self, way: Floats) -> float:
        """Of a way over the stage's cells, in tolerances: rms of all, or of those that are no details."""
        parts = (way, way[~self.detail])
        return max(float(np.sqrt((part**2).mean())) for part in parts if part.size) or 1e-9


def _laws(stage: str, cells: Cells, kernels: Kernels, surfaces: Sequence[Surface]) -> tuple[Floats, Rows]:
    """(N, e): what effects do that are largest in a stage, where they are of middling size, each law once; and how it
    differs where they are smaller or larger. (e,): which belong together."""
    found: list[Floats] = []
    paths: list[Floats] = []
    stages, here = list(dict.fromkeys(kernels.stage.tolist())), kernels.stage == stage
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
        one = one / np.sqrt((one[here] ** 2).mean())
        if all(abs(float(one @ other)) < _SAME * np.linalg.norm(one) * np.linalg.norm(other) for other in found):
            found.append(one)
            paths.append(np.concatenate([one[:, None], _bends(one, changes, here)], axis=1))
    if not found:
        return np.zeros((len(cells.z), 0)), np.zeros(0, dtype=np.intp)
    return np.concatenate(paths, axis=1), np.repeat(np.arange(len(paths)), [each.shape[1] for each in paths])


def _bends(one: Floats, changes: Floats, here: NDArray[np.bool_]) -> Floats:
    """(N, b): main ways in which changes (K, N), as large in the stage as a law, differ from it."""
    size = np.sqrt((changes[:, here] ** 2).mean(axis=1))
    changes = changes[size > _SMALL * size.max()] / size[size > _SMALL * size.max(), None]
    left = changes - np.outer(changes @ one, one) / float(one @ one)
    _, values, axes = np.linalg.svd(left / np.sqrt(len(left)), full_matrices=False)
    bends = (axes * values[:, None])[:_BENDS].T
    return np.asarray(bends[:, np.sqrt((bends[here] ** 2).mean(axis=0)) > _BENT])


def _modes(here: Rows, columns: Rows, cells: Cells, kernels: Kernels) -> list[Floats]:
    """(d, r) for each mode: its frequency, damping and amplitudes, and in every channel the lines near it."""
    first = here[[int(np.argmax(cells.observable[here] == column)) for column in columns]]
    octave, line = kernels.octave[first], kernels.unit[first] == "dB"
    names = kernels.channel[first]
    found = []
    for place in np.unique(octave[np.isfinite(octave) & ~line].round(6)):
        own = np.eye(len(columns))[:, ~line & (np.abs(octave - place) < 1e-5)]
        near = np.where(line, np.exp(-0.5 * ((np.nan_to_num(octave) - place) / _NEAR) ** 2), 0.0)
        lines = [np.where(names == name, near, 0.0) for name in dict.fromkeys(names[line].tolist())]
        found.append(np.column_stack([own, *lines]))
    return found


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
