"""Marginal likelihoods of none, of every effect alone, and of a gap that no effect explains."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .logs import log_sum
from .scene import Scene, Seen
from .surface import Surface
from .whitening import Whitening

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OnSurface:
    """What a gap says of one sheet: `log_likelihood` (M, B) at its points before each background.

    `log_evidence` is the mean over points by their prior and over backgrounds.
    """

    surface: Surface
    log_prior: Floats
    log_likelihood: Floats
    log_evidence: float

    @property
    def log_posterior(self) -> Floats:
        """(M,) summing to one, over backgrounds."""
        both = self.log_prior + log_sum(self.log_likelihood, axis=1)
        return np.asarray(both - log_sum(both))

    @property
    def best(self) -> tuple[int, int]:
        """The likeliest point and background."""
        joint = self.log_prior[:, None] + self.log_likelihood
        point, background = np.unravel_index(int(np.argmax(joint)), joint.shape)
        return int(point), int(background)


def of_none(scene: Scene, z: Floats) -> Floats:
    """(B,): each background alone."""
    return np.array([white.log_density(z) for white in scene.before])


def of_strays(scene: Scene, z: Floats, under: Iterable[int]) -> dict[str, float]:
    """By stage: a gap of any size beyond tolerance there, over some backgrounds; what others would add counts as 0.

    Effects may choose their background from all of the bank, and so must what nothing explains: over one alone unknown
    causes go unseen.
    """
    found: dict[str, list[float]] = {name: [] for name in scene.gap.stages}
    for background in under:
        strays = scene.strays(background)
        each = strays.log_densities(scene.before[background].white(z), scene.cells.creep.whitened)
        for name, logs in found.items():
            logs.append(strays.log_mean(name, each))
    return {name: float(log_sum(logs)) - float(np.log(len(scene.before))) for name, logs in found.items()}


def of_surface(scene: Scene, index: int, whitened: list[Floats]) -> OnSurface:
    """`whitened` is z before each background."""
    surface, prior = scene.surfaces[index], scene.log_prior[index]
    columns = [
        likelihood(surface, seen, zw, white)
        for seen, zw, white in zip(scene.seen[index], whitened, scene.before, strict=True)
    ]
    return summed(surface, prior, np.stack(columns, axis=1))


def summed(surface: Surface, prior: Floats, log_likelihood: Floats) -> OnSurface:
    total = float(log_sum(prior[:, None] + log_likelihood) - np.log(log_likelihood.shape[1]))
    return OnSurface(surface, prior, log_likelihood, total)


def likelihood(surface: Surface, seen: Seen, zw: Floats, white: Whitening) -> Floats:
    """(M,): -1/2 |z - change|^2 + constant, expanded so that nothing of size M by N is made."""
    return np.asarray(white.log_norm - 0.5 * (zw @ zw - 2 * surface.basis @ (seen.nodes.T @ zw) + seen.square))
