"""What does not hang on the measured values: whitened tables of effects before every background."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ..gap import GapTable
from .astray import Strays, Ways
from .background import Background, Kernels, bank
from .cells import Cells
from .surface import Surface
from .whitening import Whitening

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Seen:
    """A surface before one background: `nodes` (N, K) whitened, `gram` (K, K), `square` (M,) |change|^2 at points."""

    nodes: Floats
    gram: Floats
    square: Floats


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything about a campaign but the gap itself. `log_prior` of each surface's points; sheets share it evenly."""

    gap: GapTable
    cells: Cells
    kernels: Kernels
    surfaces: tuple[Surface, ...]
    log_prior: tuple[Floats, ...]
    backgrounds: tuple[Mapping[str, Background], ...]
    before: tuple[Whitening, ...]
    seen: tuple[tuple[Seen, ...], ...]  # by surface, by background
    ways: Ways
    _strays: dict[int, Strays] = field(default_factory=dict)

    @classmethod
    def of(cls, gap: GapTable, surfaces: Sequence[Surface]) -> Self:
        cells = Cells.of(gap)
        kernels = Kernels.of(gap, cells)
        backgrounds = bank(gap.stages)
        if not kernels.detail.any():  # of two that differ in details alone one is enough
            backgrounds = tuple(one for one in backgrounds if all(each.detail == 1 for each in one.values()))
        errors = [kernels.background(one) for one in backgrounds]
        before = tuple(Whitening.of(cells.noise + error) for error in errors)
        found = [surface for surface in surfaces if surface.valid.any()]
        sizes = [_size(surface, gap, cells) for surface in found]
        kept = [i for i, size in enumerate(sizes) if np.nanmax(size) > SMALLEST]
        return cls(
            gap=gap,
            cells=cells,
            kernels=kernels,
            surfaces=tuple(found[i] for i in kept),
            log_prior=tuple(_prior(sizes[i]) for i in kept),
            backgrounds=backgrounds,
            before=before,
            seen=_seen([found[i] for i in kept], cells, before),
            ways=Ways.of(gap.stages, cells, kernels, found),
        )

    def strays(self, background: int) -> Strays:
        """Gaps that nothing explains, before one background of the bank; reckoned once."""
        if background not in self._strays:
            self._strays[background] = self.ways.before(self.before[background])
        return self._strays[background]

    def opened(self, sheets: Sequence[int], directions: Floats) -> Self:
        """With U U' added to every background, U (N, q); for these sheets alone."""
        before = tuple(white.opened(directions) for white in self.before)
        seen = list(self.seen)
        for i in sheets:
            pairs = zip(before, self.seen[i], strict=True)
            seen[i] = tuple(_one(self.surfaces[i], white.shortened(each.nodes)) for white, each in pairs)
        return replace(self, before=before, seen=tuple(seen), _strays={})

    @property
    def ids(self) -> tuple[str, ...]:
        """Of the effects, each once."""
        return tuple(dict.fromkeys(surface.id for surface in self.surfaces))

    def sheets(self, identity: str) -> list[int]:
        return [i for i, surface in enumerate(self.surfaces) if surface.id == identity]


#: An effect that nowhere moves anything by so many tolerances cannot be told from none. Below, a prior falls off.
SMALLEST = 1.0


def _seen(surfaces: Sequence[Surface], cells: Cells, before: Sequence[Whitening]) -> tuple[tuple[Seen, ...], ...]:
    """All surfaces are whitened at once: one product for each background."""
    if not surfaces:
        return ()
    nodes = np.concatenate([cells.take(surface.nodes) for surface in surfaces]).T
    ends = np.cumsum([len(surface.nodes) for surface in surfaces])[:-1]
    each = [np.split(white.white(nodes), ends, axis=1) for white in before]
    return tuple(tuple(_one(surface, own[i]) for own in each) for i, surface in enumerate(surfaces))


def _one(surface: Surface, nodes: Floats) -> Seen:
    gram = nodes.T @ nodes
    return Seen(nodes, gram, np.einsum("mk,mk->m", surface.basis @ gram, surface.basis))


def _size(surface: Surface, gap: GapTable, cells: Cells) -> Floats:
    """(M,): how large the effect is in the stage where it is largest, rms in tolerances; NaN where it has no answer."""
    nodes = cells.take(surface.nodes)
    stage = np.array([gap.observables[int(o)].stage for o in cells.observable])
    largest = np.zeros(len(surface.points))
    for name in gap.stages:
        here = nodes[:, stage == name]
        if here.size:
            gram = here @ here.T / here.shape[1]
            square = np.einsum("mk,mk->m", surface.basis @ gram, surface.basis)
            largest = np.maximum(largest, np.sqrt(np.maximum(square, 0.0)))
    return np.where(surface.valid, largest, np.nan)


def _prior(size: Floats) -> Floats:
    """(M,) logarithms: every order of magnitude as likely as another, from the tolerance to the likely range's end.

    An effect within tolerance is none, by what "none" means. Summing to one over the points.
    """
    logs = np.log(np.where(np.isfinite(size) & (size > 0), size, 1e-12))
    inside = np.isfinite(size) & (size > SMALLEST)
    counts, edges = np.histogram(logs[inside], bins=max(4, min(24, int(inside.sum()) // 8)))
    bins = np.clip(np.searchsorted(edges, logs, side="right") - 1, 0, len(counts) - 1)
    weight = np.where(inside, 1.0 / np.maximum(counts[bins], 1), 0.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(weight / weight.sum()))
