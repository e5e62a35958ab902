"""One way to stray, before a background: what configurations have in common times where in the observables."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Block:
    """Directions in each of C configurations alone, before a background: `whitened` (N, C, a).

    Every course mixes configurations only, and so all of them share the block's products, which are small.
    """

    whitened: Floats

    @cached_property
    def gram(self) -> Floats:
        """(C, a, C, a)"""
        flat = self.whitened.reshape(len(self.whitened), -1)
        return np.asarray((flat.T @ flat).reshape(self.whitened.shape[1:] * 2))

    def along(self, zw: Floats) -> Floats:
        """(C, a) of a whitened gap (N,)."""
        return np.asarray(np.tensordot(zw, self.whitened, axes=(0, 0)))


@dataclass(frozen=True, eq=False)
class Way:
    """One way in which a stage may stray, W W' for a size of one tolerance: W (N + d, q), q = a k, in the N cells is
    `block` mixed by `root` (C, k), and `slopes` (d, q) in the d slopes of what repetitions say beside (`Creep`), where
    it drifts.

    Over the configurations of a `course`; in what observables says the `manner`: in a "direction" in which effects of
    the catalogue move them, in a "band" of a channel's lines, in all of one "mode", as the "law" of one effect, or in
    "one" of them. What has one size alone, q = 1, is larger than `least`: what stays within tolerance is none, and a
    normal density would have a fourth of its weight there.
    """

    stage: str
    course: str
    manner: str
    block: Block
    root: Floats
    slopes: Floats | None = None
    least: float = 0.0

    @property
    def gram(self) -> Floats:
        """(q, q): W' W before the background."""
        mixed = np.tensordot(self.root, self.block.gram, axes=(0, 0))  # (k, a, C, a)
        both = np.tensordot(mixed, self.root, axes=(2, 0)).transpose(1, 0, 2, 3)  # (a, k, a, k)
        found = both.reshape(both.shape[0] * both.shape[1], -1)
        return np.asarray(found if self.slopes is None else found + self.slopes.T @ self.slopes)

    def along(self, projected: Floats, slope: Floats) -> Floats:
        """(q,): W' of a whitened gap, of which the block says `projected`, and of whitened slopes (d,)."""
        found = (projected.T @ self.root).ravel()
        return np.asarray(found if self.slopes is None else found + self.slopes.T @ slope)

    def whitened(self, slopes: int) -> Floats:
        """(N + d, q): W before the background, of so many slopes."""
        cells = np.tensordot(self.block.whitened, self.root, axes=(1, 0)).reshape(len(self.block.whitened), -1)
        beside = np.zeros((slopes, cells.shape[1])) if self.slopes is None else self.slopes
        return np.concatenate([cells, beside])
